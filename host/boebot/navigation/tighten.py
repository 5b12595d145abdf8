"""A path tightened: waypoints that are not needed go (Fig. 6.6 of the notes, right).

A path from cell to cell turns by 45 or 90 degrees. Where the straight way from one waypoint to a later one keeps its
distance from all lines, those between go.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from boebot.navigation.frames import Point
    from boebot.navigation.line_map import LineMap


def tightened(path: Sequence[Point], plan: LineMap, clearance: float) -> list[Point]:
    """The path (m) with as few waypoints as keep that distance (m) from all lines; the ends stay."""
    if len(path) < 3:
        return list(path)
    kept, here = [path[0]], 0
    while here < len(path) - 1:
        after = len(path) - 1
        while after > here + 1 and not is_clear(plan, path[here], path[after], clearance):
            after -= 1
        kept.append(path[after])
        here = after
    return kept


def is_clear(plan: LineMap, begin: Point, end: Point, clearance: float) -> bool:
    """Whether the straight way between two places (m) keeps that distance (m) from all lines, and meets none."""
    return segment_distance(plan, begin, end) >= clearance - 1e-9


def segment_distance(plan: LineMap, begin: Point, end: Point) -> float:
    """From a straight way (m) to the nearest line (m); 0 where it meets one."""
    lines = plan.segments
    a, b = np.array(begin), np.array(end)
    if _meets_any(a, b, lines):
        return 0.0
    ends = _to_segment(lines.reshape(-1, 2), a, b).min() if len(lines) else math.inf
    return float(min(ends, *plan.distance(np.array([a, b])))) if len(lines) else math.inf


def length(path: Sequence[Point]) -> float:
    """Of a path (m)."""
    return sum(math.dist(one, other) for one, other in itertools.pairwise(path))


def _meets_any(a: np.ndarray, b: np.ndarray, lines: np.ndarray) -> bool:
    """Whether the segment a b properly crosses one of the lines."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        crossed: np.ndarray = (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (
            r[..., 0] - p[..., 0]
        )
        return crossed

    c, d = lines[:, 0], lines[:, 1]
    one, other = side(a, b, c) * side(a, b, d), side(c, d, a) * side(c, d, b)
    return bool(((one < 0) & (other < 0)).any())


def _to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """From each point to the segment a b (m)."""
    way = b - a
    square = float(way @ way)
    along = np.clip(((points - a) @ way) / square, 0.0, 1.0) if square else np.zeros(len(points))
    away: np.ndarray = np.hypot(*(points - a - along[:, None] * way).T)
    return away
