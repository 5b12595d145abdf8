"""Rays of the arena: closed forms, an independent solver, shapely; and that no index changes any answer."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge._core import ffi, lib
from sim_bridge.arena import Floats
from sim_bridge.tests.simulated import square

INDEXES = (lib.ARENA_INDEX_NONE, lib.ARENA_INDEX_GRID, lib.ARENA_INDEX_LISTS_AT_ONCE)

coordinates = st.floats(-3, 3).map(lambda v: round(v, 3))
angles = st.floats(-math.pi, math.pi)


class Shapes:
    """An arena built up shape by shape."""

    def __init__(self) -> None:
        self.handle = ffi.gc(lib.arena_new(), lib.arena_destroy)
        self.rings: list[shapely.Geometry] = []

    def polygon(self, corners: Any, height: float | None = None) -> Shapes:
        return self._add(lib.arena_add_polygon, shapely.LinearRing, corners, lib.ARENA_OBSTACLE, height=height)

    def wall(self, corners: Any, height: float | None = None) -> Shapes:
        return self._add(lib.arena_add_wall, shapely.LineString, corners, height=height)

    def disc(self, x: float, y: float, radius: float, height: float | None = None) -> Shapes:
        assert lib.arena_add_disc(self.handle, x, y, radius, _surface(height)) >= 0
        return self

    def _add(self, add: Any, ring: Any, corners: Any, *kind: int, height: float | None) -> Shapes:
        xy = np.array(corners, dtype=np.float64)
        assert add(self.handle, ffi.from_buffer("double[]", xy), len(xy), *kind, _surface(height)) >= 0
        self.rings.append(ring(corners))
        return self

    def build(self, index: int = lib.ARENA_INDEX_LISTS) -> Shapes:
        lib.arena_use_index(self.handle, index)
        return self

    def ray(self, x: float, y: float, angle: float, reach: float = 1e3, height: float = 0.0) -> tuple[float, int]:
        """Distance and item; -1, -1 if nothing is met."""
        item = ffi.new("uint32_t *", 0)
        distance = lib.arena_ray(self.handle, x, y, math.cos(angle), math.sin(angle), reach, height, item)
        return (distance, item[0]) if distance >= 0 else (-1.0, -1)


def _surface(height: float | None) -> Any:
    return ffi.NULL if height is None else ffi.new("arena_surface *", [height, 1.0, 1.0])


def ring_of(x: float, y: float, radius: float, corners: int) -> Floats:
    turn = np.arange(corners) * 2 * math.pi / corners
    return np.column_stack((x + radius * np.cos(turn), y + radius * np.sin(turn)))


@st.composite
def scenes(draw: st.DrawFn) -> Shapes:
    """Some of everything; finely cut rings as well, whose corners lie close together."""
    shapes = Shapes()
    for _ in range(draw(st.integers(1, 6))):
        x, y = draw(coordinates), draw(coordinates)
        size = draw(st.sampled_from([0.02, 0.1, 0.5, 1.7]))
        height = draw(st.sampled_from([None, 0.05]))
        kind = draw(st.sampled_from(["ring", "square", "wall", "disc"]))
        if kind == "ring":
            shapes.polygon(ring_of(x, y, size, draw(st.sampled_from([3, 5, 40, 200]))), height)
        elif kind == "square":
            shapes.polygon(square(x, y, size), height)
        elif kind == "wall":
            shapes.wall([(x, y), (x + size, y), (x + size, y - 2 * size)][: draw(st.integers(2, 3))], height)
        else:
            shapes.disc(x, y, size, height)
    return shapes


@given(scenes(), coordinates, coordinates, angles, st.sampled_from([0.3, 1.0, 30.0]), st.sampled_from([0.0, 0.1]))
def test_an_index_changes_no_answer(
    scene: Shapes, x: float, y: float, turn: float, reach: float, height: float
) -> None:
    """Not one bit, and not which of two equally near edges is met."""
    toward = [(ring.coords[0][0] - x, ring.coords[0][1] - y) for ring in scene.rings]
    looks = [*(turn + k * math.pi / 20 for k in range(40)), *(math.atan2(dy, dx) for dx, dy in toward)]
    looks += [k * math.pi / 2 for k in range(4)]
    answers = []
    for index in INDEXES:
        scene.build(index)
        answers.append([scene.ray(x, y, look, reach, height) for look in looks])
    assert answers[0] == answers[1] == answers[2]


@given(scenes(), coordinates, coordinates)
def test_an_index_changes_nothing_about_what_is_near(scene: Shapes, x: float, y: float) -> None:
    def answers() -> list[Any]:
        near = [lib.arena_clearance(scene.handle, x, y, limit) for limit in (0.1, 1.0, 50.0)]
        return [*near, *(lib.arena_is_free(scene.handle, x, y, radius) for radius in (0.0, 0.1, 1.0))]

    first, *others = [answers() for index in INDEXES if scene.build(index)]
    assert others == [first, first]


@given(scenes(), coordinates, coordinates, angles, st.floats(0.05, 8))
def test_rays_agree_with_shapely(scene: Shapes, x: float, y: float, angle: float, reach: float) -> None:
    """Where the ray does not pass within a nanometre of a corner or an end, there to 1e-9 m."""
    if lib.arena_disc_count(scene.handle):
        return  # shapely's discs are polygons; see the closed form below
    scene.build(lib.ARENA_INDEX_LISTS_AT_ONCE)
    surfaces = shapely.union_all(scene.rings)
    direction = np.array([math.cos(angle), math.sin(angle)])
    corners = shapely.get_coordinates(surfaces) - (x, y)
    if (np.abs(corners @ [-direction[1], direction[0]]) < 1e-9).any():
        return
    met = shapely.LineString([(x, y), (x + reach * direction[0], y + reach * direction[1])]).intersection(surfaces)
    expected = -1.0 if met.is_empty else shapely.Point(x, y).distance(met)
    if expected < reach - 1e-9:
        assert scene.ray(x, y, angle, reach)[0] == pytest.approx(expected, abs=1e-9)


def test_random_pairs_agree_with_a_linear_solver() -> None:
    """(3.4)-(3.8), E12: 20 000 random rays and edges against numpy's solver, to 1e-9."""
    random = np.random.default_rng(12)
    rays, ends = random.uniform(-2, 2, (20_000, 2, 2)), random.uniform(-2, 2, (20_000, 2, 2))
    met = 0
    for (start, target), (a, b) in zip(rays, ends, strict=True):
        length = math.dist(start, target)
        angle = math.atan2(target[1] - start[1], target[0] - start[0])
        t, u = np.linalg.solve(np.column_stack((target - start, a - b)), a - start)  # start + t ... = a + u ...
        found = Shapes().wall([a, b]).build(lib.ARENA_INDEX_NONE).ray(*start, angle, length)[0]
        hit = 0 <= t < 1 and 0 <= u <= 1
        met += hit
        if min(abs(t), abs(t - 1), abs(u), abs(u - 1)) > 1e-9:
            assert (found >= 0) == hit
            assert not hit or abs(found - t * length) <= 1e-9 * max(1.0, length / abs(math.sin(_between(a - b, angle))))
    assert met > 4000


def _between(edge: Floats, angle: float) -> float:
    return math.atan2(edge[1], edge[0]) - angle


@pytest.mark.parametrize("index", INDEXES)
@pytest.mark.parametrize("turn", np.linspace(-math.pi, math.pi, 13))
def test_parallel_and_collinear_edges(index: int, turn: float) -> None:
    """(3.8): beside a parallel edge there is no hit; on its line the nearer end that lies ahead is met."""
    c, s = math.cos(turn), math.sin(turn)

    def ray(*edge: tuple[float, float]) -> float:
        turned = [(c * x - s * y, s * x + c * y) for x, y in edge]
        return Shapes().wall(turned).build(index).ray(0, 0, turn, 10)[0]

    assert ray((1, 0.001), (2, 0.001)) == -1
    assert ray((2, 0), (1, 0)) == pytest.approx(1, abs=1e-12)
    assert ray((1, 0), (2, 0)) == pytest.approx(1, abs=1e-12)
    assert ray((-1, 0), (-2, 0)) == -1
    assert ray((-1, 0), (2, 0)) == 0


@pytest.mark.parametrize("index", INDEXES)
@pytest.mark.parametrize("corners", [3, 4, 100, 1000])
def test_no_ray_slips_through_a_shared_corner(index: int, corners: int) -> None:
    """One of the defects of the notes' simulator. Rays straight into the corners, and on both sides of them."""
    ring = ring_of(0.1, -0.2, 1.3, corners)
    scene = Shapes().polygon(ring).build(index)
    for x, y in ((0.1, -0.2), (0.3, 0.05)):
        for corner in ring[:: max(1, corners // 50)]:
            angle = math.atan2(corner[1] - y, corner[0] - x)
            for aside in (0.0, 1e-16, -1e-16, 1e-13, -1e-13, 1e-10, -1e-10):
                found = scene.ray(x, y, angle + aside, 5)[0]
                assert found == pytest.approx(math.dist((x, y), corner), abs=1e-6)


@pytest.mark.parametrize("index", INDEXES)
def test_disc_by_its_closed_form(index: int) -> None:
    """Ahead at D: a ray that passes the centre at h meets the circle at D - sqrt(r^2 - h^2); from inside, at +."""
    scene = Shapes().disc(1.5, 0.0, 0.4).disc(5, 5, 0.1).wall([(-3, -3), (-3, 3)]).build(index)
    for h in (0.0, 0.1, -0.25, 0.39999):
        half = math.sqrt(0.16 - h * h)
        assert scene.ray(0, h, 0, 9) == (pytest.approx(1.5 - half, abs=1e-12), 1)
        assert scene.ray(1.5, h, math.pi, 9) == (pytest.approx(half, abs=1e-12), 1)
    assert scene.ray(0, 0.400001, 0, 9) == (-1, -1)
    assert lib.arena_clearance(scene.handle, 0, 0, 9) == pytest.approx(1.1)
    assert lib.arena_clearance(scene.handle, 1.5, 0, 9) == pytest.approx(0.4)
    assert not lib.arena_is_free(scene.handle, 1.5, 0, 0.01)


def test_a_ray_passes_over_what_is_lower() -> None:
    for index in INDEXES:
        scene = Shapes().wall([(1, -1), (1, 1)], 0.04).disc(2, 0, 0.5, 0.07).polygon(square(3, 0, 1)).build(index)
        seen = [scene.ray(0, 0, 0, 9, height)[0] for height in (0.0, 0.04, 0.05, 0.07, 0.08, 5.0)]
        assert seen == pytest.approx([1, 1, 1.5, 1.5, 2.5, 2.5])


@pytest.mark.parametrize("index", INDEXES)
def test_rays_from_far_outside_and_with_impossible_numbers(index: int) -> None:
    scene = Shapes().polygon(ring_of(0, 0, 1, 60)).disc(0, 0, 0.3).build(index)
    assert scene.ray(-500, 0, 0, 1000)[0] == pytest.approx(499)
    assert scene.ray(0, 700, -math.pi / 2, 1000)[0] == pytest.approx(699)
    assert scene.ray(-500, 0, math.pi, 1000)[0] == -1
    nan, inf = math.nan, math.inf
    for x, y, c, s, reach in (
        (nan, 0, 1, 0, 1),
        (0, inf, 1, 0, 1),
        (0, 0, nan, 0, 1),
        (0, 0, 0, 0, 1),
        (0, 0, 1, 0, nan),
    ):
        assert lib.arena_ray(scene.handle, x, y, c, s, reach, 0.0, ffi.NULL) == -1
    assert lib.arena_ray(scene.handle, 0, 0, 1, 0, inf, 0.0, ffi.NULL) == pytest.approx(0.3)


def test_lists_beyond_what_a_cell_looks_at() -> None:
    """More items than one cell gathers, and rays longer than that."""
    answers = []
    for index in INDEXES:
        scene = Shapes()
        for column in range(50):
            for row in range(50):
                scene.polygon(square(column + 0.3 * (row % 3), row, 0.2))
        scene.build(index)
        lib.arena_ray(scene.handle, 0.5, 0.5, 1.0, 0.0, 1.0, 0.0, ffi.NULL)
        answers.append([scene.ray(0.5 + 0.37 * k, 0.5, 0.9 * k, 200.0) for k in range(100)])
    assert answers[0] == answers[1] == answers[2]


def test_threads_share_an_arena_while_it_makes_its_lists() -> None:
    scene = Shapes()
    for k in range(40):
        scene.polygon(ring_of(k % 7, k // 7, 0.3, 30))
    looks = [(0.5 + (k % 60) / 10, 0.5 + (k // 60) / 10, k * 0.7) for k in range(3000)]
    expected = [scene.build(lib.ARENA_INDEX_NONE).ray(*look, 3.0) for look in looks[:200]]
    scene.build(lib.ARENA_INDEX_LISTS_AT_ONCE)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: [scene.ray(*look, 3.0) for look in looks], range(4)))
    assert found[0] == found[1] == found[2] == found[3]
    assert found[0][:200] == expected


def test_things_that_are_no_shapes_are_refused() -> None:
    handle = Shapes().handle
    line = ffi.new("double[]", [0, 0, 1, 0, 0, 1])
    for bad in (math.nan, math.inf, 1e7):
        wrong = ffi.new("double[]", [0, 0, 1, bad, 0, 1])
        assert lib.arena_add_polygon(handle, wrong, 3, lib.ARENA_OBSTACLE, ffi.NULL) == -1
        assert lib.arena_add_wall(handle, wrong, 3, ffi.NULL) == -1
        assert lib.arena_add_disc(handle, 0, bad, 1, ffi.NULL) == -1
        assert lib.arena_add_patch(handle, wrong, 3, 0.5) == -1
        assert lib.arena_add_light(handle, bad, 0, 0, 1) == -1
        assert lib.arena_set_charger(handle, bad, 0, 1) == -1
    assert lib.arena_add_polygon(handle, line, 2, lib.ARENA_OBSTACLE, ffi.NULL) == -1
    assert lib.arena_add_polygon(handle, line, 3, lib.ARENA_WALL, ffi.NULL) == -1
    assert lib.arena_add_wall(handle, ffi.new("double[]", [1, 1, 1, 1]), 2, ffi.NULL) == -1
    assert lib.arena_add_disc(handle, 0, 0, 0, ffi.NULL) == -1
    assert lib.arena_edge_count(handle) == lib.arena_shape_count(handle) == 0
    assert lib.arena_move_polygon(handle, 0, 1, 1) == -1


def test_grip_is_that_of_the_last_patch() -> None:
    handle = Shapes().handle
    for side, grip in ((2.0, 0.4), (1.0, 0.1)):
        corners = np.array(square(0, 0, side))
        assert lib.arena_add_patch(handle, ffi.from_buffer("double[]", corners), 4, grip) >= 0
    assert [lib.arena_grip(handle, x, 0, 0.7) for x in (0.0, 0.6, -0.9, 1.1, math.nan)] == [0.1, 0.4, 0.4, 0.7, 0.7]
