"""How badly a real scan fits what a map lets expect at a pose: (6.8) of the notes.

    ε(p) = √( 1/ν Σ χ_i (1 - δ_i(p) / d_i)² )

d_i: measured, δ_i: expected at p; χ_i = 1 where both are known; ν = Σ χ_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from boebot.navigation.line_map import LineMap

Floats = NDArray[np.float64]
NEAREST_M = 0.02  # a nearer reading says nothing


@dataclass(frozen=True)
class Scan:
    """One sweep of a range finder at rest.

    Attributes:
        distances: from right to left (m); -1 or NaN: nothing within reach.
        bearings: of the first and the last ray, from the robot's heading (rad).
        reach: of each ray (m).
        place: of the range finder on the robot: x, y (m).
    """

    distances: Floats
    bearings: tuple[float, float]
    reach: float
    place: tuple[float, float] = (0.0, 0.0)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which rays have met something, far enough away, shape (rays,)."""
        known: NDArray[np.bool_] = self.distances >= NEAREST_M  # NaN: not
        return known

    def thinned(self, rays: int) -> Scan:
        """Every so many-th ray of it, about that many in all."""
        every = max(1, len(self.distances) // rays)
        kept = self.distances[::every]
        step = (self.bearings[1] - self.bearings[0]) / (len(self.distances) - 1)
        return Scan(kept, (self.bearings[0], self.bearings[0] + step * every * (len(kept) - 1)), self.reach, self.place)

    def expected(self, plan: LineMap, poses: ArrayLike) -> Floats:
        """What the map lets expect at poses of the robot, shape (n, 3): distances (m), shape (n, rays)."""
        at = np.array(poses, dtype=np.float64).reshape(-1, 3)
        x, y = self.place
        cosine, sine = np.cos(at[:, 2]), np.sin(at[:, 2])
        at[:, 0] += x * cosine - y * sine
        at[:, 1] += x * sine + y * cosine
        return plan.scans(at, self.bearings, len(self.distances), self.reach)

    def errors(self, plan: LineMap, poses: ArrayLike, least: int = 20) -> Floats:
        """ε at each pose, shape (n,); infinite where fewer than `least` rays are known on both sides."""
        expected = self.expected(plan, poses)
        both = self.known & (expected >= 0.0)
        count = both.sum(axis=1)
        measured = np.where(self.known, self.distances, 1.0)
        square = (np.where(both, 1.0 - expected / measured, 0.0) ** 2).sum(axis=1)
        return np.where(count >= least, np.sqrt(square / np.maximum(count, 1)), np.inf)
