"""Localization by a particle filter (Monte Carlo localization; Thrun, Burgard and Fox, Probabilistic Robotics,
chapter 8): many poses that may be true, moved by odometry with noise, weighed by each scan, and drawn anew by weight.

Some of them are drawn from the whole map when the scans fit worse than they used to: so it finds itself after it was
carried away.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from boebot.errors import BrainError
from boebot.navigation.estimators import Estimate, mean_of
from boebot.navigation.frames import Pose
from boebot.navigation.line_map import LineMap
from boebot.navigation.scan_error import Scan

Floats = NDArray[np.float64]
OUTLIERS = 0.05  # share of the rays that may say anything


@dataclass
class ParticleFilter:
    """A particle filter."""

    particles: int = 400
    """how many"""
    sigma: float = 0.05
    """of a ray: share of its range that noise and the map's errors come to"""
    rays: int = 30
    """of a scan that are heeded: neighbours say nearly the same"""
    way_noise: float = 0.1
    """m for each m of way"""
    turn_noise: float = 0.1
    """rad for each rad of turning, and for each m of way"""
    enough: float = 0.02
    """T, as of the random search: ε of 3 T is a fit"""
    fast: float = 0.5
    """share of the newest scan in the short-term fit"""
    slow: float = 0.05
    """share of the newest scan in the long-term fit"""
    candidates: int = 4000
    """poses anywhere in the map that are tried when some are drawn there"""
    spread: Pose = (0.05, 0.05, 0.05)
    """of the particles at the start (m, m, rad)"""
    jitter: Pose = (0.03, 0.03, 0.03)
    """that is added when they are drawn anew (m, m, rad): particles that are alike find nothing better"""

    def __post_init__(self) -> None:
        if not (self.particles >= 1 and self.rays >= 1 and self.candidates >= 1 and self.sigma > 0):
            raise BrainError(f"{self}: expected particles, rays, candidates from 1, and sigma above 0")

    def begin(self, plan: LineMap, pose: Pose, source: random.Random) -> None:
        """See `boebot.navigation.estimators.Estimator`."""
        self._plan = plan
        self._chance = np.random.default_rng(source.getrandbits(64))
        self._poses: Floats = np.array(pose) + self._chance.normal(size=(self.particles, 3)) * self.spread
        self._weights: Floats = np.full(self.particles, 1.0 / self.particles)
        self._fast = self._slow = 0.0

    @property
    def pose(self) -> Pose:
        """See `boebot.navigation.estimators.Estimator`."""
        return mean_of(self._poses, self._weights)[0]

    @property
    def uncertainty(self) -> Pose:
        """See `boebot.navigation.estimators.Estimator`."""
        return mean_of(self._poses, self._weights)[1]

    def move(self, step: Pose) -> None:
        """See `boebot.navigation.estimators.Estimator`."""
        way, turn = math.hypot(step[0], step[1]), abs(step[2])
        if way == 0.0 and turn == 0.0:
            return
        noise = self._chance.normal(size=self._poses.shape)
        x = step[0] + noise[:, 0] * self.way_noise * way
        y = step[1] + noise[:, 1] * self.way_noise * way
        heading = self._poses[:, 2]
        cosine, sine = np.cos(heading), np.sin(heading)
        self._poses[:, 0] += cosine * x - sine * y
        self._poses[:, 1] += sine * x + cosine * y
        self._poses[:, 2] = heading + step[2] + noise[:, 2] * self.turn_noise * (turn + way)

    def correct(self, scan: Scan) -> Estimate:
        """See `boebot.navigation.estimators.Estimator`."""
        thin = scan.thinned(self.rays)
        fits = self._fits(thin, self._poses)
        newest = float(np.exp(fits).mean())
        self._slow += self.slow * (newest - self._slow) if self._slow else newest
        self._fast += self.fast * (newest - self._fast) if self._fast else newest
        self._weights = _weights(fits, self.rays)
        pose, uncertainty = mean_of(self._poses, self._weights)
        error = float(scan.errors(self._plan, [pose])[0])
        self._draw_anew(thin, max(0.0, 1.0 - self._fast / self._slow))
        return Estimate(pose, uncertainty, error, error < 3 * self.enough)

    def _fits(self, scan: Scan, poses: Floats) -> Floats:
        """How well each pose explains the scan: the mean logarithm of a ray's likelihood, up to 0, shape (n,)."""
        expected = scan.expected(self._plan, poses)
        measured = np.where(scan.known, scan.distances, scan.reach)
        off = (np.where(expected < 0.0, scan.reach, expected) - measured) / (self.sigma * measured)
        # a ray may be wrong for a reason that no map knows: none rules a pose out
        likely: Floats = np.log(OUTLIERS + (1.0 - OUTLIERS) * np.exp(-0.5 * off**2)).mean(axis=1)
        return likely

    def _draw_anew(self, scan: Scan, share: float) -> None:
        """By weight (low variance), and that share of them anywhere in the map where the scan fits."""
        count = self.particles
        at = (self._chance.random() + np.arange(count)) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(self._weights), at), count - 1)
        self._poses = self._poses[chosen]
        anywhere = np.flatnonzero(self._chance.random(count) < share)
        if len(anywhere):
            tried = free_poses(self._plan, self.candidates, self._chance)
            weights = _weights(self._fits(scan, tried), self.rays)
            self._poses[anywhere] = tried[self._chance.choice(len(tried), len(anywhere), p=weights)]
        self._poses = self._poses + self._chance.normal(size=self._poses.shape) * self.jitter
        self._weights = np.full(count, 1.0 / count)


def free_poses(plan: LineMap, count: int, chance: np.random.Generator) -> Floats:
    """Poses anywhere in a map where nothing is solid, shape (count, 3)."""
    low, high = plan.bounds
    found = np.empty((0, 2))
    while len(found) < count:
        points = chance.uniform(low, high, (2 * count + 10, 2))
        found = np.vstack((found, points[~plan.is_solid(points)]))
    return np.column_stack((found[:count], chance.uniform(-math.pi, math.pi, count)))


def _weights(fits: Floats, rays: int) -> Floats:
    """Of particles by their fits: in proportion to the likelihood of all rays."""
    weights: Floats = np.exp(rays * (fits - fits.max()))
    weights /= weights.sum()
    return weights
