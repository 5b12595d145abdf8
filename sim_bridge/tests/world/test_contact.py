"""One body against the shapes of an arena: sliding, turning, corners, no way through, no energy."""

from __future__ import annotations

import math
from typing import Any

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from boebot.description.robots import load_robot
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices import servo as servo_model
from sim_bridge.robots.imperfections import AS_BUILT
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.tests.world.bodies import CHASSIS, RADIUS, Body, Points, World, constant, outline_of

BOX = [(-0.08, -0.05), (0.06, -0.05), (0.06, 0.05), (-0.08, 0.05)]
# A fork: open ahead, with a slot that things can enter.
FORK = [
    (-0.05, -0.06),
    (0.07, -0.06),
    (0.07, -0.02),
    (-0.01, -0.02),
    (-0.01, 0.02),
    (0.07, 0.02),
    (0.07, 0.06),
    (-0.05, 0.06),
]
# Sharp ahead, 39 degrees.
WEDGE = [(-0.05, -0.05), (0.09, 0.0), (-0.05, 0.05)]
shapes = st.sampled_from([None, BOX, CHASSIS, FORK, WEDGE])
arenas = st.lists(st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(0.05, 0.4)), max_size=4)


def test_head_on_it_stops_at_the_wall() -> None:
    body = Body(arena_of(square(1, 0, 1)))  # face at x = 0.5
    body.regulate(constant(0.17, 0.17), 1.2, 5.0, 0.001)
    assert body.state.x == pytest.approx(0.5 - RADIUS, abs=1e-9)
    assert body.state.y == pytest.approx(0, abs=1e-12)
    assert abs(body.state.speed) < 1e-9
    assert body.state.touching
    assert body.state.touch_x == pytest.approx(0.5)


@pytest.mark.parametrize("slip", [0, 1])
@pytest.mark.parametrize("corners", [None, BOX])
def test_at_rest_against_a_wall_nothing_moves(slip: int, corners: Points | None) -> None:
    """Pushing with less than the tyres hold, straight on and at an angle: no jitter, no creeping, wheels at rest."""
    for heading in (0.0, 0.6):
        body = Body(arena_of(square(10, 0, 19)), corners=corners, slip=slip)
        body.place(0.3, 0, heading)
        body.regulate(constant(0.1, 0.1), 0.2, 3.0, 0.001)
        body.advance(0.01, 0.01, steps=3000)
        before, wheels = body.pose, (body.state.wheel_left, body.state.wheel_right)
        if corners is not None and heading:
            assert body.state.heading == pytest.approx(0, abs=1e-5)  # its flat front lies against the wall
        for _ in range(1000):
            body.advance(0.01, 0.01)
            assert body.state.touching
        assert body.pose == pytest.approx(before, abs=2e-6)
        assert (body.state.wheel_left, body.state.wheel_right) == pytest.approx(wheels, abs=1e-3)


def test_at_an_angle_it_slides_along_the_wall() -> None:
    """A hard push: the tyres spin, the circle goes along the wall, and a push through its middle turns nothing."""
    body = Body(arena_of(square(10, 0, 20 - 1)))  # a long face at x = 0.5
    body.place(0, 0, math.radians(70))
    body.regulate(constant(0.17, 0.17), 1.2, 12.0, 0.001)
    assert body.state.x == pytest.approx(0.5 - RADIUS, abs=1e-8)
    assert body.state.y > 0.6  # it went on beside it
    assert body.state.heading == pytest.approx(math.radians(70), abs=1e-9)


def test_outline_met_off_its_middle_turns() -> None:
    """The left front corner meets the end of a wall: the robot turns left, around it, and goes on."""
    body = Body(arena_of([(0.3, 0.03), (1.0, 0.03), (1.0, 0.4), (0.3, 0.4)]), corners=BOX)
    body.regulate(constant(0.1, 0.1), 0.3, 2.8, 0.001)
    assert body.state.touching
    assert body.state.heading > 0.02
    circle = Body(arena_of([(0.3, 0.03), (1.0, 0.03), (1.0, 0.4), (0.3, 0.4)]), radius=0.06)
    circle.regulate(constant(0.1, 0.1), 0.3, 2.8, 0.001)
    assert circle.state.heading == 0.0


def test_on_ice_a_bar_hit_at_its_end_moves_as_in_the_books() -> None:
    """Inelastic impact at a lever: impulse = v / (1/m + l^2/I), closed form."""
    bar = [(-0.01, -0.1), (0.01, -0.1), (0.01, 0.1), (-0.01, 0.1)]
    body = Body(
        arena_of([(0.3, 0.098), (0.5, 0.098), (0.5, 0.3), (0.3, 0.3)]),
        corners=bar,
        grip=0.0,
        linear_damping=0.0,
        angular_damping=0.0,
    )
    body.place(0.2, 0, 0, speed=0.5)
    while not body.state.touching:
        body.advance(0, 0)
    p = body.parameters
    mass, inertia = p.mass + 2 * p.wheel_mass, p.inertia + 2 * p.wheel_mass * p.half_track**2
    lever = 0.098  # of the obstacle's corner
    impulse = 0.5 / (1 / mass + lever**2 / inertia)
    assert body.velocity[0] == pytest.approx(0.5 - impulse / mass, rel=2e-3)
    assert body.state.turn_rate == pytest.approx(impulse * lever / inertia, rel=2e-3)


def test_it_comes_off_a_wall_freely() -> None:
    body = Body(arena_of(square(1, 0, 1)))
    body.regulate(constant(0.17, 0.17), 1.2, 4.0, 0.001)
    body.regulate(constant(-0.17, -0.17), 1.2, 1.0, 0.001)
    assert not body.state.touching
    assert body.state.x < 0.5 - RADIUS - 0.1


def test_it_can_turn_while_it_touches() -> None:
    body = Body(arena_of(square(1, 0, 1)))
    body.regulate(constant(0.17, 0.17), 1.2, 4.0, 0.001)
    body.regulate(constant(-0.1, 0.1), 1.2, 1.0, 0.001)
    assert body.state.heading > 1.0


@pytest.mark.parametrize("slip", [0, 1])
def test_grip_decides_whether_it_slides(slip: int) -> None:
    """Pushed at 45 degrees into a wall, tyres that hold stop it where slippery ones let it slide."""

    def way(grip: float) -> float:
        body = Body(arena_of(square(10, 0, 19)), grip=grip, slip=slip)
        body.place(0.5 - RADIUS, 0, math.radians(45))
        body.advance(0.02, 0.02, steps=2000)  # 2 x 0.02 N m at the rim: 1.2 N, 0.6 N of them along the wall
        return float(body.state.y)

    assert way(0.7) < 1e-4
    if slip:
        assert way(0.0) == 0.0  # wheels that spin push nothing
        # both tyres are at their limit, 0.05 * 6.47 N in all; what they push along the heading slides it
        assert 0.02 < way(0.05) < 0.5 * 0.05 * 9.81 * 2.0**2
    else:
        assert way(0.0) > 0.3


@given(
    arenas,
    shapes,
    st.floats(-math.pi, math.pi),
    st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=4),
    st.sampled_from([0.001, 0.005, 0.010]),
    st.integers(0, 1),
)
def test_nothing_is_sunk_into_or_passed_through(
    blocks: list[tuple[float, float, float]],
    corners: Points | None,
    heading: float,
    references: list[tuple[float, float]],
    dt: float,
    slip: int,
) -> None:
    """At up to 3 m/s, twenty times the robot's speed, with walls of no thickness in the way."""
    arena = arena_of(*(square(x, y, side) for x, y, side in blocks), outline=square(0, 0, 2))
    if not arena.is_free(0, 0, 0.1):
        return
    body = Body(arena, corners=corners, slip=slip)
    body.place(0, 0, heading)
    for left, right in references:
        for _ in range(15):
            before = shapely.Point(body.state.x, body.state.y)
            body.regulate(constant(left, right), 0.3, dt, dt)
            assert body.depth < 1e-6
            assert body.is_free()
            way = shapely.LineString([before, (body.state.x, body.state.y)])
            assert way.length <= dt * 4
            assert not any(way.crosses(shapely.LinearRing(ring)) for ring in arena.outlines)


@given(shapes, st.floats(0, math.pi), st.floats(0.01, 3.0), st.floats(-5, 5), st.integers(0, 1), st.floats(0, 1))
def test_contact_gains_no_energy(
    corners: Points | None, heading: float, speed: float, turn_rate: float, slip: int, grip: float
) -> None:
    body = Body(arena_of(square(0.2, 0.1, 0.04), outline=square(0, 0, 0.5)), corners=corners, slip=slip, grip=grip)
    body.place(-0.05, 0, heading, speed, turn_rate)
    for _ in range(80):
        energy = body.energy
        body.advance(0, 0, dt=0.004)
        assert body.energy <= energy * (1 + 1e-12) + 1e-18
        assert body.depth < 1e-6
    assert math.isfinite(body.state.x)


@pytest.mark.parametrize("corners", [None, BOX, CHASSIS])
@pytest.mark.parametrize("speed", [1.0, 10.0, 90.0])
@pytest.mark.parametrize("dt", [0.001, 0.01, 0.1, 1.0])
def test_no_speed_and_no_step_goes_through_a_wall(corners: Points | None, speed: float, dt: float) -> None:
    """A wall of no thickness: two edges on each other are as near to it as a closed polygon comes."""
    body = Body(arena_of([(1.0, -3.0), (1.0, 3.0), (1.000001, 3.0), (1.000001, -3.0)]), corners=corners)
    body.place(0, 0, 0.3, speed=speed, turn_rate=3.0)
    for _ in range(5):
        body.advance(0.0, 0.0, dt=dt)
        assert body.depth < 1e-6
        assert body.state.x < 1.0 or abs(body.state.y) > 3.0


def test_corner_holds_it() -> None:
    body = Body(arena_of(outline=square(0, 0, 1)), corners=CHASSIS)
    body.place(0.2, 0.2, math.radians(40))
    body.regulate(constant(0.17, 0.17), 0.3, 6.0, 0.001)
    assert body.depth < 1e-6
    assert body.state.touching
    before = body.pose
    body.regulate(constant(0.17, 0.17), 0.3, 1.0, 0.001)
    assert body.pose == pytest.approx(before, abs=1e-3)


@pytest.mark.parametrize("slip", [0, 1])
def test_wedge_holds_it(slip: int) -> None:
    wedge = [(0.0, 0.2), (1.0, 0.05), (1.0, -0.05), (0.0, -0.2), (1.2, -0.2), (1.2, 0.2)]
    body = Body(arena_of(wedge), slip=slip)
    body.place(-0.2, 0.0, 0.0)
    body.regulate(constant(0.17, 0.17), 1.2, 10.0, 0.001)
    assert body.depth < 1e-6
    assert 0.7 < body.state.x < 1.0
    stuck = body.state.x
    body.regulate(constant(-0.17, -0.17), 1.2, 2.0, 0.001)
    assert body.state.x < stuck - 0.2


def test_slot_of_a_fork_takes_a_post() -> None:
    """An outline that is not convex: a thin post goes into the slot, to its end."""
    body = Body(arena_of(square(0.4, 0.0, 0.02)), corners=FORK)
    body.regulate(constant(0.1, 0.1), 0.3, 8.0, 0.001)
    assert body.state.touching
    assert body.state.x - 0.01 == pytest.approx(0.39, abs=1e-6)  # the slot's end at the post's face


def test_disc_is_met_like_a_wall() -> None:
    arena = arena_of()
    assert lib.arena_add_disc(arena.handle, 0.5, 0.0, 0.1, ffi.NULL) >= 0
    lib.arena_build(arena.handle)
    for corners, front in ((None, RADIUS), (BOX, 0.06)):
        body = Body(arena, corners=corners)
        body.regulate(constant(0.1, 0.1), 0.3, 6.0, 0.001)
        assert body.state.x == pytest.approx(0.4 - front, abs=1e-6)
        assert body.state.touching


def test_segment_on_the_body_touches_what_it_crosses() -> None:
    body = Body(arena_of(square(1, 0, 1)))  # face at x = 0.5

    def touches(scene: Any = None) -> bool:
        where = body.scene if scene is None else scene
        return bool(lib.body_segment_touches(body.body, where, 0.045, 0.03, 0.1, 0.055, 0.03))

    for x, expected in ((0.39, False), (0.3999, False), (0.4001, True), (0.42, True)):
        body.place(x, 0, 0)
        assert touches() == expected
    body.place(0.42, 0, math.pi)
    assert not touches()
    world = World([body], body.arena)
    mover = world.mover(0.42 - 0.12, 0, corners=square(0, 0, 0.1))
    assert touches(world.scene)
    mover.id = body.body.id  # itself
    assert not touches(world.scene)
    mover.id, mover.outline, mover.radius = 100, ffi.NULL, 0.05
    assert not touches(world.scene)
    mover.radius = 0.07
    assert touches(world.scene)


# ---- outlines ------------------------------------------------------------------------------------------------


def test_thin_outline_is_refused() -> None:
    flat = [0.0, 0.0, 1.0, 0.0, 1.0, 3e-4, 0.0, 3e-4]
    assert lib.body_outline_make(ffi.new("body_outline *"), flat, 4) == lib.OUTLINE_THIN


def test_outline_is_the_polygon_with_rounded_corners() -> None:
    """In either sense; shapely says where the core lies."""
    for corners in (CHASSIS, CHASSIS[::-1]):
        outline = ffi.new("body_outline *")
        flat = [float(value) for corner in corners for value in corner]
        assert lib.body_outline_make(outline, flat, len(corners)) == lib.OUTLINE_OK
        core = shapely.Polygon([(outline.core[2 * i], outline.core[2 * i + 1]) for i in range(outline.corners)])
        expected = shapely.Polygon(corners).buffer(-outline.rounding, join_style="mitre", mitre_limit=100)
        assert core.exterior.is_ccw
        assert core.symmetric_difference(expected).area < 1e-12
        assert outline.reach == pytest.approx(math.hypot(0.09, 0.04))
    thin = ffi.new("body_outline *")
    assert lib.body_outline_make(thin, [0, 0, 0.1, 0, 0.1, 0.001, 0, 0.001], 4) == lib.OUTLINE_OK
    assert 1e-4 < thin.rounding < 0.5e-3


def isosceles(degrees: float, long: float = 0.2) -> list[tuple[float, float]]:
    """A triangle with a tip of that angle at (long, 0), its base behind the axle."""
    half = 1.5 * long * math.tan(math.radians(degrees) / 2)
    return [(-0.5 * long, -half), (long, 0.0), (-0.5 * long, half)]


@given(st.floats(15.01, 120.0), st.floats(0.05, 0.5))
def test_no_corner_loses_more_than_a_tenth_of_a_millimetre(degrees: float, long: float) -> None:
    """Of the body that makes contact, all within the rounding of its core, by shapely."""
    corners = isosceles(degrees, long)
    outline = outline_of(corners)
    core = shapely.Polygon([(outline.core[2 * i], outline.core[2 * i + 1]) for i in range(outline.corners)])
    for corner in corners:
        lost = core.distance(shapely.Point(corner)) - outline.rounding
        assert -1e-9 < lost < 1e-4 + 1e-9
    assert outline.rounding <= 1e-3 + 1e-12


@pytest.mark.parametrize("corners", [WEDGE, isosceles(36.9), isosceles(15.1), BOX])
@pytest.mark.parametrize("heading", [0.0, 0.3])
def test_a_tip_driven_into_a_wall_stops_there(corners: Points, heading: float) -> None:
    """Its true polygon, not the rounded one, is in the wall by at most what a corner loses."""
    body = Body(arena_of(square(10, 0, 19)), corners=corners)  # face at x = 0.5
    body.place(0.49 - max(math.hypot(x, y) for x, y in corners), 0, heading)
    touched, deepest = False, -1.0
    for _ in range(800):
        body.regulate(constant(0.17, 0.17), 1.2, 0.001, 0.001)
        touched |= bool(body.state.touching)
        c, s = math.cos(body.state.heading), math.sin(body.state.heading)
        deepest = max(deepest, *(body.state.x + c * x - s * y - 0.5 for x, y in corners))
    assert touched
    assert -1e-5 < deepest < 1e-4 + 1e-6


def test_default_robot_within_the_contact_guard() -> None:
    """V dt < radius / 2 (section 3.4) without splitting a step, for the kit's own robot and step."""
    body = load_robot("shieldbot").body
    assert body.wheel_speed_maximum_m_s * 0.001 < body.radius_m / 2
    assert AS_BUILT["servo_top_rpm"] * servo_model.RPM * body.wheel_radius_m > body.wheel_speed_maximum_m_s
