"""Following a path of waypoints by (6.5) to (6.7) of the notes (section 6.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.cognition.odometry import Odometry
from boebot.navigation.steering import SteeredBehavior

if TYPE_CHECKING:
    from boebot.navigation.frames import Point
    from boebot.robot import Robot


@dataclass(kw_only=True)
class FollowPath(SteeredBehavior):
    """Drives from waypoint to waypoint by the brain's Odometry, and stops at the last one, or where there is no path.

    Attributes:
        path: the waypoints that are left, in the frame of the odometry (m).
        arrived: it has come to the last one.
    """

    reach: float = 0.1
    """m from a waypoint at which the next one is headed for"""
    arrival: float = 0.05
    """m from the last one at which it has arrived"""

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "reach", "arrival")

    def forget(self) -> None:
        super().forget()
        self.path: list[Point] = []
        self.arrived = False

    def follow(self, path: Sequence[Point]) -> None:
        """From now on along this path (m, in the frame of the odometry); empty: it stops."""
        self.path, self.arrived = list(path), False

    def step(self, robot: Robot) -> None:
        odometry = self.other(Odometry)
        x, y = odometry.position
        while self.path and math.dist(self.path[0], (x, y)) < (self.arrival if len(self.path) == 1 else self.reach):
            self.arrived = len(self.path) == 1
            del self.path[0]
        if not self.path:
            self.stand(robot)
            return
        to_x, to_y = self.path[0][0] - x, self.path[0][1] - y
        near = math.hypot(to_x, to_y) / (2 * self.reach) if len(self.path) == 1 else 1.0
        self.steer(robot, math.atan2(to_y, to_x) - odometry.heading, min(1.0, max(0.3, near)))
