"""Arenas: files, rays, distances, free space."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from boebot.arenas import Arena, ArenaDescription, Moving, Polygon, Waypoint, arena_names, load_arena
from boebot.errors import ArenaError
from sim_bridge.compiled import lib
from sim_bridge.tests.simulated import arena_of, distance_to_segments, square

coordinates = st.floats(-5, 5).map(lambda v: round(v, 6))
angles = st.floats(-math.pi, math.pi)


@st.composite
def polygons(draw: st.DrawFn) -> list[tuple[float, float]]:
    """Star-shaped, hence simple."""
    x, y = draw(coordinates), draw(coordinates)
    count = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(0.05, 1.5), min_size=count, max_size=count))
    turn = draw(angles)
    return [
        (x + r * math.cos(turn + 2 * math.pi * i / count), y + r * math.sin(turn + 2 * math.pi * i / count))
        for i, r in enumerate(radii)
    ]


arenas = st.lists(polygons(), min_size=1, max_size=12).map(lambda shapes: arena_of(*shapes))


def shapely_ray(arena: Arena, x: float, y: float, angle: float, reach: float) -> float | None:
    ray = shapely.LineString([(x, y), (x + reach * math.cos(angle), y + reach * math.sin(angle))])
    walls = shapely.union_all([shapely.LinearRing(corners) for corners in arena.outlines])
    hit = ray.intersection(walls)
    return None if hit.is_empty else float(shapely.Point(x, y).distance(hit))


@given(arenas, coordinates, coordinates, angles, st.floats(0.1, 8))
def test_rays_agree_with_shapely(arena: Arena, x: float, y: float, angle: float, reach: float) -> None:
    expected = shapely_ray(arena, x, y, angle, reach)
    found = arena.ray(x, y, angle, reach)
    if expected is None or found is None:
        # They may differ only where the ray just grazes or just reaches something.
        closer = shapely_ray(arena, x, y, angle, reach * (1 + 1e-9))
        assert (
            expected is found is None
            or (closer is not None and closer >= reach * (1 - 1e-9))
            or grazes(arena, x, y, angle)
        )
    elif abs(found - expected) > 1e-9:
        assert grazes(arena, x, y, angle)


def grazes(arena: Arena, x: float, y: float, angle: float) -> bool:
    """Whether the ray passes a corner so closely that rounding decides."""
    corners = np.concatenate(arena.outlines) - (x, y)
    return bool((np.abs(corners @ [-math.sin(angle), math.cos(angle)]) < 1e-9).any())


@given(arenas, coordinates, coordinates, angles)
def test_grid_changes_no_answer(arena: Arena, x: float, y: float, angle: float) -> None:
    def answers() -> tuple[float | None, float, bool]:
        return arena.ray(x, y, angle, 20.0), lib.arena_clearance(arena.handle, x, y, 1.0), arena.is_free(x, y, 0.07)

    lib.arena_use_index(arena.handle, lib.ARENA_INDEX_NONE)
    without = answers()
    lib.arena_use_index(arena.handle, lib.ARENA_INDEX_GRID)
    assert answers() == without


@given(arenas, coordinates, coordinates)
def test_clearance_is_the_distance_to_the_nearest_edge(arena: Arena, x: float, y: float) -> None:
    assert lib.arena_clearance(arena.handle, x, y, 20.0) == pytest.approx(distance_to_segments(arena, x, y), abs=1e-12)


def test_no_ray_slips_through_a_shared_corner() -> None:
    """One of the defects of the notes' simulator."""
    arena = arena_of(outline=square(0, 0, 2))
    for angle in np.linspace(-math.pi, math.pi, 20_001):
        assert arena.ray(0, 0, angle, 5) is not None
    for corner in square(0, 0, 2):
        assert arena.ray(0, 0, math.atan2(corner[1], corner[0]), 5) == pytest.approx(math.sqrt(2))


def test_ray_along_an_edge_meets_its_nearer_end() -> None:
    """(3.8), collinear case."""
    arena = arena_of(square(2, 0.5, 1))
    assert arena.ray(0, 0, 0, 5) == pytest.approx(1.5)
    assert arena.ray(0, 1, 0, 5) == pytest.approx(1.5)
    assert arena.ray(2, 0, 0, 5) == 0
    assert arena.ray(4, 0, 0, 5) is None


@given(arenas, coordinates, coordinates)
@example(arena_of([(1.0, 1e-277), (-0.5, 0.866), (-0.5, -0.866)]), 0.0, 0.0)
def test_free_space_is_outside_of_obstacles(arena: Arena, x: float, y: float) -> None:
    solid = shapely.union_all([shapely.Polygon(corners) for corners in arena.outlines])
    point = shapely.Point(x, y)
    if solid.boundary.distance(point) < 1e-9 or abs(solid.distance(point) - 0.07) < 1e-9:
        return
    edges_apart = distance_to_segments(arena, x, y) >= 0.07
    assert arena.is_free(x, y, 0.07) == (not solid.contains(point) and edges_apart)


@pytest.mark.parametrize("radius", [0.0, 1e-6, 0.05])
@pytest.mark.parametrize("shape", [{"radius_m": 0.1}, {"corners_m": square(0, 0, 0.2)}], ids=["disc", "polygon"])
def test_within_what_moves_nothing_is_free(shape: dict[str, Any], radius: float) -> None:
    arena = Arena(ArenaDescription(name="one", moving=[Moving(path=[Waypoint(0, 0.5, 0)], **shape)]))
    for x in (0.5, 0.45, 0.599, 0.401):
        assert not arena.is_free(x, 0, radius)
    assert arena.is_free(0.601 + radius, 0, radius)
    assert arena.is_free(0.5, -0.101 - radius, radius)


@pytest.mark.parametrize("name", arena_names())
def test_bundled_arenas_load_and_let_the_robot_start(name: str) -> None:
    arena = load_arena(name)
    x, y, _ = arena.start
    assert arena.name == name
    assert arena.is_free(x, y, 0.12)


def test_the_notes_arena() -> None:
    arena = load_arena("arsim")
    assert [arena.ray(0, 0, k * math.pi / 2, 5) for k in range(4)] == pytest.approx([1.8] * 4)
    assert arena.ray(0, 0, 3 * math.pi / 4, 5) == pytest.approx(math.hypot(0.7, 0.7))


GOOD = """
name = "mine"
[[outline]]
corners_m = [[0, 0], [1, 0], [1, 1], [0, 1]]
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name = ", "mine.toml is no valid TOML"),
        ("title = 'x'", "mine.toml: the key 'name' is missing"),
        (GOOD + "colour = 'red'", "mine.toml:5: outline[0]: there is no key 'colour' here; expected corners_m, name"),
        (GOOD.replace("[0, 1]]", "[0, 'a']]"), "mine.toml:4: outline[0].corners_m[3][1]: expected float, got str"),
        (
            GOOD.replace("[0, 1]]", "[0, nan]]"),
            "mine.toml:4: outline[0].corners_m[3][1]: expected a finite number",
        ),
        (GOOD.replace("[0, 1]]", "[0, 1e6]]"), "mine.toml:4: outline[0].corners_m[3][1]: expected float <= 1000"),
        (
            GOOD.replace(", [1, 1], [0, 1]", ""),
            "mine.toml:4: outline[0].corners_m: expected array of length >= 3",
        ),
        (GOOD.replace("[0, 1]]", "[1, 1]]"), "corners_m[2] and the point after it are the same"),
        (
            GOOD.replace("[0, 1]]", "[0, 1], [0, 0]]"),
            "corners_m[4] and the point after it are the same",
        ),
        (GOOD.replace("[1, 1], [0, 1]", "[0, 1], [1, 1]"), "edges 1 and 3 cross or touch"),
        (
            GOOD.replace("[1, 1], [0, 1]", "[0.5, 0]"),
            "edges 0 and 1 cross or touch; expected a polygon whose edges do not",
        ),
        ("name = 'mine'\n[start]\nx_m = 'left'", "mine.toml:3: start.x_m: expected float, got str"),
    ],
)
def test_wrong_file_is_told_in_one_sentence(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ArenaError) as caught:
        load_arena(path)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_good_file_loads(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD, encoding="utf-8")
    assert load_arena(str(path)).ray(0.5, 0.5, 0, 2) == pytest.approx(0.5)


@pytest.mark.parametrize("name", ["nowhere", "../room", "missing.toml", ""])
def test_unknown_arena(name: str) -> None:
    with pytest.raises(ArenaError, match="there is no arena"):
        load_arena(name)


@given(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=7))
def test_what_is_accepted_is_a_simple_polygon(corners: list[tuple[float, float]]) -> None:
    description = ArenaDescription(name="random", obstacle=[Polygon(corners)])
    valid = shapely.Polygon(corners).is_valid
    try:
        Arena(description)
    except ArenaError:
        # Shapely also takes polygons that touch themselves in a point and corners repeated; we take neither.
        distinct = len(set(corners)) == len(corners)
        ring = shapely.LinearRing(corners)
        assert not valid or not distinct or not ring.is_simple or shapely.Polygon(corners).area < 1e-9
    else:
        assert valid
