"""How much of an arena a range finder has seen: sensory area coverage (section 6.1 of the notes).

The free part of a map is divided into cells. A cell has been seen when its centre lay within the fan of a sweep, within
reach, and not behind what the ray towards it met.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boebot.navigation.lattice import Lattice, cells_of
from boebot.navigation.line_map import LineMap

BEHIND_M = 0.04  # a cell whose centre lies so far behind the end of a ray still counts: its border is seen
TURN_RAD, WAY_M = math.radians(15.0), 0.2  # from sweep to sweep


class Coverage:
    """What was seen of a map.

    Attributes:
        lattice: the cells of the floor, for no robot to drive on; those that are not free need not be seen.
        seen: which cells were seen, shape (rows, columns).
    """

    def __init__(self, plan: LineMap, cell: float = 0.05) -> None:
        """Nothing was seen yet. `cell`: side of a cell (m)."""
        self._plan = plan
        shape, self._centres = cells_of(plan, cell)
        self.lattice = Lattice(~plan.is_solid(self._centres).reshape(shape), cell, *plan.bounds[0].tolist())
        self.seen: NDArray[np.bool_] = np.zeros_like(self.lattice.free)
        self._cells, self._centres = np.argwhere(self.lattice.free), self._centres[self.lattice.free.ravel()]

    def add(self, pose: Sequence[float], bearings: tuple[float, float], rays: int, reach: float) -> None:
        """A sweep was taken at a pose (m, m, rad); terms as of `LineMap.scans`."""
        (distances,) = self._plan.scans([pose], bearings, rays, reach)
        distances = np.where(distances < 0, reach, distances)
        dx, dy = self._centres[:, 0] - pose[0], self._centres[:, 1] - pose[1]
        away = np.hypot(dx, dy)
        turned = np.remainder(np.arctan2(dy, dx) - pose[2] + math.pi, 2 * math.pi) - math.pi
        ray = np.rint((turned - bearings[0]) / (bearings[1] - bearings[0]) * (rays - 1)).astype(int)
        within = (ray >= 0) & (ray < rays) & (away <= reach)
        within &= away <= distances[np.clip(ray, 0, rays - 1)] + BEHIND_M
        self.seen[tuple(self._cells[within].T)] = True

    def add_path(self, poses: ArrayLike, bearings: tuple[float, float], rays: int, reach: float) -> None:
        """Sweeps along a path of poses, shape (n, 3), each 0.2 m of way or 15 degrees of turning."""
        last = (math.inf, math.inf, 0.0)
        for x, y, heading in np.asarray(poses, dtype=np.float64).tolist():
            turned = abs(math.remainder(heading - last[2], 2 * math.pi))
            if math.dist((x, y), last[:2]) >= WAY_M or turned >= TURN_RAD:
                last = (x, y, heading)
                self.add(last, bearings, rays, reach)

    @property
    def share(self) -> float:
        """Of the free cells that were seen, 0 to 1."""
        return float(self.seen[self.lattice.free].mean())
