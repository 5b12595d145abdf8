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

from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.arenas.shapes import INDEXES, Shapes, angles, coordinates, ring_of, scenes
from sim_bridge.tests.simulated import square


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


@given(
    scenes(), coordinates, coordinates, angles, st.floats(0, 4), st.integers(1, 9), st.sampled_from([0.3, 1.0, 30.0])
)
def test_rays_asked_together_get_the_same_bits(
    scene: Shapes, x: float, y: float, turn: float, opening: float, rays: int, reach: float
) -> None:
    """Fans of any width, also along the axes and towards corners, where rays lie along edges and ties are decided."""
    toward = [math.atan2(ring.coords[0][1] - y, ring.coords[0][0] - x) for ring in scene.rings]
    for middle in (turn, 0.0, math.pi / 2, *toward):
        looks = [middle + opening * (k / (rays - 1) - 0.5) if rays > 1 else middle for k in range(rays)]
        for index in INDEXES:
            scene.build(index)
            for height in (0.0, 0.1):
                alone = [scene.ray(x, y, look, reach, height)[0] for look in looks]
                assert scene.fan(x, y, looks, reach, height) == alone


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
    scene.build(lib.ARENA_INDEX_LISTS)
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
    start, target, a, b = random.uniform(-2, 2, (4, 20_000, 2))
    matrices = np.stack((target - start, a - b), axis=2)
    t, u = np.linalg.solve(matrices, (a - start)[..., None])[..., 0].T  # start + t (target - start) = a + u (b - a)
    steepness = np.abs(np.linalg.det(matrices)) / np.linalg.norm(b - a, axis=1)
    met = 0
    for i in range(len(t)):
        handle = ffi.gc(lib.arena_new(), lib.arena_destroy)
        assert lib.arena_add_edges(handle, ffi.new("double[]", [*a[i], *b[i]]), 2, lib.ARENA_WALL, ffi.NULL) == 0
        x, y = target[i] - start[i]
        length = math.hypot(x, y)
        found = lib.arena_ray(handle, *start[i], x / length, y / length, length, 0.0, ffi.NULL)
        if min(abs(t[i]), abs(t[i] - 1), abs(u[i]), abs(u[i] - 1)) < 1e-9:
            continue
        hit = 0 <= t[i] < 1 and 0 <= u[i] <= 1
        met += hit
        assert (found >= 0) == hit
        if hit and steepness[i] > 1e-6:
            assert found == pytest.approx(t[i] * length, abs=1e-9)
    assert met > 4000


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
        assert scene.ray(0, h, 0, 9) == pytest.approx((1.5 - half, 1), abs=1e-12)
        assert scene.ray(1.5, h, math.pi, 9) == pytest.approx((half, 1), abs=1e-12)
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
        answers.append([scene.fan(0.5 + 0.37 * k, 0.5, [0.9 * k, 0.9 * k + 0.5], 200.0) for k in range(100)])
    assert answers[0] == answers[1] == answers[2]


def test_threads_share_an_arena_while_it_makes_its_lists() -> None:
    scene = Shapes()
    for k in range(40):
        scene.polygon(ring_of(k % 7, k // 7, 0.3, 30))
    looks = [(0.5 + (k % 60) / 10, 0.5 + (k // 60) / 10, [k * 0.7, k * 0.7 + 0.3]) for k in range(3000)]
    expected = [scene.build(lib.ARENA_INDEX_NONE).fan(*look, 3.0) for look in looks[:200]]
    scene.build(lib.ARENA_INDEX_LISTS)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: [scene.fan(*look, 3.0) for look in looks], range(4)))
    assert found[0] == found[1] == found[2] == found[3]
    assert found[0][:200] == expected


def test_grip_is_that_of_the_last_patch() -> None:
    handle = Shapes().handle
    for side, grip in ((2.0, 0.4), (1.0, 0.1)):
        corners = np.array(square(0, 0, side))
        assert lib.arena_add_patch(handle, ffi.from_buffer("double[]", corners), 4, grip) >= 0
    assert [lib.arena_grip(handle, x, 0, 0.7) for x in (0.0, 0.6, -0.9, 1.1, math.nan)] == [0.1, 0.4, 0.4, 0.7, 0.7]
