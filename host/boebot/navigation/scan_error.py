"""How badly a real scan fits what a map lets expect at a pose: (6.8) of the notes.

    ε(p) = √( 1/ν Σ χ_i (1 - δ_i(p) / d_i)² )

d_i: measured, δ_i: expected at p; χ_i = 1 where both are known; ν = Σ χ_i.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from boebot.navigation.line_map import LineMap

Floats = NDArray[np.float64]
NEAREST_M = 0.02  # a nearer reading says nothing
LEAST = 20  # rays, for less may fit anywhere
IN_BEAM = 4  # rays from one beam's middle to the next one's


@dataclass(frozen=True)
class Scan:
    """One sweep of a range finder at rest.

    Attributes:
        distances: from right to left (m); -1, NaN or infinite: nothing within reach.
        bearings: of the first and the last ray, from the robot's heading (rad).
        reach: of each ray (m).
        place: of the range finder on the robot: x, y (m).
        beam: full opening of each ray's beam (rad): the nearest surface in it counts. 0: of a laser, a line.
        grazing: angle to its normal from which on a surface sends nothing back (rad), as of a sonar.
        doubtful: share of the rays, those that fit worst, that do not count for the error: whether a sonar hears an
            edge or not makes metres.
    """

    distances: Floats
    bearings: tuple[float, float]
    reach: float
    place: tuple[float, float] = (0.0, 0.0)
    beam: float = 0.0
    grazing: float = math.pi / 2
    doubtful: float = 0.0

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which rays have met something, far enough away, shape (rays,)."""
        known: NDArray[np.bool_] = (self.distances >= NEAREST_M) & (self.distances < np.inf)  # NaN: not
        return known

    def thinned(self, rays: int) -> Scan:
        """Every so many-th ray of it, about that many in all."""
        every = max(1, len(self.distances) // rays)
        kept, first = self.distances[::every], self.bearings[0]
        step = (self.bearings[1] - first) / (len(self.distances) - 1)
        return replace(self, distances=kept, bearings=(first, first + step * every * (len(kept) - 1)))

    def expected(self, plan: LineMap, poses: ArrayLike) -> Floats:
        """What the map lets expect at poses of the robot, shape (n, 3): distances (m), shape (n, rays)."""
        at = np.array(poses, dtype=np.float64).reshape(-1, 3)
        x, y = self.place
        cosine, sine = np.cos(at[:, 2]), np.sin(at[:, 2])
        at[:, 0] += x * cosine - y * sine
        at[:, 1] += x * sine + y * cosine
        count, (first, last) = len(self.distances), self.bearings
        if self.beam == 0.0:
            return plan.scans(at, self.bearings, count, self.reach)
        step = (last - first) / (count - 1) / IN_BEAM
        aside = round(self.beam / 2 / step)  # rays to either side of a beam's middle
        ends = first - aside * step, last + aside * step
        rays = heard(plan.scans(at, ends, (count - 1) * IN_BEAM + 1 + 2 * aside, self.reach), step, self.grazing)
        nearest = sliding_window_view(rays, 2 * aside + 1, axis=1)[:, ::IN_BEAM].min(axis=2)
        return np.where(np.isinf(nearest), -1.0, nearest)

    def errors(self, plan: LineMap, poses: ArrayLike) -> Floats:
        """ε at each pose, shape (n,); infinite where too few rays are known on both sides: less than 20 (40 % of one
        with few rays), or than half of those that have met something."""
        expected = self.expected(plan, poses)
        both = self.known & (expected >= 0.0)
        count = both.sum(axis=1)
        measured = np.where(self.known, self.distances, 1.0)
        squares = np.where(both, 1.0 - expected / measured, 0.0) ** 2
        left_out = int(self.doubtful * len(self.distances))
        kept = np.sort(squares, axis=1)[:, : len(self.distances) - left_out]
        least = max(min(LEAST, 0.4 * len(self.distances)), 0.5 * self.known.sum())
        error = np.sqrt(kept.sum(axis=1) / np.maximum(count - left_out, 1))
        return np.where(count >= least, error, np.inf)


def heard(ranges: Floats, step: float, grazing: float) -> Floats:
    """What a sonar hears along neighbouring rays: the distance, or infinity where the surface is met too flatly.

    Where two rays end on one surface, it lies along the line between their ends: with α between the rays, the angle ψ
    to the normal has tan ψ = (d_2 - d_1 cos α) / (d_1 sin α). The smaller of those to both neighbours counts.

    Args:
        ranges: distances (m), -1 where there is nothing, shape (n, rays).
        step: α (rad).
        grazing: the greatest angle to the normal (rad).
    """
    far: Floats = np.where(ranges < 0.0, np.inf, ranges)
    before = np.concatenate((far[:, :1] * np.inf, far[:, :-1]), axis=1)
    behind = np.concatenate((far[:, 1:], far[:, -1:] * np.inf), axis=1)
    with np.errstate(invalid="ignore"):
        slope = np.fmin(*(np.abs(other - far * math.cos(step)) / (far * math.sin(step)) for other in (before, behind)))
    return np.where(slope <= math.tan(grazing), far, np.inf)
