"""Sweeps of a range finder while the robot stands (section 6.3 of the notes): by a laser, or by a sonar on a turret
that turns from direction to direction.

The turret takes some seconds. A sonar hears the nearest surface within its beam, and does not hear surfaces that it
meets too flatly: `Scan.expected` works with the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from boebot.errors import BrainError
from boebot.navigation.scan_error import Scan

if TYPE_CHECKING:
    from boebot.navigation.frames import Point
    from boebot.robot import Robot

AWAY_S = 1.0  # without a call, and the next one begins anew


def laser_scan(
    robot: Robot, device: str = "laser", place: Point = (0.0, 0.0), reach: float = 4.0, doubtful: float = 0.0
) -> Scan | None:
    """The newest sweep of a laser range finder; None: there is none yet. Terms are those of `Scan`."""
    sweep = getattr(robot, device)
    if not sweep.valid:
        return None
    distances = np.array(sweep.distances, dtype=np.float64)
    return Scan(distances, (sweep.angles[0], sweep.angles[-1]), reach, place, doubtful=doubtful)


@dataclass
class TurretScan:
    """Is called at each step until there is a sweep."""

    directions: int = 19
    """how many"""
    widest: float = math.pi / 2
    """rad to either side"""
    axis: Point = (0.045, 0.0)
    """of the turret, on the robot (m)"""
    arm: float = 0.015
    """m from the axis to the sonar"""
    beam: float = 0.70
    """full opening of the sonar's beam (rad)"""
    grazing: float = math.radians(45.0)
    """angle to its normal from which on a surface is not heard (rad)"""
    reach: float = 2.5
    """m; what is farther counts as nothing"""
    doubtful: float = 0.2
    """share of the directions, those that fit worst, that do not count"""
    settle: float = 0.15
    """s from turning to listening"""
    sonar: str = "ping"
    """its name"""
    _distances: list[float] = field(default_factory=list, init=False)
    _turned_s: float = field(default=-math.inf, init=False)
    _called_s: float = field(default=-math.inf, init=False)

    def __call__(self, robot: Robot) -> Scan | None:
        """The sweep, from right to left; None: it is not done yet."""
        if not 0.0 <= robot.time - self._called_s <= AWAY_S:
            self._distances = []
            self._turn(robot)
        self._called_s = robot.time
        sonar = getattr(robot, self.sonar)
        if (not sonar.valid and not sonar.too_near) or robot.time - sonar.age < self._turned_s + self.settle:
            return None
        is_known = sonar.distance is not None and sonar.distance + self.arm <= self.reach
        self._distances.append(sonar.distance + self.arm if is_known else -1.0)
        if len(self._distances) < self.directions:
            self._turn(robot)
            return None
        robot.turn_turret(0.0)
        self._called_s = -math.inf
        bearings = -self.widest, self.widest
        return Scan(np.array(self._distances), bearings, self.reach, self.axis, self.beam, self.grazing, self.doubtful)

    def _turn(self, robot: Robot) -> None:
        done = len(self._distances)
        robot.turn_turret(self.widest * (2 * done / (self.directions - 1) - 1))
        self._turned_s = robot.time


@dataclass
class Sweep:
    """By the robot's laser, or where it has none by the sonar on its turret. Is called as a `TurretScan` is."""

    turret: TurretScan = field(default_factory=TurretScan)
    doubtful: float = 0.1
    """share of the laser's rays, those that fit worst, that do not count: beside an edge a ray is off by metres where
    the pose is off by little"""

    def __call__(self, robot: Robot) -> Scan | None:
        """The sweep; None: it is not done yet.

        Raises:
            BrainError: the robot has neither.
        """
        if robot.has("laser"):
            return laser_scan(robot, doubtful=self.doubtful)
        if not robot.has("turret"):
            raise BrainError(f"robot {robot.name!r} has neither a laser nor a turret to sweep with; roller has a laser")
        return self.turret(robot)
