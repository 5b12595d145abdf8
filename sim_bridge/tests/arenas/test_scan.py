"""The laser range finder's fan: beam by beam what a single ray finds, from outside, from inside and near a surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.arenas.arena import Floats
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.arenas.shapes import Shapes, angles, coordinates, ring_of, scenes
from sim_bridge.tests.simulated import square

LRF = (-math.radians(239.77) / 2, math.radians(239.77) / 2, 683)
FANS = [LRF, (-math.pi, math.pi, 361), (1.0, 1.5, 2), (2.0, 5.0, 100)]


class Scan:
    """A scene, a fan, and both ways to ask."""

    def __init__(self, shapes: Shapes, movers: list[dict[str, Any]] | None = None, fan: Any = LRF) -> None:
        self.first, self.last, self.count = fan
        self.fan = ffi.gc(lib.scan_fan_new(*fan), lib.scan_fan_destroy)
        self.keep = [shapes, movers, ffi.new("mover[]", movers or [])]
        moving = {"movers": self.keep[2], "movers_count": len(movers or [])}
        self.scene = ffi.new("scene *", {"arena": shapes.build().handle, **moving})

    def look(self, x: float, y: float, heading: float, reach: float, height: float = 0.1, self_id: int = 0) -> Floats:
        distances = np.full(self.count, np.nan)
        pose = (x, y, math.cos(heading), math.sin(heading))
        lib.scan_look(self.fan, self.scene, *pose, reach, height, self_id, ffi.from_buffer("double[]", distances))
        return distances

    def rays(self, x: float, y: float, heading: float, reach: float, height: float = 0.1, aside: float = 0) -> Floats:
        bearings = heading + np.linspace(self.first, self.last, self.count) + aside
        return np.array(
            [lib.scene_ray(self.scene, x, y, math.cos(b), math.sin(b), reach, height, 0, ffi.NULL) for b in bearings]
        )


def mover(x: float, y: float, heading: float, outline: Any = None, radius: float = 0.3) -> dict[str, Any]:
    pose = {"x": x, "y": y, "cosine": math.cos(heading), "sine": math.sin(heading)}
    if outline is None:
        return {**pose, "radius": radius, "height": 1.0, "id": 4}
    radius = max(math.hypot(*corner) for corner in outline)
    corners = ffi.new("double[]", [value for corner in outline for value in corner])
    return {**pose, "radius": radius, "height": 1.0, "id": 4, "outline": corners, "corners": len(outline)}


def assert_agrees(scan: Scan, x: float, y: float, heading: float, reach: float, height: float = 0.1) -> None:
    """To 1e-9 m in every beam, unless it grazes something: then its neighbours a nanoradian away differ as well."""
    found = scan.look(x, y, heading, reach, height)
    expected = scan.rays(x, y, heading, reach, height)
    wrong = np.abs(found - expected) > 1e-9
    if wrong.any():
        left, right = (scan.rays(x, y, heading, reach, height, aside) for aside in (-1e-9, 1e-9))
        grazing = (np.abs(left - expected) > 1e-9) | (np.abs(right - expected) > 1e-9)
        between = (found >= np.minimum(left, right) - 1e-6) & (found <= np.maximum(left, right) + 1e-6)
        assert (grazing & (between | (left == -1) | (right == -1)))[wrong].all()


movers = st.builds(mover, coordinates, coordinates, angles, st.sampled_from([None, square(0, 0, 0.5)]))


@given(
    scenes(),
    st.lists(movers, max_size=2),
    st.sampled_from(FANS),
    st.tuples(coordinates, coordinates, angles),
    st.sampled_from([0.5, 4.0, 100.0]),
    st.sampled_from([0.0, 0.1]),
)
def test_every_beam_is_what_a_ray_finds(
    shapes: Shapes, moving: Any, fan: Any, pose: tuple[float, float, float], reach: float, height: float
) -> None:
    scan = Scan(shapes, moving, fan)
    around = Scan(shapes, moving, (-math.pi, math.pi, 361)).rays(*pose, 1e-6, 0.0)
    if lib.arena_clearance(shapes.handle, *pose[:2], 1e-6) < 1e-6 or (around >= 0).any():
        return  # on a surface: rounding decides what is met
    assert_agrees(scan, *pose, reach, height)


@pytest.mark.parametrize("corners", [4, 100, 5000])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.9, 0.3), (2.0, 1.0), (0.99999, 1e-6), (1.00001, 0.0)])
def test_inside_outside_and_near_a_corner(corners: int, place: tuple[float, float]) -> None:
    for turn in (1, -1):  # corners both ways round
        scan = Scan(Shapes().polygon(ring_of(0, 0, 1, corners)[::turn]))
        for heading in (0.0, 1.0, -2.5):
            assert_agrees(scan, *place, heading, 10)


@pytest.mark.parametrize("kind", ["walls", "pillars", "discs"])
def test_a_thousand_things_of_which_most_are_hidden(kind: str) -> None:
    """More than one block of edges; what is near ends the search for what is far."""
    draw = np.random.default_rng(3)
    shapes = Shapes()
    for x, y, turn in draw.uniform((-4, -4, -math.pi), (4, 4, math.pi), (1000, 3)):
        dx, dy = 0.4 * math.cos(turn), 0.4 * math.sin(turn)
        if kind == "walls":
            shapes.wall([(x - dx, y - dy), (x + dx, y + dy)])
        elif kind == "pillars":
            shapes.polygon([(x + dx / 4, y + dy / 4), (x - dy / 4, y + dx / 4), (x - dx / 4, y - dy / 4)])
        else:
            shapes.disc(x, y, 0.1)
    for fan in (LRF, (-math.pi, math.pi, 361)):
        scan = Scan(shapes, fan=fan)
        for x, y, heading in draw.uniform((-4, -4, -math.pi), (4, 4, math.pi), (8, 3)):
            assert_agrees(scan, x, y, heading, 10)


def test_a_sensor_in_line_with_edges_and_close_to_one() -> None:
    """Faces of pillars in a row, seen along their common line; the beam along it meets the first one's corner."""
    shapes = Shapes()
    for i in range(1, 30):
        shapes.polygon(square(i, 0.1, 0.2)).polygon(square(-i, -0.1, 0.2))
    for heading in (0.0, math.pi / 2, math.pi):
        scan = Scan(shapes)
        assert_agrees(scan, 0, 1e-10, heading, 40)
        assert_agrees(scan, 0, 0.05, heading, 40)
    assert Scan(shapes).look(0, 0, 0, 40)[341] == pytest.approx(0.9)
    before_it = Scan(Shapes().wall([(-1, 0), (1, 0)])).look(0, 1e-6, -math.pi / 2, 5)
    angle = np.linspace(*LRF)
    ahead = np.abs(angle) < math.pi / 2 - 1e-5
    assert before_it[ahead] == pytest.approx(1e-6 / np.cos(angle[ahead]), abs=1e-12)
    assert (before_it[~ahead] == -1).all()


def test_no_crack_opens_between_neighbours() -> None:
    """From inside a closed ring every beam meets it, at the ring's inner and outer radius at most."""
    for corners in (3, 7, 683, 4000):
        scan = Scan(Shapes().polygon(ring_of(0.2, 0.1, 2, corners)))
        for heading in np.linspace(-3, 3, 23):
            distances = scan.look(0.2, 0.1, float(heading), 5)
            assert (distances >= 2 * math.cos(math.pi / corners) - 1e-12).all()
            assert (distances <= 2 + 1e-12).all()


def test_order_of_beams_and_free_beams() -> None:
    """E15: all beams free are all -1; they go from right to left; the middle one looks along the heading."""
    assert (Scan(Shapes().disc(0, 9, 1)).look(0, 0, 1.0, 4.0) == -1).all()
    scan = Scan(Shapes().wall([(1, -9), (1, 9)]).wall([(-9, -2), (9, -2)]))
    distances = scan.look(0, 0, 0, 30)
    angle = np.linspace(*LRF)
    assert distances[341] == pytest.approx(1)
    assert distances == pytest.approx(scan.rays(0, 0, 0, 30))
    assert distances[angle < -1.2] == pytest.approx(np.abs(2 / np.sin(angle[angle < -1.2])))
    ahead = np.abs(angle) < 0.5
    assert distances[ahead] == pytest.approx(1 / np.cos(angle[ahead]))


def test_low_things_and_oneself_are_not_seen() -> None:
    scan = Scan(Shapes().polygon(square(1, 0, 0.4), 0.05).wall([(2, -1), (2, 1)]), [mover(1.5, 0, 0)])
    assert scan.look(0, 0, 0, 9, height=0.05)[341] == pytest.approx(0.8)
    assert scan.look(0, 0, 0, 9, height=0.06)[341] == pytest.approx(1.2)
    assert scan.look(0, 0, 0, 9, height=0.06, self_id=4)[341] == pytest.approx(2)


def test_impossible_fans_and_poses() -> None:
    for fan in (
        (1, 1, 9),
        (1, 0, 9),
        (0, 7, 9),
        (0, 1, 1),
        (0, 1, 2**21),
        (math.nan, 1, 9),
        (0, math.nan, 9),
        (1e9, 1e9 + 1, 9),
    ):
        assert lib.scan_fan_new(*fan) == ffi.NULL
    scan = Scan(Shapes().disc(1, 0, 0.2))
    for x, heading, reach in ((math.nan, 0, 1), (0, math.nan, 1), (0, 0, math.nan), (0, 0, 0), (math.inf, 0, 1)):
        assert (scan.look(x, 0, heading, reach) == -1).all()
    assert scan.look(0, 0, 0, math.inf)[341] == pytest.approx(0.8)
