"""Localization by laser (section 6.3 of the notes): the robot stops, scans, and corrects where it believes to be.

Two frames: the pose of the brain's Odometry is continuous and drifts; `Localization.pose` is in the map, and jumps when
a scan says so. Motor behaviors steer by the first, planners think in the second; `to_odometry` leads from one to the
other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess, MotorBehavior
from boebot.brain.variables import StateVariable
from boebot.cognition.odometry import Odometry
from boebot.navigation.estimators import Estimate, Estimator, RandomSearch
from boebot.navigation.frames import Point, Pose, composed, inverse, placed
from boebot.navigation.line_map import LineMap
from boebot.navigation.scan_error import Scan
from boebot.navigation.steering import stand
from boebot.navigation.sweep import Sweep

if TYPE_CHECKING:
    from boebot.brain.process import Process
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Localization(MotorBehavior):
    """Stops, scans and corrects. Give it a utility that follows `due_variable`.

    Attributes:
        estimates: what came of each scan, with the time (s), oldest first.
        lost: the last two scans fitted nowhere.
    """

    plan: LineMap
    """the map"""
    start: Pose = (0.0, 0.0, 0.0)
    """where it believes to be in the map when the run begins (m, m, rad)"""
    every: float = 10.0
    """s from scan to scan"""
    settle: float = 0.5
    """s from stopping the motors to the scan; a sweep must be newer than the last movement"""
    estimator: Estimator = field(default_factory=RandomSearch)
    """who works out the pose"""
    scan: Callable[[Robot], Scan | None] = field(default_factory=Sweep)
    """what takes a sweep: the laser, or a sonar on a turret"""

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "every", "settle")
        if not isinstance(self.plan, LineMap):
            raise checks.refused(self, "plan", 'a LineMap, as LineMap.of("office")')
        if np.shape(self.start) != (3,) or not np.isfinite(self.start).all():
            raise checks.refused(self, "start", "x (m), y (m), heading (rad)")
        if isinstance(self.estimator, type) or not hasattr(self.estimator, "correct"):
            raise checks.refused(self, "estimator", "an estimator, as RandomSearch()")

    def forget(self) -> None:
        self.estimates: list[tuple[float, Estimate]] = []
        self.lost = False
        self._last_s = 0.0
        self._correction: Pose | None = None

    def companions(self) -> Sequence[Process]:
        return [_Mover(localization=self, name=f"{self.name}_mover")]

    # ---- where it is -------------------------------------------------------------------------------------------------

    @property
    def correction(self) -> Pose:
        """Where the frame of the odometry lies in the map (m, m, rad)."""
        if self._correction is None:  # the run begins
            self._correction = composed(self.start, inverse(self.other(Odometry).pose))
        return self._correction

    @property
    def pose(self) -> Pose:
        """In the map: x (m), y (m), heading (rad)."""
        return composed(self.correction, self.other(Odometry).pose)

    @property
    def uncertainty(self) -> Pose:
        """One standard deviation of it (m, m, rad)."""
        return self.estimator.uncertainty

    def to_odometry(self, points: Sequence[Point]) -> list[Point]:
        """Points of the map (m) in the frame of the odometry."""
        return placed(inverse(self.correction), points)

    @property
    def due_variable(self) -> StateVariable:
        """ "due": 1 when the last scan is `every` seconds old, else 0."""
        return StateVariable("due", self._is_due)

    def _is_due(self, robot: Robot) -> float:
        return float(robot.time - self._last_s >= self.every)

    def ask(self) -> None:
        """A scan is due at once."""
        self._last_s = -math.inf

    # ---- the scan ----------------------------------------------------------------------------------------------------

    def enter(self, robot: Robot) -> None:
        self._stopped_s = robot.time

    def step(self, robot: Robot) -> None:
        stand(robot, self._stopped_s)
        if robot.time - self._stopped_s > self.settle - 1e-9 and (sweep := self.scan(robot)) is not None:
            self._correct(robot, sweep)

    def _correct(self, robot: Robot, sweep: Scan) -> None:
        estimate = self.estimator.correct(sweep)
        self.estimates.append((robot.time, estimate))
        self.lost = len(self.estimates) > 1 and not any(one.found for _, one in self.estimates[-2:])
        self._last_s = robot.time
        if estimate.found:
            self._correction = composed(estimate.pose, inverse(self.other(Odometry).pose))


@dataclass(kw_only=True)
class _Mover(CognitiveProcess):
    """Tells the estimator how the robot moves, at each step."""

    localization: Localization

    def enter(self, robot: Robot) -> None:
        home = self.localization
        home.estimator.begin(home.plan, home.pose, home.random)
        self._pose = self.other(Odometry).pose

    def step(self, robot: Robot) -> None:
        before, self._pose = self._pose, self.other(Odometry).pose
        self.localization.estimator.move(composed(inverse(before), self._pose))
