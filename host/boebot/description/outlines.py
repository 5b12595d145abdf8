"""What a collision outline may be: a simple polygon around the middle of the axle, section 3.2.5 of the notes."""

from __future__ import annotations

import math
from collections.abc import Sequence

Point = tuple[float, float]

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
    for i in range(count):
        for k in range(i + 1, count):
            if _conflict(edges[i], edges[k], k == i + 1 or (i == 0 and k == count - 1)):
                return f": edges {i} and {k} cross or touch; expected a polygon whose edges do not"
    if not _is_inside(edges):
        return ": the middle of the axle, [0, 0], lies outside; expected an outline around it"
    for i, angle in enumerate(_corner_angles(corners)):
        if angle < CORNER_DEG:
            return (
                f"[{i}] is a corner of {angle:.3g}°; expected at least {CORNER_DEG:g}°, or a short edge across its tip"
            )
    return ""


def _corner_angles(corners: Sequence[Point]) -> list[float]:
    """The angle within each corner, degrees, in [0, 360)."""
    count = len(corners)
    twice = sum(_side((0.0, 0.0), corners[i - 1], corners[i]) for i in range(count))
    turns = [(corners[i - 1], corners[i], corners[(i + 1) % count]) for i in range(count)]
    ways = [
        (math.atan2(a[1] - b[1], a[0] - b[0]), math.atan2(c[1] - b[1], c[0] - b[0])) for a, b, c in turns
    ]  # from each corner to the one before and the one after it
    return [math.degrees((back - on if twice > 0 else on - back) % math.tau) for back, on in ways]


def _side(a: Point, b: Point, p: Point) -> float:
    """Twice the area of a triangle: > 0 if p lies to the left of the way from a to b."""
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


def _conflict(one: tuple[Point, Point], other: tuple[Point, Point], neighbours: bool) -> bool:
    (a, b), (c, d) = one, other
    if neighbours:  # they meet in a corner, and may not go back on each other
        shared, p, q = (b, a, d) if b == c else (a, b, c)
        back = (p[0] - shared[0]) * (q[0] - shared[0]) + (p[1] - shared[1]) * (q[1] - shared[1])
        return back > 0 and abs(_side(shared, p, q)) <= 1e-9 * back
    if any(max(a[i], b[i]) < min(c[i], d[i]) or max(c[i], d[i]) < min(a[i], b[i]) for i in (0, 1)):
        return False
    return _side(a, b, c) * _side(a, b, d) <= 0 and _side(c, d, a) * _side(c, d, b) <= 0


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
