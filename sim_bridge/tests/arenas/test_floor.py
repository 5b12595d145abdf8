"""Lines on the floor, against shapely; and what a line sensor sees of them, against its law."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import LineString, Point

from boebot.arenas import Arena, ArenaDescription
from boebot.arenas.compiled import lib
from boebot.arenas.description import Line

COORDINATE = st.floats(-2, 2, allow_nan=False).map(lambda value: round(value, 3))
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=2, max_size=6)


def distinct(points: list[tuple[float, float]]) -> bool:
    return all(Point(a).distance(Point(b)) > 0.01 for a, b in pairwise(points))


@given(POINTS, POINTS, st.floats(0.01, 0.5), COORDINATE, COORDINATE)
def test_the_floor_is_that_of_the_last_line_there(
    first: list[tuple[float, float]], last: list[tuple[float, float]], width: float, x: float, y: float
) -> None:
    assume(distinct(first) and distinct(last))
    lines = [
        Line(points_m=first, width_m=width, floor_reflectance=0.1),
        Line(points_m=last, width_m=width, floor_reflectance=0.3),
    ]
    arena = Arena(ArenaDescription(name="floor", floor_reflectance=0.7, line=lines))
    expected = 0.7
    for points, share in ((first, 0.1), (last, 0.3)):
        distance = LineString(points).distance(Point(x, y))
        assume(abs(distance - width / 2) > 1e-9)
        if distance < width / 2:
            expected = share
    assert lib.arena_floor_reflectance(arena.handle, x, y) == expected
