"""Planned paths beside the shortest ones (section 6.2 of the notes).

A planned path is A*'s on a grid of cells of 0.05 m, tightened. The shortest path that keeps the same distance from all
lines goes along a visibility graph: from corner to corner of the obstacles, grown by that distance (Lozano-Pérez and
Wesley, Communications of the ACM 22, 1979, p. 560-570).
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import shapely.affinity
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from boebot.navigation import Lattice, LineMap, search, tightened
from boebot.navigation.frames import Point
from boebot.navigation.tighten import length

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

RADIUS_M, MARGIN_M, CELL_M = 0.15, 0.1, 0.05
QUARTER = 16  # corners of a quarter of a circle
NEARLY_M = 1e-6  # that a straight way may come nearer, by rounding
SEED = 1
WAYS, ARENAS = 50, 50
LEAST_M = 2.0  # from start to goal
RECTANGLES = 12
SIZE_M = (6.0, 4.0)
SIDES_M = (0.3, 1.2)  # of rectangles
ROUNDING = 1e-12  # m²


class Visibility:
    """Which corners of grown obstacles see each other."""

    def __init__(self, plan: LineMap, clearance: float) -> None:
        solid = shapely.MultiLineString(list(plan.segments)).buffer(clearance, quad_segs=QUARTER)
        self._grown = shapely.buffer(solid, -NEARLY_M)
        shapely.prepare(self._grown)
        rings = [np.array(ring.coords)[:-1] for part in _parts(solid) for ring in (part.exterior, *part.interiors)]
        self._corners: Floats = np.concatenate(rings)
        self._before = np.concatenate([np.roll(ring, 1, axis=0) for ring in rings])
        self._after = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])

        self._edges = self._seen(self._corners, *np.triu_indices(len(self._corners), 1))

    def shortest(self, start: Point, goal: Point) -> float:
        """Length of the shortest path (m); infinite where there is none."""
        count = len(self._corners)
        nodes = np.concatenate((self._corners, [start, goal]))
        to_start = np.full(count, count), np.arange(count)
        to_goal = np.full(count + 1, count + 1), np.arange(count + 1)
        edges = [self._edges, self._seen(nodes, *to_start), self._seen(nodes, *to_goal)]
        one, other = (np.concatenate(ends) for ends in zip(*edges, strict=True))
        away = np.hypot(*(nodes[one] - nodes[other]).T)
        graph = csr_array((away, (one, other)), shape=(len(nodes), len(nodes)))
        return float(dijkstra(graph, directed=False, indices=count)[count + 1])

    def _seen(self, nodes: Floats, one: Numbers, other: Numbers) -> tuple[Numbers, Numbers]:
        """Those of the pairs between which a shortest path may go straight on; nodes are corners and then other
        places."""
        before, after = (np.concatenate((side, nodes[len(side) :])) for side in (self._before, self._after))
        # it bends about corners alone: its ways pass by the obstacle there, at both of their ends
        for turned in (False, True):
            at, to = (other, one) if turned else (one, other)
            passes = _side(nodes[at], nodes[to], before[at]) * _side(nodes[at], nodes[to], after[at]) >= -ROUNDING
            one, other = one[passes], other[passes]
        free = ~shapely.intersects(self._grown, shapely.linestrings(np.stack((nodes[one], nodes[other]), axis=1)))
        return one[free], other[free]


def _parts(shape: Any) -> list[Any]:
    return list(getattr(shape, "geoms", [shape]))


def _side(begin: Floats, end: Floats, point: Floats) -> Floats:
    """Above 0: a point is to the left of the line from begin to end."""
    (x, y), (to_x, to_y) = (end - begin).T, (point - begin).T
    side: Floats = x * to_y - y * to_x
    return side


def ways(plan: LineMap, lattice: Lattice, chance: np.random.Generator, count: int) -> list[tuple[float, float]]:
    """From random places to others, 2 m away or more: lengths of the planned and of the shortest path (m)."""
    visibility, found = Visibility(plan, RADIUS_M + MARGIN_M), list[tuple[float, float]]()
    cells = [(int(row), int(column)) for row, column in np.argwhere(lattice.free)]
    while len(found) < count:
        start, goal = (cells[chance.integers(len(cells))] for _ in range(2))
        if lattice.distance(start, goal) < LEAST_M or not (path := search(lattice, start, goal).path):
            continue
        planned = tightened([lattice.centre(cell) for cell in path], plan, RADIUS_M + MARGIN_M)
        found.append((length(planned), visibility.shortest(planned[0], planned[-1])))
    return found


def random_arena(number: int) -> LineMap:
    """6 m by 4 m with twelve rectangles in it, turned at random; they may overlap."""
    chance = np.random.default_rng((SEED, number))
    boxes = [shapely.box(0, 0, *SIZE_M)]
    for _ in range(RECTANGLES):
        wide, high = chance.uniform(*SIDES_M, 2)
        box = shapely.box(-wide / 2, -high / 2, wide / 2, high / 2)
        turned = shapely.affinity.rotate(box, chance.uniform(0.0, 90.0))
        boxes.append(shapely.affinity.translate(turned, *chance.uniform((0.0, 0.0), SIZE_M)))
    lines = [pair for box in boxes for pair in itertools.pairwise(box.exterior.coords)]
    return LineMap.from_lines(lines, f"random arena {number}")


def of(arena: int | None) -> list[tuple[float, float]]:
    """One way through the random arena of that number, or fifty through the office: lengths of the planned and of the
    shortest path (m)."""
    plan = LineMap.of("office") if arena is None else random_arena(arena)
    lattice = Lattice.of(plan, RADIUS_M, MARGIN_M, CELL_M)
    chance = np.random.default_rng(SEED if arena is None else (SEED, arena))
    return ways(plan, lattice, chance, WAYS if arena is None else 1)
