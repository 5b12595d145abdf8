"""Driving down a potential field: (6.4) to (6.7) of the notes, and what to do where it locks (Fig. 6.13)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess
from boebot.cognition.odometry import Odometry
from boebot.errors import BrainError
from boebot.navigation.potential_field import Potential, PotentialField, check_goal, waypoints
from boebot.navigation.search import search
from boebot.navigation.steering import SteeredBehavior
from boebot.navigation.tighten import tightened

if TYPE_CHECKING:
    from boebot.navigation.frames import Pose
    from boebot.navigation.lattice import Lattice
    from boebot.navigation.line_map import LineMap
    from boebot.navigation.localization import Localization
    from boebot.robot import Robot

FLAT = 1e-6  # 1/m; a field with less slope leads nowhere


@dataclass(kw_only=True)
class FollowField(SteeredBehavior):
    """Drives down the field to its goal, and stops there; stops as well where the field is flat, or where it is locked
    and there is no way around.

    Attributes:
        arrived: it is at the goal.
        lost: the field is flat here.
        no_path: it is locked, and its lock detector knows no way around; it stands until one is found.
        way: valleys that lead around something; each goes when the robot passes it.
    """

    goal: Potential
    """a valley; wide: half the arena at least, for it must be felt everywhere"""
    hills: Sequence[Potential] = ()
    """of what stands there"""
    moving: Callable[[Robot], Iterable[Potential]] | None = None
    """hills of what moves, as they are now"""
    arrival: float = 0.1
    """m from the goal at which it has arrived"""
    passing: float = 0.25
    """L: m from a valley of the way at which it has been passed"""
    localization: Localization | None = None
    """whose map the field is in; None: it is in the frame of the odometry"""

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "arrival", "passing")
        if self.goal.alpha >= 0:
            raise BrainError(f"{self.name}: the goal's alpha is {self.goal.alpha:g}; expected a valley, below 0")
        check_goal(PotentialField.of([self.goal, *self.hills]), (self.goal.x, self.goal.y), self.arrival)

    def forget(self) -> None:
        super().forget()
        self.arrived = self.lost = self.no_path = False
        self.way: list[Potential] = []

    @property
    def pose(self) -> Pose:
        """Where the robot is, in the frame of the field (m, m, rad)."""
        return self.other(Odometry).pose if self.localization is None else self.localization.pose

    def step(self, robot: Robot) -> None:
        x, y, heading = self.pose
        self.arrived = math.dist((x, y), (self.goal.x, self.goal.y)) < self.arrival
        self.way = [valley for valley in self.way if math.dist((x, y), (valley.x, valley.y)) >= self.passing]
        now = () if self.moving is None else self.moving(robot)
        slope = PotentialField.of([self.goal, *self.hills, *self.way, *now]).gradient(np.array((x, y)))
        self.lost = bool(np.hypot(*slope) < FLAT)
        if self.arrived or self.lost or self.no_path:
            self.stand(robot)
        else:
            self.steer(robot, math.atan2(-slope[1], -slope[0]) - heading)
        robot.show(f"{self.name}_state", self.state)

    @property
    def state(self) -> str:
        """ "arrived", "lost", "no path" or "on the way"; shown as `follow_field_state`."""
        if self.arrived:
            return "arrived"
        if self.lost:
            return "lost"
        return "no path" if self.no_path else "on the way"


@dataclass(kw_only=True)
class LockDetector(CognitiveProcess):
    """Notices that the robot comes no further though it has not arrived, and puts valleys on a way around. Where there
    is none it says so to the behavior, which stands, and looks again after the same time.

    Attributes:
        locked: times (s) at which it noticed.
    """

    field: FollowField
    """the behavior that may be locked"""
    plan: LineMap
    """the map on which a way is looked for"""
    lattice: Lattice
    """of the map, with the robot's size"""
    clearance: float
    """m that the way keeps from all lines"""
    time: float = 5.0
    """s in which it should have moved"""
    distance: float = 0.05
    """m that it should have moved then"""

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "time", "distance", "clearance")

    def forget(self) -> None:
        self.locked: list[float] = []
        self._seen: deque[tuple[float, float, float]] = deque()

    def step(self, robot: Robot) -> None:
        x, y, _ = self.field.pose
        self._seen.append((robot.time, x, y))
        while robot.time - self._seen[0][0] > self.time + 1e-9:
            self._seen.popleft()
        begun_s, first_x, first_y = self._seen[0]
        is_long = robot.time - begun_s >= self.time - 2 * self.step_time
        if is_long and not self.field.arrived and math.dist((x, y), (first_x, first_y)) < self.distance:
            if not self.field.no_path:
                self.locked.append(robot.time)
            self._seen.clear()
            way = self._around((x, y))
            self.field.way, self.field.no_path = way or [], way is None

    def _around(self, here: tuple[float, float]) -> list[Potential] | None:
        """Valleys at the corners of the shortest way from here to the goal; None: there is no way."""
        goal = self.field.goal
        start, target = (self.lattice.nearest_free(*place, within=1.0) for place in (here, (goal.x, goal.y)))
        if start is None or target is None:
            return None
        path = [self.lattice.centre(cell) for cell in search(self.lattice, start, target).path]
        return waypoints(tightened(path, self.plan, self.clearance)) if path else None
