"""What works out where in a map the robot is: the notes' random search (section 6.3), behind the interface that it
shares with the particle filter (boebot.navigation.particle_filter).
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from boebot.navigation.frames import Pose, composed
from boebot.navigation.line_map import LineMap
from boebot.navigation.match import search_pose
from boebot.navigation.scan_error import Scan


@dataclass(frozen=True)
class Estimate:
    """What is known after a scan.

    Attributes:
        pose: in the map: x (m), y (m), heading (rad).
        uncertainty: one standard deviation of each (m, m, rad).
        error: ε of the scan there, by (6.8).
        found: the scan fits the map there; else a `Localization` keeps the pose that it had.
    """

    pose: Pose
    uncertainty: Pose
    error: float
    found: bool


class Estimator(Protocol):
    """Keeps where the robot is."""

    @property
    def pose(self) -> Pose:
        """Where it is (m, m, rad)."""

    @property
    def uncertainty(self) -> Pose:
        """One standard deviation (m, m, rad)."""

    def begin(self, plan: LineMap, pose: Pose, source: random.Random) -> None:
        """A run begins; `source`: of chance."""

    def move(self, step: Pose) -> None:
        """The robot has moved by that much, as its odometry says, in its own frame before (m, m, rad)."""

    def correct(self, scan: Scan) -> Estimate:
        """The robot stands still, and has scanned."""


@dataclass
class RandomSearch:
    """The notes' way: search about the odometric pose; if nothing fits, keep it and search wider the next time.

    While the robot moves its uncertainty grows with the way and the turning; after a scan that fits it is that of the
    search.
    """

    box: Pose = (0.1, 0.1, 0.1)
    """full widths of the search (m, m, rad)"""
    tries: int = 200
    """N"""
    wide_box: Pose = (0.3, 0.3, 0.3)
    """after a scan that did not fit (m, m, rad)"""
    wide_tries: int = 500
    """N then"""
    enough: float = 0.02
    """T: twice the ε of a range finder with 1 % noise; below it the odometry is left as it is"""
    growth: float = 0.05
    """of the uncertainty, for each m of way and rad of turning"""
    farthest: tuple[float, float] = (0.3, 0.5)
    """from where odometry has it (m, rad): a scan that fits beyond is not believed, as the search would walk on to any
    place that looks much like the true one"""
    found_within: Pose = (0.02, 0.02, 0.01)
    """uncertainty after a scan that fits (m, m, rad)"""

    def begin(self, plan: LineMap, pose: Pose, source: random.Random) -> None:
        """See `Estimator`."""
        self._plan, self.pose, self._source = plan, pose, source
        self.uncertainty: Pose = self.found_within
        self._failures = 0

    def move(self, step: Pose) -> None:
        """See `Estimator`."""
        self.pose = composed(self.pose, step)
        more = self.growth * math.hypot(step[0], step[1]), self.growth * abs(step[2])
        x, y, heading = self.uncertainty
        self.uncertainty = x + more[0], y + more[0], heading + more[1]

    def correct(self, scan: Scan) -> Estimate:
        """See `Estimator`."""
        narrow = self._failures == 0
        box, tries = (self.box, self.tries) if narrow else (self.wide_box, self.wide_tries)
        match = search_pose(scan, self._plan, self.pose, self._source, box=box, tries=tries, enough=self.enough)
        found = match.error < 3 * self.enough and self._is_near(match.pose)
        self._failures = 0 if found else self._failures + 1
        if found:
            self.pose, self.uncertainty = match.pose, self.found_within
        return Estimate(self.pose, self.uncertainty, match.error, found)

    def _is_near(self, pose: Pose) -> bool:
        turn = math.remainder(pose[2] - self.pose[2], 2 * math.pi)
        return math.dist(pose[:2], self.pose[:2]) <= self.farthest[0] and abs(turn) <= self.farthest[1]


def mean_of(poses: np.ndarray, weights: np.ndarray) -> tuple[Pose, Pose]:
    """Weighted mean and standard deviation of poses, shape (n, 3); headings on the circle."""
    x, y = (float(weights @ poses[:, k]) for k in (0, 1))
    cosine, sine = float(weights @ np.cos(poses[:, 2])), float(weights @ np.sin(poses[:, 2]))
    spread = [math.sqrt(max(0.0, float(weights @ (poses[:, k] - mean) ** 2))) for k, mean in ((0, x), (1, y))]
    length = min(1.0, max(math.hypot(cosine, sine), 1e-12))
    return (x, y, math.atan2(sine, cosine)), (spread[0], spread[1], math.sqrt(-2.0 * math.log(length)))
