"""The scene: rays against the arena and what moves in it, compared with shapely and closed forms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import pytest
import shapely
import shapely.affinity
from hypothesis import given
from hypothesis import strategies as st

from boebot.arenas import Arena
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of, square

Hit = tuple[float, Any]

coordinates = st.floats(-3, 3).map(lambda v: round(v, 4))
angles = st.floats(-math.pi, math.pi)


@dataclass
class Thing:
    """A mover as tests write it."""

    x: float
    y: float
    heading: float = 0.0
    radius: float = 0.1
    outline: list[tuple[float, float]] | None = None
    height: float = math.inf
    id: int = 7

    def rings(self) -> shapely.Geometry:
        """Its boundary in the arena's frame."""
        if self.outline is None:
            return shapely.Point(self.x, self.y).buffer(self.radius, quad_segs=256).exterior
        turned = shapely.affinity.rotate(shapely.LinearRing(self.outline), self.heading, (0, 0), use_radians=True)
        return shapely.affinity.translate(turned, self.x, self.y)


def look(
    arena: Arena,
    things: list[Thing],
    x: float,
    y: float,
    angle: float,
    reach: float,
    height: float = 0.1,
    self_id: int = 0,
) -> Hit | None:
    """What scene_ray says."""
    keep = []
    movers = ffi.new("mover[]", max(1, len(things)))
    for mover, thing in zip(movers, things, strict=False):
        mover.x, mover.y, mover.radius, mover.height, mover.id = thing.x, thing.y, thing.radius, thing.height, thing.id
        mover.cosine, mover.sine = math.cos(thing.heading), math.sin(thing.heading)
        mover.infrared_reflectance, mover.sound_reflectance = 0.5, 0.25
        if thing.outline is not None:
            keep.append(ffi.new("double[]", [value for corner in thing.outline for value in corner]))
            mover.outline, mover.corners = keep[-1], len(thing.outline)
            mover.radius = max(math.hypot(*corner) for corner in thing.outline)
    scene = ffi.new("scene *", {"arena": arena.handle, "movers": movers, "movers_count": len(things)})
    hit = ffi.new("ray_hit *")
    distance = lib.scene_ray(scene, x, y, math.cos(angle), math.sin(angle), reach, height, self_id, hit)
    assert distance == lib.scene_ray(scene, x, y, math.cos(angle), math.sin(angle), reach, height, self_id, ffi.NULL)
    if distance < 0:
        assert distance == -1
        return None
    assert hit.distance == distance < reach
    return distance, hit


TRIANGLE = [(0.3, 0.0), (-0.2, 0.2), (-0.1, -0.25)]


@st.composite
def things(draw: st.DrawFn) -> Thing:
    outline = draw(st.sampled_from([None, TRIANGLE, square(0, 0, 0.3)]))
    return Thing(draw(coordinates), draw(coordinates), draw(angles), draw(st.floats(0.05, 0.5)), outline)


@given(st.lists(things(), max_size=4), coordinates, coordinates, angles, st.floats(0.1, 6))
def test_rays_meet_the_nearest_of_all_surfaces(
    movers: list[Thing], x: float, y: float, angle: float, reach: float
) -> None:
    arena = arena_of(square(1.0, 0.5, 0.4))
    surfaces = shapely.union_all([*(mover.rings() for mover in movers), shapely.LinearRing(arena.outlines[0])])

    def expected(aside: float, along: float) -> float:
        """Distance of a ray that starts `aside` to its left, `along` times as long; its reach if it meets nothing."""
        start = (x - aside * math.sin(angle), y + aside * math.cos(angle))
        end = (start[0] + along * reach * math.cos(angle), start[1] + along * reach * math.sin(angle))
        met = shapely.LineString([start, end]).intersection(surfaces)
        return reach if met.is_empty else min(reach, shapely.Point(start).distance(met))

    found = look(arena, movers, x, y, angle, reach)
    distance = reach if found is None else found[0]
    # Shapely's circle is a polygon inside of ours: where neighbouring rays differ, the ray grazes something.
    near = [expected(aside, along) for aside in (-1e-5, 0, 1e-5) for along in (1, 1 + 1e-5)]
    if max(near) - min(near) < 1e-3:
        assert distance == pytest.approx(near[2], abs=2e-3 if any(m.outline is None for m in movers) else 1e-9)


@given(things(), coordinates, coordinates, angles)
def test_normals_are_perpendicular_to_the_surface_and_face_the_ray(
    mover: Thing, x: float, y: float, angle: float
) -> None:
    found = look(arena_of(), [mover], x, y, angle, 10)
    if found is None:
        return
    distance, hit = found
    assert math.hypot(hit.normal_x, hit.normal_y) == pytest.approx(1)
    assert hit.normal_x * math.cos(angle) + hit.normal_y * math.sin(angle) <= 1e-9
    point_x, point_y = x + distance * math.cos(angle), y + distance * math.sin(angle)
    if mover.outline is None:
        across = (point_x - mover.x) * hit.normal_y - (point_y - mover.y) * hit.normal_x
        assert across == pytest.approx(0, abs=1e-9)
    else:
        rings = shapely.get_coordinates(mover.rings())
        edges = [rings[i + 1] - rings[i] for i in range(len(rings) - 1)]
        assert min(abs(e[0] * hit.normal_x + e[1] * hit.normal_y) for e in edges) < 1e-9
    assert (hit.infrared, hit.sound, hit.shape) == (0.5, 0.25, -1)


def test_disc_by_its_closed_form() -> None:
    """A disc of 0.3 m at 2 m: seen at 1.7 m ahead, and at offset h at 2 - sqrt(r^2 - h^2)."""
    disc = Thing(2, 0, radius=0.3)
    for offset in (0, 0.1, -0.2, 0.299999):
        found = look(arena_of(), [disc], 0, offset, 0, 5)
        assert found is not None
        assert found[0] == pytest.approx(2 - math.sqrt(0.09 - offset**2), abs=1e-12)
        assert found[1].normal_y == pytest.approx(offset / 0.3, abs=1e-9)
    assert look(arena_of(), [disc], 0, 0.300001, 0, 5) is None
    assert look(arena_of(), [disc], 0, 0, 0, 1.7) is None  # reach is not included
    assert look(arena_of(), [disc], 0, 0, math.pi, 5) is None  # behind


def test_the_nearest_of_arena_and_movers_wins() -> None:
    arena = arena_of(square(1, 0, 0.2))
    near, far = Thing(0.5, 0), Thing(2, 0)
    for things, distance, shape in (([near], 0.4, -1), ([far], 0.9, 0), ([far, near], 0.4, -2), ([], 0.9, 0)):
        found = look(arena, things, 0, 0, 0, 5)
        assert found is not None
        assert found[0] == pytest.approx(distance)
        assert found[1].shape == shape


def test_a_sensor_sees_over_what_is_lower_and_never_itself() -> None:
    low, robot = Thing(0.5, 0, height=0.05, id=3), Thing(0.9, 0, id=5)
    for height, self_id, expected in ((0.05, 0, 0.4), (0.06, 0, 0.8), (0.05, 3, 0.8), (0.06, 5, None), (0.0, 5, 0.4)):
        found = look(arena_of(), [low, robot], 0, 0, 0, 5, height=height, self_id=self_id)
        assert (found and found[0]) == (None if expected is None else pytest.approx(expected))
