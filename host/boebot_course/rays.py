"""Rays and segments one at a time, section 3.2.3 of the notes, (3.2)-(3.8): to try things out and to check results.

A whole arena is asked by `Arena.ray`, which has an index. Lengths in m, angles in rad.
"""

from __future__ import annotations

import math

import numpy as np

from boebot.arenas.compiled import ffi, lib
from boebot.errors import ArenaError

Point = tuple[float, float]
REACH_M = float(lib.ARENA_FARTHEST_M)  # of a ray unless one is said


def ray_segment(x: float, y: float, angle: float, p1: Point, p2: Point, reach: float = REACH_M) -> float | None:
    """Distance (m) from (x, y) in direction `angle` (rad) to the segment p1 p2, None if it is not met within `reach`.

    A ray along the segment meets its nearer end. Answered by the same code as rays in an arena.

    Raises:
        ArenaError: the segment has no length, or a number is not finite.
    """
    numbers = (x, y, angle, reach, *p1, *p2)
    if not all(map(math.isfinite, numbers)) or max(map(abs, numbers)) > REACH_M:
        raise ArenaError(
            f"segment {p1} to {p2}, ray from {(x, y)} at {angle}: expected finite numbers within ±{REACH_M:,.0f}"
        )
    wall = ffi.gc(lib.arena_new(), lib.arena_destroy)
    xy = ffi.from_buffer("double[]", np.array((p1, p2), dtype=np.float64))
    if lib.arena_repeated(xy, 2, False) >= 0:
        raise ArenaError(f"segment {p1} to {p2}: expected two points apart")
    lib.arena_add_edges(wall, xy, 2, lib.ARENA_WALL, ffi.NULL)
    lib.arena_use_index(wall, lib.ARENA_INDEX_NONE)
    distance: float = lib.arena_ray(wall, x, y, math.cos(angle), math.sin(angle), reach, 0.0, ffi.NULL)
    return None if distance < 0 else distance


def bearing_interval(v1: Point, v2: Point) -> tuple[float, float]:
    """Bearings (rad) under which the segment from v1 to v2 is seen from the origin: the first and the last.

    Counter-clockwise; the first in (-pi, pi], the last less than pi beyond it, and so above pi where the segment lies
    across the negative x axis.

    Raises:
        ArenaError: it goes through the origin, from where it is seen under every bearing or none.
    """
    cross = v1[0] * v2[1] - v1[1] * v2[0]
    inner = v1[0] * v2[0] + v1[1] * v2[1]
    if not math.isfinite(cross + inner) or (cross == 0.0 and inner <= 0.0):
        raise ArenaError(f"segment {v1} to {v2}: expected finite numbers, and that it does not go through the origin")
    first = v1 if cross >= 0.0 else v2
    begin = math.atan2(first[1], first[0])
    return begin, begin + math.atan2(abs(cross), inner)
