"""How fast a map says what a range finder would see, and how fast a path is found on a grid.

The grids are the bundled arena `office` in cells of 0.05 m, and in so small ones that there are 10,000 or 100,000; the
way leads from the lower left room to the upper right one. scipy's search is Dijkstra's, in C; its graph is made
beforehand.
"""

from __future__ import annotations

import math
import time
from functools import cache
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from boebot.navigation import Lattice, LineMap, search
from boebot.navigation.lattice import Cell
from tools.bench.figures import Peer, figure

POSES, RAYS, REACH = 2000, 120, 4.0  # reach in m
HALF_TURN = (-math.pi / 2, math.pi / 2)
START, GOAL = (-2.45, -1.35), (2.0, 1.0)  # m
CELL = 0.05  # m
FEW, MANY = 10_000, 100_000  # cells


@cache
def office() -> LineMap:
    return LineMap.of("office")


@figure("navigation, scans of 120 rays in the office from a map", "scans/s", at_least=20_000, rounds=3)
def scans() -> float:
    plan, chance = office(), np.random.default_rng(1)
    poses = chance.uniform((-2.9, -1.9, -math.pi), (2.9, 1.9, math.pi), (POSES, 3))
    plan.scans(poses[:1], HALF_TURN, RAYS, REACH)  # the fan is made
    started = time.perf_counter()
    plan.scans(poses, HALF_TURN, RAYS, REACH)
    return POSES / (time.perf_counter() - started)


@cache
def grid(cell: float) -> tuple[Lattice, Cell, Cell]:
    """With the cells of both ends."""
    lattice = Lattice.of(office(), 0.15, 0.1, cell)
    start, goal = (lattice.nearest_free(*place, within=0.5) for place in (START, GOAL))
    assert start is not None and goal is not None
    return lattice, start, goal


def side(cells: int) -> float:
    """Of a cell, when there are so many (m)."""
    low, high = office().bounds
    return math.sqrt(float(np.prod(high - low)) / cells)


def seconds(cell: float) -> float:
    """Of A*."""
    lattice, start, goal = grid(cell)
    started = time.perf_counter()
    found = search(lattice, start, goal)
    took = time.perf_counter() - started
    assert found.path
    return took


@cache
def graph(cell: float) -> Any:
    """The same steps, as scipy wants them."""
    lattice, _, _ = grid(cell)
    steps = [
        (row * lattice.columns + column, other[0] * lattice.columns + other[1], way)
        for row, column in np.argwhere(lattice.free).tolist()
        for other, way in lattice.neighbours((row, column))
    ]
    begin, end, ways = zip(*steps, strict=True)
    return csr_array((ways, (begin, end)), shape=(lattice.free.size, lattice.free.size))


def scipy_seconds(cell: float) -> float:
    """Of scipy's Dijkstra; its path is as long as ours."""
    lattice, start, goal = grid(cell)
    from_node, to_node = (row * lattice.columns + column for row, column in (start, goal))
    made = graph(cell)
    started = time.perf_counter()
    away, _ = dijkstra(made, indices=from_node, return_predecessors=True)
    took = time.perf_counter() - started
    assert math.isclose(away[to_node], search(lattice, start, goal).cost, rel_tol=1e-9)
    return took


def scipy_peer(cells: int | None = None) -> Peer:
    return Peer("scipy.sparse.csgraph.dijkstra", lambda: 1000 * scipy_seconds(CELL if cells is None else side(cells)))


@figure("navigation, A* through the office, cells of 0.05 m", "ms", at_most=200, peers=[scipy_peer()], rounds=3)
def search_office() -> float:
    return 1000 * seconds(CELL)


@figure("navigation, A* through 100,000 cells", "ms", at_most=2000, peers=[scipy_peer(MANY)], rounds=3)
def search_many() -> float:
    return 1000 * seconds(side(MANY))


@figure("navigation, A*: time with 100,000 cells over that with 10,000", "×", rounds=3, of="median")
def growth() -> float:
    return seconds(side(MANY)) / seconds(side(FEW))
