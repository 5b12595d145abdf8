"""The rolling body: closed forms and a high-accuracy integrator; experiments E03 to E07."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from boebot.devices.motor import DcMotor
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices.motor import dc_parameters
from sim_bridge.tests.world.bodies import ARSIM, BOE_BOT, Body, World, constant

FREE: dict[str, Any] = {"linear_damping": 0.0, "angular_damping": 0.0}


def coefficients(parameters: dict[str, Any]) -> tuple[float, float]:
    """A and B by linear equations: the unit responses of (2.10)-(2.19) times M and I."""
    p = parameters
    m, i_w, r, half = p["wheel_mass"], p["wheel_inertia"], p["wheel_radius"], p["half_track"]
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
    solution = np.linalg.solve(equations, [0, 0, 0, 1, 0, 0, 0, 0])  # 1 N m at the right wheel
    return float(p["mass"] * solution[6]), float(p["inertia"] * solution[7])


def test_e04_a_and_b_by_elimination() -> None:
    """Equal to the elimination; in the limit of light wheels 1/r, R/r, (2.33), (2.34); Boe-Bot 26.09, 1.305."""
    for parameters in (BOE_BOT, ARSIM, {**BOE_BOT, "wheel_mass": 0.2, "wheel_inertia": 1e-3}):
        c = ffi.new("body_parameters *", parameters)
        assert (lib.body_a(c), lib.body_b(c)) == pytest.approx(coefficients(parameters), rel=1e-12)
    boe_bot = ffi.new("body_parameters *", BOE_BOT)
    assert lib.body_a(boe_bot) == pytest.approx(26.09, abs=0.005)
    assert lib.body_b(boe_bot) == pytest.approx(1.305, abs=0.0005)
    light = ffi.new("body_parameters *", {**BOE_BOT, "wheel_mass": 0.0, "wheel_inertia": 0.0})
    assert lib.body_a(light) == pytest.approx(1 / 0.0333)
    assert lib.body_b(light) == pytest.approx(0.0525 / 0.0333)


def test_one_step_is_that_acceleration() -> None:
    body = Body(**FREE)
    a, b = coefficients(BOE_BOT)
    body.advance(0.005, 0.008)
    assert body.state.speed == pytest.approx(a * 0.013 / 0.6 * 0.001, rel=1e-12)
    assert body.state.turn_rate == pytest.approx(b * 0.003 / 1.2e-3 * 0.001, rel=1e-12)


@pytest.mark.parametrize(("gain", "expected"), [(0.5, 0.2727), (2.0, 0.2927), (10.0, 0.2985)])
def test_e03_steady_speed_of_the_regulated_motor(gain: float, expected: float) -> None:
    """The regulated motor (3.15) settles at V_ref 2AK / (2AK + alpha)."""
    body = Body(parameters=ARSIM, slip=0)
    body.regulate(constant(0.3, 0.3), gain, 5.0, 0.01)
    assert body.state.speed == pytest.approx(expected, abs=1e-3)
    assert body.state.speed == pytest.approx(0.3 * 20 * gain / (20 * gain + 1), abs=1e-6)


@pytest.mark.parametrize(("dt", "stable"), [(0.029, True), (0.031, False)])
def test_e03_regulated_motor_diverges_beyond_its_step(dt: float, stable: bool) -> None:
    """Delta t < 2M / (2AK + alpha) = 0.030 s for K = 10."""
    body = Body(parameters=ARSIM, slip=0)
    body.regulate(constant(0.3, 0.3), 10.0, 300 * dt, dt)
    assert (abs(body.state.speed - 0.2985) < 0.01) == stable


def drive_arsim(left: float, right: float, seconds: float, dt: float = 0.01) -> tuple[Body, list[tuple[float, float]]]:
    """The default robot by motor signals; speed and turn rate after each step."""
    motor = ffi.new("motor_dc_parameters *", dc_parameters(DcMotor(full=True)))
    body = Body(parameters=ARSIM)
    rows = []
    for _ in range(round(seconds / dt)):
        torques = [
            lib.motor_dc_torque(motor, lib.motor_dc_voltage(motor, signal), rim / ARSIM["wheel_radius"], 0.0)
            for signal, rim in ((left, body.state.rim_left), (right, body.state.rim_right))
        ]
        body.advance(torques[0], torques[1], dt=dt)
        rows.append((body.state.speed, body.state.turn_rate))
    return body, rows


@pytest.mark.parametrize(("signal", "steady"), [(0.5, 0.682), (1.0, 1.381)])
def test_e05_default_robot_straight_on(signal: float, steady: float) -> None:
    """Steady speed within 1 %; 63 % of it after 0.15 +- 0.02 s at half signal (at full, the torque limit delays it)."""
    body, rows = drive_arsim(signal, signal, 5.0)
    assert body.state.speed == pytest.approx(steady, rel=0.01)
    assert abs(body.state.y) < 1e-12
    rise = next(i for i, (speed, _) in enumerate(rows) if speed > (1 - math.exp(-1)) * steady) * 0.01
    if signal == 0.5:
        assert rise == pytest.approx(0.15, abs=0.02)


def test_e06_default_robot_on_the_spot() -> None:
    body, rows = drive_arsim(-0.7, 0.7, 5.0)
    assert body.state.turn_rate == pytest.approx(4.447, rel=0.01)  # counter-clockwise
    assert math.hypot(body.state.x, body.state.y) < 1e-12
    assert sum(rate for _, rate in rows[:33]) * 0.01 == pytest.approx(0.676, abs=0.03)


def test_e07_circle_closes_around_its_centre_of_rotation() -> None:
    """v = 0.08, 0.12 m/s with R = 0.0525 m turn about a point 0.2625 m to the left."""
    body = Body(**FREE)
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
    """(2.31), (2.32) without torque: V = V_0 exp(-alpha t / M), the same for the turning."""
    body = Body()
    body.place(0, 0, 0, speed=0.2, turn_rate=1.0)
    body.advance(0, 0, dt=0.0001, steps=5000)
    assert body.state.speed == pytest.approx(0.2 * math.exp(-0.5 / 0.6), rel=1e-3)
    assert body.state.turn_rate == pytest.approx(math.exp(-0.5 * 0.004 / 1.2e-3), rel=1e-3)


def test_wheels_turn_with_the_body() -> None:
    """(2.1), (2.18), (2.19)."""
    body = Body(**FREE)
    body.place(0, 0, 0, speed=0.1, turn_rate=0.5)
    body.advance(0, 0, steps=1000)
    assert body.state.wheel_left == pytest.approx((0.1 - 0.0525 * 0.5) / 0.0333)
    assert body.state.wheel_right == pytest.approx((0.1 + 0.0525 * 0.5) / 0.0333)


@given(st.lists(st.tuples(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02)), min_size=1, max_size=30))
def test_where_the_tyres_hold_slip_changes_no_bit(torques: list[tuple[float, float]]) -> None:
    """Rolling without slip is (2.25)-(2.32) whether slip is switched on or not."""
    states = []
    for slip in (0, 1):
        body = Body(slip=slip)
        for left, right in torques:
            body.advance(left, right, steps=10)
        states.append(bytes(ffi.buffer(ffi.addressof(body.body, "state"))))
    assert states[0] == states[1]


def test_robots_far_apart_move_as_if_alone() -> None:
    """And a robot moves the same alone, among others, and with a moving obstacle far away."""
    alone = Body()
    others = [Body(robot=i + 1) for i in range(3)]
    for i, robot in enumerate(others):
        robot.place(0, 3.0 * i, 0)
    world = World(others)
    world.mover(-5, 0, radius=0.2)
    for _ in range(500):
        alone.advance(0.004, 0.005)
        world.step([(0.004, 0.005), (0.005, 0.001), (0.0, 0.002)], 0.001)
    assert bytes(ffi.buffer(ffi.addressof(others[0].body, "state"))) == bytes(
        ffi.buffer(ffi.addressof(alone.body, "state"))
    )


# ---- against a high-accuracy integrator ---------------------------------------------------------------------

Torque = Callable[[float, float, float], float]


def integrate(
    parameters: dict[str, Any], torques: Callable[[float, float, float], tuple[float, float]], seconds: float
) -> Any:
    """(2.7)-(2.9), (2.31), (2.32) by an explicit Runge-Kutta method of order 8; torques by time and rim speeds."""
    a, b = coefficients(parameters)
    p = parameters

    def rates(t: float, state: Any) -> list[float]:
        _, _, heading, speed, turn = state
        left, right = torques(t, speed - p["half_track"] * turn, speed + p["half_track"] * turn)
        return [
            speed * math.cos(heading),
            speed * math.sin(heading),
            turn,
            (a * (left + right) - p["linear_damping"] * speed) / p["mass"],
            (b * (right - left) - p["angular_damping"] * turn) / p["inertia"],
        ]

    return solve_ivp(rates, (0, seconds), [0.0] * 5, method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.02).y[:, -1]


def regulated(t: float, left: float, right: float) -> tuple[float, float]:
    """Two regulated motors that follow time-varying references."""
    return 0.3 * (0.1 + 0.05 * math.sin(t) - left), 0.3 * (0.1 + 0.05 * math.cos(0.7 * t) - right)


def direct_current(t: float, left: float, right: float) -> tuple[float, float]:
    """Two motors of 1.10 by (1.8), (1.9), (1.10), in forward motion."""

    def torque(volts: float, rim: float) -> float:
        axis = 2.0 * rim / 0.1
        return 2.0 * (0.0333 * (volts - 0.0333 * axis) / 0.62 - 0.008 - 0.02 * axis)

    return torque(5.0 + math.sin(t), left), torque(5.0 + math.cos(0.7 * t), right)


@pytest.mark.parametrize(("parameters", "torques"), [(BOE_BOT, regulated), (ARSIM, direct_current)])
def test_motion_converges_to_the_integrator(
    parameters: dict[str, Any], torques: Callable[[float, float, float], tuple[float, float]]
) -> None:
    """The error of pose and speeds is of first order in the step: halved with it, and small at 1 ms."""
    truth = integrate(parameters, torques, 8.0)

    def error(dt: float) -> float:
        body = Body(parameters=parameters)
        motor = ffi.new("motor_dc_parameters *", dc_parameters(DcMotor(full=True)))
        for step in range(round(8.0 / dt)):
            t, s = step * dt, body.state
            if torques is regulated:
                left, right = regulated(t, s.rim_left, s.rim_right)
            else:  # the kit's own motor
                left = lib.motor_dc_torque(motor, 5.0 + math.sin(t), s.rim_left / 0.1, 0.0)
                right = lib.motor_dc_torque(motor, 5.0 + math.cos(0.7 * t), s.rim_right / 0.1, 0.0)
            body.advance(left, right, dt=dt)
            assert not s.slipping
        found = np.array([s.x, s.y, lib.number_wrap(s.heading - truth[2]), s.speed, s.turn_rate])
        return float(np.abs(found - [truth[0], truth[1], 0.0, truth[3], truth[4]]).max())

    coarse, fine = error(0.002), error(0.001)
    assert fine < 0.005
    assert 0.4 < fine / coarse < 0.6
