"""The body: closed forms of its dynamics, contact, determinism."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.robots import load_robot
from sim_bridge import imperfections
from sim_bridge._core import ffi, lib
from sim_bridge.arena import Arena
from sim_bridge.tests.simulated import arena_of, distance_to_segments, square

RADIUS = 0.07
# A Boe-Bot of 0.6 kg.
BOE_BOT = {
    "mass": 0.60,
    "inertia": 1.2e-3,
    "radius": RADIUS,
    "half_track": 0.0525,
    "wheel_radius": 0.0333,
    "wheel_mass": 0.03,
    "wheel_inertia": 1.7e-5,
    "linear_damping": 1.0,
    "angular_damping": 0.004,
    "grip": 0.7,
    "slip": 0,
}
ARSIM = {
    "mass": 3.0,
    "inertia": 0.2,
    "radius": 0.2,
    "half_track": 0.2,
    "wheel_radius": 0.1,
    "wheel_mass": 0.0,
    "wheel_inertia": 0.0,
    "linear_damping": 1.0,
    "angular_damping": 0.1,
    "grip": 0.7,
    "slip": 0,
}


class Body:
    """A body in an arena, moved by torques."""

    def __init__(self, arena: Arena | None = None, parameters: dict[str, float] = BOE_BOT, **changes: float) -> None:
        self.parameters = ffi.new("body_parameters *", {**parameters, **changes})
        self.arena = arena_of() if arena is None else arena
        self.body = ffi.new("body *")
        lib.body_init(self.body, self.parameters, 0.12)
        self.scene = ffi.new("scene *", {"arena": self.arena.handle})

    @property
    def state(self) -> Any:
        return self.body.state

    def place(self, x: float, y: float, heading: float, speed: float = 0.0, turn_rate: float = 0.0) -> None:
        lib.body_place(self.body, x, y, heading)
        self.state.speed, self.state.turn_rate = speed, turn_rate

    def advance(self, left: float, right: float, dt: float = 0.001, steps: int = 1) -> None:
        for _ in range(steps):
            lib.body_advance(self.body, self.scene, left, right, dt)

    def regulate(
        self, reference: Callable[[float], tuple[float, float]], gain: float, seconds: float, dt: float
    ) -> None:
        """Wheel speeds by (3.15)."""
        half = self.parameters.half_track
        for step in range(round(seconds / dt)):
            left, right = reference(step * dt)
            v, w = self.state.speed, self.state.turn_rate
            self.advance(gain * (left - (v - half * w)), gain * (right - (v + half * w)), dt)

    @property
    def depth(self) -> float:
        """How far it has sunk into something (m)."""
        distance = distance_to_segments(self.arena, self.state.x, self.state.y)
        return max(0.0, float(self.parameters.radius) - distance)

    @property
    def energy(self) -> float:
        """Kinetic, wheels included (J)."""
        p, s = self.parameters, self.state
        spin = p.wheel_mass + p.wheel_inertia / p.wheel_radius**2
        forward = p.mass + 2 * spin
        turning = p.inertia + 2 * spin * p.half_track**2
        sideways = p.mass + 2 * p.wheel_mass
        return float(0.5 * (forward * s.speed**2 + turning * s.turn_rate**2 + sideways * s.lateral**2))


def constant(left: float, right: float) -> Callable[[float], tuple[float, float]]:
    """The same wheel speeds at any time."""
    return lambda t: (left, right)


def test_a_and_b_of_the_boe_bot() -> None:
    """Equations (2.26), (2.30) with the numbers of a Boe-Bot."""
    parameters = ffi.new("body_parameters *", BOE_BOT)
    assert lib.body_a(parameters) == pytest.approx(26.09, abs=0.005)
    assert lib.body_b(parameters) == pytest.approx(1.305, abs=0.0005)


def test_a_and_b_without_wheel_masses() -> None:
    """(2.33), (2.34)."""
    parameters = ffi.new("body_parameters *", {**BOE_BOT, "wheel_mass": 0.0, "wheel_inertia": 0.0})
    assert lib.body_a(parameters) == pytest.approx(1 / 0.0333)
    assert lib.body_b(parameters) == pytest.approx(0.0525 / 0.0333)


def test_acceleration_by_elimination() -> None:
    """(2.10)-(2.19) solved as linear equations give what (2.25), (2.29) give in one step from rest."""
    import numpy as np

    p = {**BOE_BOT, "linear_damping": 0.0, "angular_damping": 0.0}
    m, i_w, r, half = p["wheel_mass"], p["wheel_inertia"], p["wheel_radius"], p["half_track"]
    left, right = 0.05, 0.08
    # unknowns: aL aR FL FR rhoL rhoR V' phi''
    equations = np.array(
        [
            [m, 0, -1, 0, 1, 0, 0, 0],
            [0, m, 0, -1, 0, 1, 0, 0],
            [i_w / r, 0, r, 0, 0, 0, 0, 0],
            [0, i_w / r, 0, r, 0, 0, 0, 0],
            [0, 0, 0, 0, -1, -1, p["mass"], 0],
            [0, 0, 0, 0, half, -half, 0, p["inertia"]],
            [0.5, 0.5, 0, 0, 0, 0, -1, 0],
            [-0.5 / half, 0.5 / half, 0, 0, 0, 0, 0, -1],
        ]
    )
    solution = np.linalg.solve(equations, [0, 0, left, right, 0, 0, 0, 0])
    body = Body(parameters=p)
    body.advance(left, right, dt=0.001)
    assert body.state.speed == pytest.approx(solution[6] * 0.001, rel=1e-12)
    assert body.state.turn_rate == pytest.approx(solution[7] * 0.001, rel=1e-12)


@pytest.mark.parametrize(("gain", "expected"), [(0.5, 0.2727), (2.0, 0.2927), (10.0, 0.2985)])
def test_steady_speed_of_the_regulated_motor(gain: float, expected: float) -> None:
    """The regulated motor (3.15) settles at V_ref 2AK / (2AK + alpha)."""
    body = Body(parameters=ARSIM)
    body.regulate(constant(0.3, 0.3), gain, 5.0, 0.01)
    assert body.state.speed == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(("dt", "stable"), [(0.029, True), (0.031, False)])
def test_regulated_motor_is_stable_up_to_the_step_of_theory(dt: float, stable: bool) -> None:
    """Delta t < 2M / (2AK + alpha) = 0.030 s for K = 10."""
    body = Body(parameters=ARSIM)
    body.regulate(constant(0.3, 0.3), 10.0, 300 * dt, dt)
    assert (abs(body.state.speed - 0.2985) < 0.01) == stable


def test_circle_closes_around_its_centre_of_rotation() -> None:
    """v = 0.08, 0.12 m/s with R = 0.0525 m turn about a point 0.2625 m to the left."""
    body = Body(linear_damping=0.0, angular_damping=0.0)
    rate = 0.04 / 0.105
    body.place(0, 0, 0, speed=0.10, turn_rate=rate)
    seconds = 2 * math.pi / rate
    xs, ys = [], []
    for _ in range(round(seconds / 0.001)):
        body.advance(0, 0)
        xs.append(body.state.x)
        ys.append(body.state.y)
    assert math.hypot(body.state.x, body.state.y) < 0.001
    assert (max(ys) - min(ys)) / 2 == pytest.approx(0.2625, abs=0.0005)
    assert (max(ys) + min(ys)) / 2 == pytest.approx(0.2625, abs=0.0005)
    assert body.state.distance == pytest.approx(2 * math.pi * 0.2625, rel=1e-3)


def test_coasting_decays_exponentially() -> None:
    """(2.31) without torque: V = V_0 exp(-alpha t A-corrected / M)."""
    body = Body()
    body.place(0, 0, 0, speed=0.2)
    body.advance(0, 0, dt=0.0001, steps=5000)
    assert body.state.speed == pytest.approx(0.2 * math.exp(-0.5 / 0.6), rel=1e-3)


def test_wheels_turn_with_the_body() -> None:
    """(2.1), (2.18), (2.19)."""
    body = Body(linear_damping=0.0, angular_damping=0.0)
    body.place(0, 0, 0, speed=0.1, turn_rate=0.5)
    body.advance(0, 0, steps=1000)
    assert body.state.wheel_left == pytest.approx((0.1 - 0.0525 * 0.5) / 0.0333)
    assert body.state.wheel_right == pytest.approx((0.1 + 0.0525 * 0.5) / 0.0333)


def test_step_halved_changes_little() -> None:
    def end(dt: float) -> tuple[float, float]:
        body = Body()
        body.regulate(lambda t: (0.1 + 0.05 * math.sin(t), 0.1 + 0.05 * math.cos(0.7 * t)), 1.2, 10.0, dt)
        return body.state.x, body.state.y

    coarse, fine = end(0.001), end(0.0005)
    assert math.dist(coarse, fine) < 0.001


# ---- contact ---------------------------------------------------------------------------------------------


def test_head_on_it_stops_at_the_wall() -> None:
    body = Body(arena_of(square(1, 0, 1)))  # face at x = 0.5
    body.regulate(constant(0.17, 0.17), 1.2, 5.0, 0.001)
    assert body.state.x == pytest.approx(0.5 - RADIUS, abs=1e-9)
    assert body.state.y == pytest.approx(0, abs=1e-12)
    assert abs(body.state.speed) < 0.03
    assert body.state.touching
    assert body.state.touch_x == pytest.approx(0.5)


def test_at_an_angle_it_slides_along_the_wall() -> None:
    body = Body(arena_of(square(10, 0, 20 - 1)))  # a long face at x = 0.5
    body.place(0, 0, math.radians(70))
    body.regulate(constant(0.17, 0.17), 1.2, 12.0, 0.001)
    assert body.state.x == pytest.approx(0.5 - RADIUS, abs=1e-9)
    assert body.state.y > 0.6  # it went on beside it
    assert body.state.heading == pytest.approx(math.radians(70))  # a push through its centre turns nothing


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


def test_grip_decides_whether_it_slides() -> None:
    """Pushed at 45 degrees into a wall, tyres that hold stop it where slippery ones let it slide."""

    def way(grip: float) -> float:
        body = Body(arena_of(square(10, 0, 19)), grip=grip)
        body.place(0.5 - RADIUS, 0, math.radians(45))
        body.advance(0.02, 0.02, steps=2000)  # 2 x 0.02 N m at the rim: 1.2 N
        return float(body.state.y)

    assert way(0.0) > 0.3
    assert way(0.7) < 0.01


arenas = st.lists(st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(0.05, 0.4)), max_size=4)


@given(
    arenas,
    st.floats(-math.pi, math.pi),
    st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=8),
    st.sampled_from([0.001, 0.005, 0.010]),
)
def test_nothing_is_sunk_into_or_passed_through(
    blocks: list[tuple[float, float, float]], heading: float, references: list[tuple[float, float]], dt: float
) -> None:
    """At up to 3 m/s, twenty times the robot's speed."""
    arena = arena_of(*(square(x, y, side) for x, y, side in blocks), outline=square(0, 0, 2))
    if not arena.is_free(0, 0, RADIUS):
        return
    body = Body(arena)
    body.place(0, 0, heading)
    for left, right in references:
        before = body.state.x, body.state.y
        for _ in range(20):
            body.regulate(constant(left, right), 0.3, dt, dt)
            assert body.depth < 1e-9
            # Not through: it stands in free space, and did not jump.
            assert arena.is_free(body.state.x, body.state.y, RADIUS - 1e-9)
        assert math.dist(before, (body.state.x, body.state.y)) <= 20 * dt * 4


@given(st.floats(0, math.pi), st.floats(0.01, 3.0), st.floats(-5, 5))
def test_contact_gains_no_energy(heading: float, speed: float, turn_rate: float) -> None:
    body = Body(arena_of(outline=square(0, 0, 0.5)), linear_damping=0.0, angular_damping=0.0)
    body.place(0, 0, heading, speed, turn_rate)
    energy = body.energy
    for _ in range(300):
        body.advance(0, 0)
        assert body.energy <= energy * (1 + 1e-12)
        energy = body.energy
    assert math.isfinite(body.state.x)


def test_corner_and_wedge_hold_it() -> None:
    wedge = [(0.0, 0.2), (1.0, 0.05), (1.0, -0.05), (0.0, -0.2), (1.2, -0.2), (1.2, 0.2)]
    body = Body(arena_of(wedge))
    body.place(-0.2, 0.0, 0.0)
    body.regulate(constant(0.17, 0.17), 1.2, 10.0, 0.001)
    assert body.depth < 1e-9
    assert body.state.x < 1.0
    stuck = body.state.x
    body.regulate(constant(-0.17, -0.17), 1.2, 2.0, 0.001)
    assert body.state.x < stuck - 0.2


def test_obstacle_pushed_near_is_noticed() -> None:
    """Lists of near edges are renewed when the arena changes."""
    arena = arena_of(square(5, 0, 1))
    body = Body(arena)
    body.regulate(constant(0.1, 0.1), 1.2, 0.5, 0.001)
    arena.move("0", -5 + body.state.x + 0.5 + RADIUS + 0.02, 0)
    body.regulate(constant(0.1, 0.1), 1.2, 2.0, 0.001)
    assert body.state.touching
    assert body.depth < 1e-9


def test_segment_on_the_body_touches_what_it_crosses() -> None:
    body = Body(arena_of(square(1, 0, 1)))  # face at x = 0.5

    def touches() -> bool:
        return bool(lib.body_segment_touches(body.body, body.scene, 0.045, 0.03, 0.1, 0.055))

    for x, expected in ((0.39, False), (0.3999, False), (0.4001, True), (0.42, True)):
        body.place(x, 0, 0)
        assert touches() == expected
    body.place(0.42, 0, math.pi)
    assert not touches()


def test_default_robot_within_the_contact_guard() -> None:
    """V dt < radius / 2 without splitting a step, for the kit's own robot and step."""
    body = load_robot("shieldbot").body
    assert body.wheel_speed_maximum_m_s * 0.001 < body.radius_m / 2
    assert imperfections.SERVO_TOP_RPM * imperfections.RPM * body.wheel_radius_m > body.wheel_speed_maximum_m_s
