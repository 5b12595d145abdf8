"""Motors: (1.1)-(1.10), (3.15), servos; experiments E01 and E02."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from boebot.description.robots import load_robot
from boebot.devices.motor import DcMotor
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices import servo as servo_model
from sim_bridge.devices.motor import dc_parameters
from sim_bridge.robots import imperfections
from sim_bridge.tests.world.bodies import ARSIM, BOE_BOT, Body

C_T = C_E = 0.0333
R_A, C_C, C_V, GEAR = 0.62, 0.008, 0.02, 2.0
ROTOR = 5e-5  # kg m^2, of E01


def dc_motor(**changes: float) -> Any:
    motor = ffi.new("motor_dc_parameters *", dc_parameters(DcMotor(full=True)))
    for name, value in changes.items():
        setattr(motor, name, value)
    return motor


# ---- direct current -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("volts", "load", "expected"), [(6.0, 0.0, 14.4231), (12.0, 0.1, 24.6238)])
def test_e01_full_model_settles_at_the_steady_formula(volts: float, load: float, expected: float) -> None:
    """The motor alone, L 0.2 mH, I 5e-5, without gear: within 0.1 % of (c_t V/R - c_C - load) / (c_e c_t/R + c_v)."""
    motor = dc_motor(gear=1.0)
    current = ffi.new("double *")
    speed = 0.0
    for _ in range(20000):
        speed += 1e-5 / ROTOR * (lib.motor_dc_step(motor, current, volts, speed, 0.0, 1e-5) - load)
    formula = (C_T * volts / R_A - C_C - load) / (C_E * C_T / R_A + C_V)
    assert formula == pytest.approx(expected, abs=1e-3)
    assert speed == pytest.approx(formula, rel=1e-3)
    assert current[0] == pytest.approx((volts - C_E * speed) / R_A, rel=1e-6)


def test_e01_full_model_against_an_integrator() -> None:
    """(1.1), (1.5) from standstill: current and speed through the whole transient."""

    def rates(t: float, state: Any) -> list[float]:
        current, speed = state
        friction = C_C + C_V * speed
        return [(6.0 - R_A * current - C_E * speed) / 0.2e-3, (C_T * current - friction) / ROTOR]

    motor = dc_motor(gear=1.0)
    current = ffi.new("double *", 3.0)
    speed, dt = 2.0, 2e-6  # it turns already; standstill has its own law
    times = np.array([0.0005, 0.002, 0.01])
    truth = solve_ivp(rates, (0, 0.02), [3.0, 2.0], method="LSODA", rtol=1e-10, atol=1e-12, t_eval=times)
    assert truth.success
    step = 0
    for time, expected in zip(times, truth.y.T, strict=True):
        while step * dt < time - dt / 2:
            speed += dt / ROTOR * lib.motor_dc_step(motor, current, 6.0, speed, 0.0, dt)
            step += 1
        assert (current[0], speed) == pytest.approx(tuple(expected), rel=2e-3)


@given(st.floats(1e-7, 10.0), st.floats(-24, 24), st.floats(-50, 50), st.floats(-40, 40))
def test_full_model_is_stable_and_exact_at_any_step(dt: float, volts: float, speed: float, start: float) -> None:
    """The exponential of (1.1) at constant voltage and speed; torque by the mean current."""
    motor = dc_motor(torque_maximum_n_m=1e9, coulomb_n_m=0.0, viscous_n_m_s=0.0)
    current = ffi.new("double *", start)
    torque = lib.motor_dc_step(motor, current, volts, speed, 0.0, dt)
    settled = (volts - C_E * GEAR * speed) / R_A
    share = R_A * dt / 0.2e-3
    assert current[0] == pytest.approx(settled + (start - settled) * math.exp(-share), rel=1e-9, abs=1e-9)
    mean = settled + (start - settled) * -math.expm1(-share) / share
    assert torque == pytest.approx(GEAR * C_T * mean, rel=1e-6, abs=1e-7)
    quasi_static = dc_motor(inductance_h=0.0)
    assert lib.motor_dc_step(quasi_static, current, volts, speed, 0.0, dt) == lib.motor_dc_torque(
        quasi_static, volts, speed, 0.0
    )


def test_e02_torque_at_standstill() -> None:
    """2 (c_t V/R_a - c_C), clipped at 1 N m for V > 9.46, nothing for V < 0.149, the same the other way round."""
    motor = dc_motor()
    for volts in np.linspace(0, 12, 241):
        formula = min(max(2 * (C_T * volts / R_A - C_C), 0.0), 1.0)
        assert lib.motor_dc_torque(motor, volts, 0.0, 0.0) == pytest.approx(formula, abs=1e-12)
        assert lib.motor_dc_torque(motor, -volts, 0.0, 0.0) == pytest.approx(-formula, abs=1e-12)
    assert lib.motor_dc_torque(motor, 9.45, 0.0, 0.0) < 1.0 == lib.motor_dc_torque(motor, 9.47, 0.0, 0.0)
    assert lib.motor_dc_torque(motor, 0.148, 0.0, 0.0) == 0.0 < lib.motor_dc_torque(motor, 0.150, 0.0, 0.0)


def test_gear_and_efficiency() -> None:
    """(1.10): torque times G, speed divided by G."""
    direct, geared, lossy = dc_motor(gear=1.0), dc_motor(gear=3.0), dc_motor(gear=3.0, efficiency=0.8)
    torque = lib.motor_dc_torque(direct, 4.0, 6.0, 0.0)
    assert torque == pytest.approx(C_T * (4.0 - C_E * 6.0) / R_A - C_C - C_V * 6.0, rel=1e-12)
    assert lib.motor_dc_torque(geared, 4.0, 2.0, 0.0) == pytest.approx(3 * torque, rel=1e-12)
    assert lib.motor_dc_torque(lossy, 4.0, 2.0, 0.0) == pytest.approx(2.4 * torque, rel=1e-12)


def test_signal_is_a_share_of_the_voltage() -> None:
    motor = dc_motor()
    assert [lib.motor_dc_voltage(motor, s) for s in (-2, -1, 0.25, 1, 3)] == [-12, -12, 3, 12, 12]


@pytest.mark.parametrize("slip", [0, 1])
def test_coulomb_friction_does_not_chatter(slip: int) -> None:
    """A coasting robot comes to rest and stays; without `hold` its wheels would swing to and fro."""
    ends = {}
    for hold in (False, True):
        motor = dc_motor()
        body = Body(parameters=ARSIM, slip=slip)
        body.place(0, 0, 0, speed=0.5, turn_rate=0.5)
        held = lib.body_wheel_hold(body.body, 0.01) if hold else 0.0
        for _ in range(500):
            torques = [
                lib.motor_dc_torque(motor, 0.0, rim / 0.1, held) for rim in (body.state.rim_left, body.state.rim_right)
            ]
            body.advance(torques[0], torques[1], dt=0.01)
        ends[hold] = abs(body.state.speed) + abs(body.state.turn_rate)
    assert ends[True] < 2 * 1e-6 / 2.0 * 0.1  # standstill: 1e-6 rad/s at the motor's axis
    assert ends[False] > 1e-5


def test_hold_leaves_motion_as_it_is() -> None:
    """Far from standstill friction is the same with it."""
    motor = dc_motor()
    for speed in (1.0, -3.0, 8.0):
        assert lib.motor_dc_torque(motor, 4.0, speed, 10.0) == lib.motor_dc_torque(motor, 4.0, speed, 0.0)


# ---- continuous rotation --------------------------------------------------------------------------------------


class Servo:
    """The left servo of the shieldbot, nominal, with changes."""

    def __init__(self, dt: float = 0.001, **changes: float) -> None:
        robot = load_robot("shieldbot")
        device: Any = robot.device["servo_left"]
        self.p = servo_model.servo_parameters(device, robot.body, 0, imperfections.Draw(1, noise=False))
        for name, value in changes.items():
            setattr(self.p, name, value)
        self.state = ffi.new("servo_motor *")
        self.dt = dt
        lib.servo_motor_init(self.p, self.state, dt)

    def torque(self, speed: float, supply: float = 1.0) -> float:
        return float(lib.servo_motor_torque(self.p, self.state, speed, supply))


def test_servo_free_wheels_before_and_after_its_pulses() -> None:
    servo = Servo()
    assert servo.torque(0.1) == pytest.approx(-0.3 * 0.1)
    assert lib.servo_motor_pulse(servo.p, servo.state, 1700.0) == 1
    torques = [servo.torque(0.0) for _ in range(120)]
    driving = [torque > 0 for torque in torques]
    assert all(driving[:50]) and not any(driving[52:])


def test_servo_takes_only_pulses_that_servos_take() -> None:
    servo = Servo()
    for width in (0.0, 499.0, 2501.0, math.nan, math.inf):
        assert lib.servo_motor_pulse(servo.p, servo.state, width) == 0
    assert servo.state.age_s < 0


def test_servo_lag_is_exponential_at_any_step() -> None:
    """v(t) = v_target (1 - exp(-t / lag)), whatever the step."""
    for dt in (0.0005, 0.001, 0.01):
        servo = Servo(dt)
        lib.servo_motor_pulse(servo.p, servo.state, 1700.0)
        for _ in range(round(0.04 / dt)):
            servo.torque(0.0)
        top = 51.25 * math.tanh(200 / 78.5) * 2 * math.pi / 60 * servo.p.wheel_radius
        assert servo.state.reference == pytest.approx(top * (1 - math.exp(-0.04 / servo.p.lag_s)), rel=1e-9)


def test_servo_scales_with_its_supply() -> None:
    servo = Servo(lag_s=0.0)
    lib.servo_motor_init(servo.p, servo.state, 0.001)
    lib.servo_motor_pulse(servo.p, servo.state, 1700.0)
    servo.torque(0.0, 0.6)
    weak = servo.state.reference
    servo.torque(0.0, 1.0)
    assert weak == pytest.approx(0.6 * servo.state.reference)
    assert servo.torque(-5.0, 0.6) == pytest.approx(0.6 * servo.p.motor.torque_maximum_n_m)


@pytest.mark.parametrize("signal", [-2.0, -1.0, -0.3, 0.0, 0.04, 0.5, 1.0, 7.0])
def test_servo_by_signal_is_the_pulse_of_the_notes(signal: float) -> None:
    """t_L = 1500 + 200 s, t_R = 1500 - 200 s, both forward for s > 0; the dead band swallows |s| < 0.05."""
    for mount in (1.0, -1.0):
        servo = Servo(mount=mount)
        pulse = lib.servo_motor_pulse_of(servo.p, signal)
        s = min(max(signal, -1.0), 1.0)
        assert pulse == pytest.approx(1500 + mount * 200 * s)
        speed = lib.servo_motor_curve(servo.p, pulse)
        assert (speed > 0, speed < 0) == (s > 0.05, s < -0.05)


def test_servo_robot_against_an_integrator() -> None:
    """Pulse to speed: lag, regulated motor, body; a reversal at 0.5 s."""
    servos = [Servo(), Servo()]
    p, top = BOE_BOT, lib.servo_motor_curve(servos[0].p, 1600.0)
    gain, lag = servos[0].p.motor.gain_n_s, servos[0].p.lag_s
    a = lib.body_a(ffi.new("body_parameters *", BOE_BOT))

    def rates(t: float, state: Any) -> list[float]:
        speed, reference = state
        target = top if t < 0.5 else lib.servo_motor_curve(servos[0].p, 1400.0)
        torque = min(max(gain * (reference - speed), -0.268), 0.268)
        return [(2 * a * torque - p["linear_damping"] * speed) / p["mass"], (target - reference) / lag]

    truth = solve_ivp(rates, (0, 1.0), [0, 0], rtol=1e-9, atol=1e-12, max_step=1e-3, t_eval=[0.05, 0.5, 0.55, 1.0]).y
    body = Body()
    found = []
    for step in range(1000):
        if step % 20 == 0:
            for servo in servos:
                lib.servo_motor_pulse(servo.p, servo.state, 1600.0 if step < 500 else 1400.0)
        body.advance(servos[0].torque(body.state.rim_left), servos[1].torque(body.state.rim_right))
        if step + 1 in (50, 500, 550, 1000):
            found.append(body.state.speed)
    assert found == pytest.approx(list(truth[0]), abs=0.003)


# ---- position servo ---------------------------------------------------------------------------------------------


def turret(**changes: float) -> tuple[Any, Any]:
    parameters = ffi.new("motor_position_parameters *")
    lib.motor_position_default(parameters)
    for name, value in changes.items():
        setattr(parameters, name, value)
    state = ffi.new("motor_position *")
    lib.motor_position_init(state, 0.0)
    return parameters, state


def test_position_servo_goes_to_the_angle_of_its_pulse() -> None:
    """1.5 ms + 0.5 ms per 45 degrees; stops at its range; back and forth between angle and pulse."""
    p, state = turret()
    for pulse, degrees in ((2000, 45), (1000, -45), (1500, 0), (2500, 90), (500, -90)):
        assert lib.motor_position_angle_of(p, pulse) == pytest.approx(math.radians(degrees))
        assert lib.motor_position_pulse_of(p, math.radians(degrees)) == pytest.approx(pulse)
        for step in range(2000):
            if step % 20 == 0:
                assert lib.motor_position_pulse(p, state, pulse) == 1
            lib.motor_position_step(p, state, 1.0, 0.001)
        assert state.angle == pytest.approx(math.radians(degrees), abs=p.dead_band_us / p.us_per_rad + 1e-9)
    assert lib.motor_position_pulse(p, state, 300.0) == 0
    p.range_rad = 0.5
    assert lib.motor_position_angle_of(p, 2400) == 0.5


@given(st.floats(500, 2500), st.floats(1e-4, 0.5), st.integers(1, 50))
def test_position_servo_is_exact_at_any_step(pulse: float, dt: float, parts: int) -> None:
    """Rate-limited line, then exponential: one step or many come to the same angle, as an integrator does."""
    p, state = turret(dead_band_us=0.0)
    _, other = turret()
    for one in (state, other):
        lib.motor_position_pulse(p, one, pulse)
    lib.motor_position_step(p, state, 1.0, dt)
    for _ in range(parts):
        other.age_s = 0.0
        lib.motor_position_step(p, other, 1.0, dt / parts)
    assert other.angle == pytest.approx(state.angle, abs=1e-9)
    target = lib.motor_position_angle_of(p, pulse)

    def rate(t: float, angle: Any) -> Any:
        return np.clip(20.0 * (target - angle), -5.0, 5.0)

    truth = solve_ivp(rate, (0, dt), [0.0], rtol=1e-10, atol=1e-12, max_step=dt / 100).y[0, -1]
    assert state.angle == pytest.approx(truth, abs=1e-5)


def test_position_servo_without_pulses_holds_and_with_less_supply_is_slower() -> None:
    p, state = turret()
    lib.motor_position_step(p, state, 1.0, 0.1)
    assert state.angle == 0.0
    lib.motor_position_pulse(p, state, 2000.0)
    lib.motor_position_step(p, state, 0.5, 0.05)
    assert state.angle == pytest.approx(0.5 * 5.0 * 0.05)
    for _ in range(10):
        lib.motor_position_step(p, state, 1.0, 0.01)
    held = state.angle
    lib.motor_position_step(p, state, 1.0, 0.1)
    assert state.angle == held < math.radians(45)
