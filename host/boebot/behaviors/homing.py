"""Homing by path integration, and a search where home should be (section 4.4.4 of the notes; search: the
kit's own).

    inbound: straight along the home vector h, φ_ref = atan2(h), until |h| < 0.1 m
    search:  an expanding square spiral about the place where h = 0, until something says that home is found

The legs of the spiral are 1, 1, 2, 2, 3, 3, ... pitches long, each a quarter turn left of the last: parallel legs lie
one pitch apart. The robot keeps integrating its path throughout, and holds to the legs by what that says.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.behaviors.straight_run import within_signals
from boebot.brain import checks
from boebot.brain.machine import Machine, State
from boebot.brain.process import MotorBehavior
from boebot.cognition.odometry import wrapped
from boebot.cognition.path_integration import PathIntegration

if TYPE_CHECKING:
    from boebot.robot import Robot

ON_THE_SPOT = math.pi / 4  # rad off the heading from which on it turns without driving


@dataclass(kw_only=True)
class Homing(MotorBehavior):
    """Goes home by the brain's PathIntegration, searches there, and stays once home is found.

    Args:
        found: what says that home is here, with 0.5 or more: a landmark, a whisker, a beacon. None: it searches on
            and on.
        signal: motor signal on the way home.
        search_signal: motor signal in the search.
        turn: largest motor signal of turning.
        gain: motor signal of turning for each rad off the heading.
        arrival: m from home by the home vector at which the search begins.
        pitch: m between parallel legs of the spiral.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        arrived: time (s) at which the search began, or None.
        home: time (s) at which home was found, or None.
    """

    NEEDS = ("compass",)

    found: Callable[[Robot], float | None] | None = None
    signal: float = 0.5
    search_signal: float = 0.25
    turn: float = 0.4
    gain: float = 0.6
    arrival: float = 0.1
    pitch: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "arrival", "pitch", "signal", "search_signal", "turn", "gain")
        checks.signals(self, "signal", "search_signal", "turn")

    def forget(self) -> None:
        self.arrived: float | None = None
        self.home: float | None = None

    def enter(self, robot: Robot) -> None:
        self.forget()
        self.machine = Machine(robot, self.inbound)

    def step(self, robot: Robot) -> None:
        if self.home is None and self.found is not None and (checks.reading(self, self.found, robot) or 0.0) >= 0.5:
            self.home = robot.time
            self.machine.go(robot, self.stay)
        self.machine.step(robot)

    # ---- states --------------------------------------------------------------------------------------------------

    def inbound(self, robot: Robot) -> State | None:
        """Along the home vector."""
        path = self.other(PathIntegration)
        if path.distance < self.arrival:
            self.arrived = robot.time
            self._leg, self._first = 0, path.heading
            return self.search(robot)
        self._steer(robot, path.direction, self.signal)
        return None

    def search(self, robot: Robot) -> State | None:
        """Along the spiral's legs, one after the other."""
        path = self.other(PathIntegration)
        heading = self._first + self._leg * math.pi / 2
        ahead = math.cos(heading), math.sin(heading)
        (x, y), begin = path.position, corner(self._leg, self.pitch, self._first)
        x, y = x - begin[0], y - begin[1]
        if x * ahead[0] + y * ahead[1] >= leg_length(self._leg, self.pitch):
            self._leg += 1  # from the next step on
        left = y * ahead[0] - x * ahead[1]  # m that it is left of the leg
        self._steer(robot, heading - math.atan2(left, self.pitch), self.search_signal)
        return self.search

    def stay(self, robot: Robot) -> State | None:
        """At home."""
        robot.drive(0.0, 0.0)
        return None

    def _steer(self, robot: Robot, heading: float, signal: float) -> None:
        """Drives on under that heading (rad), or turns to it on the spot."""
        off = wrapped(heading - self.other(PathIntegration).heading)
        turn = min(max(self.gain * off, -self.turn), self.turn)
        signal = signal if abs(off) < ON_THE_SPOT else 0.0
        robot.drive(within_signals(signal - turn), within_signals(signal + turn))


def leg_length(leg: int, pitch: float) -> float:
    """m; legs count from 0."""
    return pitch * (leg // 2 + 1)


def corner(leg: int, pitch: float, first: float = 0.0) -> tuple[float, float]:
    """Where a leg of the spiral begins (m from its middle), if the first one has the heading `first` (rad).

    Every second one lies on a diagonal: after 4 j legs (-j, -j), a quarter turn before (-j, j), before that (j, j) ...
    """
    ring, side = divmod(leg, 4)
    # four legs add (-1, -1); the ring's own legs are 2 ring + 1, + 1, + 2, + 2 long
    x, y = -float(ring), -float(ring)
    lengths = (2 * ring + 1, 2 * ring + 1, 2 * ring + 2)
    for index, (east, north) in enumerate(((1, 0), (0, 1), (-1, 0))[:side]):
        x, y = x + east * lengths[index], y + north * lengths[index]
    cos, sin = math.cos(first), math.sin(first)
    return pitch * (x * cos - y * sin), pitch * (x * sin + y * cos)
