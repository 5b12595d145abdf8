"""Tyres at and beyond their limit: closed forms of Coulomb friction, patches, what encoders see."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sim_bridge.compiled import lib
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.tests.world.bodies import ARSIM, BOE_BOT, Body, constant

G = 9.81
FREE: dict[str, Any] = {"linear_damping": 0.0, "angular_damping": 0.0}
MASS = 0.6 + 2 * 0.03
SPIN = 1e-4 / 0.0333**2  # with spin_inertia 1e-4: mass of a wheel's turning at the rim


def patched(x: float, y: float, side: float, grip: float) -> Any:
    """An arena with one square friction patch."""
    arena = arena_of()
    corners = [value for corner in square(x, y, side) for value in corner]
    assert lib.arena_add_patch(arena.handle, corners, 4, grip) >= 0
    lib.arena_build(arena.handle)
    return arena


def test_wheels_spin_where_the_floor_gives_less_than_the_motors() -> None:
    """The body gains mu g; each wheel's rim tau/r less the floor's force, over the mass of its turning."""
    body = Body(grip=0.2, spin_inertia=1e-4, **FREE)
    body.advance(0.1, 0.1, steps=200)
    s = body.state
    assert s.slipping
    assert s.speed == pytest.approx(0.2 * G * 0.2, rel=1e-9)
    rim = (0.1 / 0.0333 - 0.2 * 0.5 * MASS * G) / SPIN * 0.2
    assert (s.rim_left, s.rim_right) == pytest.approx((rim, rim), rel=1e-9)
    # encoders follow the wheel, not the ground
    assert s.wheel_left * 0.0333 == pytest.approx(rim * 0.201 / 2, rel=1e-6)
    assert s.distance == pytest.approx(0.2 * G * 0.2 * 0.201 / 2, rel=1e-6)


def test_spinning_wheels_come_to_roll_again() -> None:
    """After the torque goes, both come to a common speed: momentum of body and rims is kept by inner forces."""
    body = Body(grip=0.2, spin_inertia=1e-4, **FREE)
    body.advance(0.1, 0.1, steps=100)
    s = body.state
    kept = None
    while s.slipping:
        body.advance(0, 0)
        kept = s.speed
    assert kept == s.rim_left == s.rim_right == s.speed
    angular = SPIN * 2  # the floor's impulse p: body +p, rims -p
    first = 0.2 * G * 0.1
    rim = (0.1 / 0.0333 - 0.2 * 0.5 * MASS * G) / SPIN * 0.1
    assert s.speed == pytest.approx((MASS * first + angular * rim) / (MASS + angular), rel=1e-9)


@pytest.mark.parametrize("grip", [0.1, 0.5])
def test_locked_wheels_slide_to_rest(grip: float) -> None:
    """v^2 / (2 mu g)."""
    body = Body(grip=grip, **FREE)
    body.place(0, 0, 0, speed=0.8)
    steps = 0
    while abs(body.state.speed) > 1e-9 and steps < 5000:
        s = body.state
        hold = 0.3 * SPIN * 0.0333 / 0.001
        body.advance(-hold * s.rim_left - grip * 0.1, -hold * s.rim_right - grip * 0.1, dt=0.0005)
        steps += 1
        if s.speed < 0.02:
            break
    assert s.x == pytest.approx((0.8**2 - s.speed**2) / (2 * grip * G), rel=0.02)


def test_thrown_sideways_it_stops_by_friction() -> None:
    body = Body(grip=0.5, **FREE)
    body.state.lateral = 1.0
    body.state.slipping = 1
    body.advance(0, 0, steps=1000)
    assert body.state.y == pytest.approx(1.0 / (2 * 0.5 * G), rel=0.01)
    assert (body.state.x, body.state.lateral, body.state.slipping) == (0.0, 0.0, 0)


def test_spinning_wheels_hold_less_sideways() -> None:
    """Along and across share one limit: both components against an integrator of Coulomb's law."""
    body = Body(grip=0.3, spin_inertia=1e-4, **FREE)
    s = body.state
    s.lateral, s.slipping, s.rim_left, s.rim_right = 0.4, 1, 2.0, 2.0

    def rates(t: float, state: Any) -> list[float]:
        speed, lateral, rim = state
        slip = math.hypot(speed - rim, lateral)
        along, across = -0.3 * G * (speed - rim) / slip, -0.3 * G * lateral / slip
        return [along, across, -along * MASS / (2 * SPIN)]

    truth = solve_ivp(rates, (0, 0.03), [0.0, 0.4, 2.0], method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    body.advance(0, 0, dt=1e-5, steps=3000)
    assert (s.speed, s.lateral, s.rim_left) == pytest.approx(tuple(truth), abs=1e-5)
    assert s.lateral > 0.35  # rolling wheels would have taken 0.088 m/s of it


def test_too_fast_a_turn_slides() -> None:
    """Within mu g it goes round as the wheels say; beyond, the floor bends its way by mu g at most, and it drifts."""

    def bend(speed: float) -> tuple[float, bool]:
        """Centripetal acceleration of the settled way, by its positions; whether the tyres slip."""
        body = Body(grip=0.5, **FREE)
        rate = speed / 0.3
        body.regulate(constant(speed - 0.0525 * rate, speed + 0.0525 * rate), 0.1, 3.0, 0.001)
        velocities = []
        for _ in range(3000):
            body.regulate(constant(speed - 0.0525 * rate, speed + 0.0525 * rate), 0.1, 0.001, 0.001)
            velocities.append(complex(*body.velocity))
        changes = [abs(b - a) / 0.001 for a, b in itertools.pairwise(velocities)]
        return sum(changes) / len(changes), bool(body.state.slipping)

    acceleration, slips = bend(1.0)
    assert acceleration == pytest.approx(1.0**2 / 0.3, rel=0.02) and not slips
    acceleration, slips = bend(1.6)  # 8.5 would be needed
    assert 0.9 * 0.5 * G < acceleration < 1.01 * 0.5 * G and slips


def test_patch_under_one_wheel_turns_the_robot() -> None:
    """The left wheel spins on ice, the right one drives: the robot turns left about it."""
    body = Body(patched(0.0, 1.0, 2.0, 0.02))  # y > 0
    body.advance(0.03, 0.03, steps=300)
    assert body.state.heading > 0.2
    assert body.state.wheel_left > body.state.wheel_right
    body = Body(patched(0.0, 1.0, 2.0, 0.02), slip=0)
    body.advance(0.03, 0.03, steps=300)
    assert body.state.heading == 0.0


def test_it_rolls_on_after_a_patch() -> None:
    body = Body(patched(0.5, 0.0, 0.4, 0.01))
    slipped = []
    for _ in range(700):
        body.regulate(constant(0.5, 0.5), 0.3, 0.01, 0.001)
        body.regulate(constant(0.3, 0.3), 0.3, 0.001, 0.001)
        slipped.append((body.state.x, body.state.slipping))
    assert any(slipping for x, slipping in slipped if 0.3 < x < 0.7)
    assert not any(slipping for x, slipping in slipped if x > 1.2)


def test_pushing_a_wall_the_wheels_spin() -> None:
    """The encoders count although the robot stands: what a stuck detector must know."""
    body = Body(arena_of(square(1, 0, 1)))
    body.place(0.43, 0, 0)
    body.regulate(constant(0.17, 0.17), 1.2, 1.0, 0.001)
    assert body.state.speed == pytest.approx(0, abs=1e-9)
    # floor's 0.7 N of 3.24 N and motor's K (v_ref - v) / r balance: v_ref - v = mu N r / K
    expected = 0.17 - 0.7 * 0.5 * MASS * G * 0.0333 / 1.2
    assert body.state.rim_left == pytest.approx(expected, abs=1e-3)
    assert body.state.wheel_left > 3.0


@given(
    st.floats(-2, 2), st.floats(-10, 10), st.floats(-1, 1), st.floats(-3, 3), st.floats(-3, 3), st.floats(0, 1.2),
    st.sampled_from([0.001, 0.01, 0.05]), st.sampled_from([BOE_BOT, ARSIM]),
)  # fmt: skip
def test_slip_gains_no_energy(
    speed: float, turn: float, lateral: float, left: float, right: float, grip: float, dt: float, parameters: Any
) -> None:
    body = Body(parameters=parameters, grip=grip)
    s = body.state
    s.speed, s.turn_rate, s.lateral, s.rim_left, s.rim_right, s.slipping = speed, turn, lateral, left, right, 1
    for _ in range(60):
        energy = body.energy
        body.advance(0, 0, dt=dt)
        assert body.energy <= energy * (1 + 1e-12) + 1e-18


def test_mirrored_it_does_the_same() -> None:
    """Left and right are treated alike."""
    ends = []
    for sign in (1, -1):
        body = Body(grip=0.2)
        for step in range(400):
            torques = (0.08, 0.01) if step < 200 else (0.0, 0.05)
            body.advance(*(torques if sign > 0 else torques[::-1]))
        s = body.state
        ends.append((s.x, sign * s.y, sign * s.heading, s.speed, sign * s.lateral, sign * s.turn_rate))
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)
