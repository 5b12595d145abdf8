"""How fast a map says what a range finder would see, and how fast a path is found on a grid.

The grid is the bundled arena `office` in cells of 0.05 m; the way leads from the lower left room to the upper right
one. scipy's search is Dijkstra's, in C; its graph is made
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
from tools.tests.bench.figures import Peer, figure, loop_s

POSES, RAYS, REACH = 2000, 120, 4.0  # reach in m
HALF_TURN = (-math.pi / 2, math.pi / 2)
START, GOAL = (-2.45, -1.35), (2.0, 1.0)  # m
CELL = 0.05  # m
LOOPS = Peer("loops of 1,000 turns in Python", lambda: 1000 / loop_s(1_000_000))


@cache
def office() -> LineMap:
    return LineMap.of("office")


@figure("navigation, scans of 120 rays in the office from a map", "scans/s", times_at_least=30, peers=[LOOPS], rounds=3)
def scans() -> float:
    plan, chance = office(), np.random.default_rng(1)
    poses = chance.uniform((-2.9, -1.9, -math.pi), (2.9, 1.9, math.pi), (POSES, 3))
    plan.scans(poses[:1], HALF_TURN, RAYS, REACH)  # the fan is made
    started = time.perf_counter()
    plan.scans(poses, HALF_TURN, RAYS, REACH)
    return POSES / (time.perf_counter() - started)


@cache
def grid() -> tuple[Lattice, Cell, Cell]:
    """With the cells of both ends."""
    lattice = Lattice.of(office(), 0.15, 0.1, CELL)
    start, goal = (lattice.nearest_free(*place, within=0.5) for place in (START, GOAL))
    assert start is not None and goal is not None
    return lattice, start, goal


def seconds() -> float:
    """Of A*."""
    lattice, start, goal = grid()
    started = time.perf_counter()
    found = search(lattice, start, goal)
    took = time.perf_counter() - started
    assert found.path
    return took


@cache
def graph() -> Any:
    """The same steps, as scipy wants them."""
    lattice, _, _ = grid()
    steps = [
        (row * lattice.columns + column, other[0] * lattice.columns + other[1], way)
        for row, column in np.argwhere(lattice.free).tolist()
        for other, way in lattice.neighbours((row, column))
    ]
    begin, end, ways = zip(*steps, strict=True)
    return csr_array((ways, (begin, end)), shape=(lattice.free.size, lattice.free.size))


def scipy_seconds() -> float:
    """Of scipy's Dijkstra; its path is as long as ours."""
    lattice, start, goal = grid()
    from_node, to_node = (row * lattice.columns + column for row, column in (start, goal))
    made = graph()
    started = time.perf_counter()
    away, _ = dijkstra(made, indices=from_node, return_predecessors=True)
    took = time.perf_counter() - started
    assert math.isclose(away[to_node], search(lattice, start, goal).cost, rel_tol=1e-9)
    return took


SCIPY = Peer("scipy.sparse.csgraph.dijkstra", lambda: 1000 * scipy_seconds())


@figure("navigation, A* through the office, cells of 0.05 m", "ms", times_at_most=100, peers=[SCIPY], rounds=3)
def search_office() -> float:
    return 1000 * seconds()
