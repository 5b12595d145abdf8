"""What a collision outline may be: a simple polygon around the middle of the axle, section 3.2.5 of the notes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from boebot.arenas.description import Point, crossing

EXTENT_M = 5.0  # a corner's coordinates, at most
EDGE_M = 1e-4  # an edge's length, at least
CORNER_DEG = 15.0  # an outward corner's angle, at least: a sharper one would be rounded by more than 0.1 mm


def polygon_fault(corners: Sequence[Point], most: int) -> str:
    """The error of these corners (m) as an outline, as the words behind their key; "": none."""
    count = len(corners)
    if not 3 <= count <= most:
        return f" has {count} corners; expected 3 to {most}"
    for i, (x, y) in enumerate(corners):
        if not (abs(x) <= EXTENT_M and abs(y) <= EXTENT_M):
            return f"[{i}] is [{x:g}, {y:g}]; expected numbers within ±{EXTENT_M:g} m"
    edges = [(corners[i], corners[(i + 1) % count]) for i in range(count)]
    for i, (a, b) in enumerate(edges):
        if math.dist(a, b) < EDGE_M:
            return f"[{i}] and the corner after it are the same; expected an edge"
    if fault := crossing(corners):
        return fault
    if not _is_inside(edges):
        return ": the middle of the axle, [0, 0], lies outside; expected an outline around it"
    for i, angle in enumerate(_corner_angles(edges)):
        if angle < CORNER_DEG:
            return (
                f"[{i}] is a corner of {angle:.3g}°; expected at least {CORNER_DEG:g}°, or a short edge across its tip"
            )
    return ""


def _corner_angles(edges: Sequence[tuple[Point, Point]]) -> list[float]:
    """The angle within the corner where each edge begins, degrees, in [0, 360)."""
    ways = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in edges]
    is_left = sum(a[0] * b[1] - a[1] * b[0] for a, b in edges) > 0  # counter-clockwise
    turns = [on - before if is_left else before - on for before, on in pairwise((ways[-1], *ways))]
    return [math.degrees((math.pi - turn) % math.tau) for turn in turns]


def _is_inside(edges: Sequence[tuple[Point, Point]]) -> bool:
    """Whether the origin lies within the polygon, by the crossings of a ray along x."""
    inside = False
    for a, b in edges:
        if (a[1] > 0) != (b[1] > 0) and a[0] - a[1] * (b[0] - a[0]) / (b[1] - a[1]) > 0:
            inside = not inside
    return inside


def way_out(corners: Sequence[Sequence[float]]) -> float:
    """Distance from the origin, which lies in the polygon, along the x axis to the first edge."""
    found = []
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if min(y0, y1) <= 0.0 <= max(y0, y1):
            found += [x0, x1] if y0 == y1 else [x0 + (x1 - x0) * y0 / (y0 - y1)]
    return min((x for x in found if x > 0.0), default=0.0)
