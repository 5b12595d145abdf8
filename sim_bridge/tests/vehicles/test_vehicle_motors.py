"""Drives of vehicles without boards: the full DC motor, the regulated motor (3.15), servos; motors by themselves.

Truth: scipy's integrator on the electrical and mechanical equations (1.1)-(1.10), (2.31), (2.32), and closed forms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from boebot.arenas import load_arena
from boebot.errors import RobotError
from boebot_course.motor import DCMotor, PositionServo, RegulatedMotor, ServoMotor
from sim_bridge.tests.simulated import arena_of
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel
from sim_bridge.vehicles.model_file import vehicle_model

BODY = ARSIM_BODY | {"wheel_mass": 0.1, "wheel_inertia": 2e-4, "grip": 10.0}
Phases = Sequence[tuple[float, float]]


def driven(dt: float, motor: dict[str, float], full: bool = True) -> VehicleModel:
    model = VehicleModel(BODY, dt=dt)
    model.dc_motors(motor, motor, full=full)
    return model


# ---- the full DC motor -----------------------------------------------------------------------------------------------

NOTES = {
    "torque_constant": 0.0333, "emf_constant": 0.0333, "resistance_ohm": 0.62, "inductance_h": 0.2e-3,
    "coulomb_n_m": 0.008, "viscous_n_m_s": 0.02, "gear": 2.0, "efficiency": 0.9,
}  # fmt: skip
SLOW = NOTES | {"inductance_h": 0.05}  # L/R = 81 ms
RINGING = SLOW | {"torque_constant": 0.2, "emf_constant": 0.2, "viscous_n_m_s": 0.002}  # emf and L swing together
PHASES: Phases = ((0.5, 0.6), (0.35, 0.6), (0.65, 0.45))  # of half a second each; no wheel stops meanwhile
PHASE_S = 0.5


class FullEquations:
    """Both motors' (1.1)-(1.10) with (2.31), (2.32): currents, speed, turn rate, pose as scipy integrates them."""

    def __init__(self, motor: dict[str, float]) -> None:
        self.m = motor
        model = VehicleModel(BODY)
        self.a, self.b = model.a, model.b

    def rates(self, t: float, state: Any, signals: tuple[float, float]) -> list[float]:
        m, r, half = self.m, BODY["wheel_radius"], BODY["half_track"]
        currents, speed, turn_rate, heading = state[:2], state[2], state[3], state[4]
        di, torques = [], []
        for current, rim, signal in zip(
            currents, (speed - half * turn_rate, speed + half * turn_rate), signals, strict=True
        ):
            axis = m["gear"] * rim / r
            di.append((12.0 * signal - m["resistance_ohm"] * current - m["emf_constant"] * axis) / m["inductance_h"])
            friction = m["coulomb_n_m"] * math.copysign(1, axis) + m["viscous_n_m_s"] * axis
            torques.append(m["gear"] * m["efficiency"] * (m["torque_constant"] * current - friction))
        dv = (self.a * sum(torques) - BODY["linear_damping"] * speed) / BODY["mass"]
        dw = (self.b * (torques[1] - torques[0]) - BODY["angular_damping"] * turn_rate) / BODY["inertia"]
        return [*di, dv, dw, turn_rate, speed * math.cos(heading), speed * math.sin(heading)]

    def run(self, start: Sequence[float]) -> Any:
        """States at 1000 instants of the phases, shape (7, 1000 x phases)."""
        pieces, state = [], np.array(start, dtype=float)
        for signals in PHASES:
            times = np.linspace(0, PHASE_S, 1000)
            done = solve_ivp(
                self.rates, (0, PHASE_S), state, "LSODA", times, args=(signals,), rtol=1e-10, atol=1e-12, max_step=0.01
            )
            assert done.success
            pieces.append(done.y)
            state = done.y[:, -1]
        return np.hstack(pieces)

    def rate(self) -> tuple[float, float]:
        """Linearised rates (1/s) of speed and turn rate with settled currents, as in vehicle_model_euler_limit."""
        m, r, half = self.m, BODY["wheel_radius"], BODY["half_track"]
        motor = m["torque_constant"] * m["emf_constant"] / m["resistance_ohm"] + m["viscous_n_m_s"]
        slope = m["gear"] ** 2 * m["efficiency"] * motor
        along = (2 * self.a * slope / r + BODY["linear_damping"]) / BODY["mass"]
        around = (2 * self.b * slope * half / r + BODY["angular_damping"]) / BODY["inertia"]
        return along, around


def simulated(motor: dict[str, float], dt: float) -> Any:
    """The same state at the end of the phases, as the vehicle has it."""
    vehicle = Vehicle(driven(dt, motor | {"torque_maximum_n_m": 100.0}), arena_of())
    vehicle.place((0, 0, 0.3), speed=0.3)
    for left, right in PHASES:
        for _ in range(round(PHASE_S / dt)):
            vehicle.step(left, right)
    x, y, heading = vehicle.true_pose
    return np.array([*vehicle.currents, vehicle.body.speed, vehicle.body.turn_rate, heading, x, y])


@pytest.mark.parametrize("motor", [NOTES, SLOW, RINGING], ids=["notes", "slow", "ringing"])
def test_full_motor_is_scipys_solution_of_all_equations(motor: dict[str, float]) -> None:
    """Within the bound of its one approximation, and with an error that halves with the step.

    The speed stands still within a step. Against the true solution that shifts the torque's driving terms by at most
    rate * (change of the speed in that step), for one step by the speed itself and, through the current, for as long
    as that remembers it. So a step adds at most 2 rate dt (change), all steps 2 rate dt (total variation of the speed).
    """
    equations = FullEquations(motor)
    truth = equations.run([0, 0, 0.3, 0.0, 0.3, 0, 0])
    rims = truth[2] - BODY["half_track"] * np.abs(truth[3])
    assert rims.min() > 0.02, "friction keeps its sign, as the equations here need"
    end = truth[:, -1]
    errors = [np.abs(simulated(motor, dt) - end) for dt in (0.01, 0.005, 0.0025)]
    for state, rate in zip((2, 3), equations.rate(), strict=True):
        variation = np.abs(np.diff(truth[state])).sum()
        assert errors[0][state] <= 2 * rate * 0.01 * variation
        assert abs(end[state]) > 0.05 and errors[2][state] < 0.01 * max(abs(end[state]), 0.2)
    for state in (4, 5, 6):  # integrals of them: first order, and small
        assert errors[2][state] < 0.01
    totals = [float(np.abs(error[2:]).sum()) for error in errors]
    assert 0.4 < totals[1] / totals[0] < 0.6 and 0.4 < totals[2] / totals[1] < 0.6
    assert errors[2][:2] == pytest.approx([0, 0], abs=0.02 * np.abs(truth[:2]).max())


@given(
    inductance=st.floats(-9, 4).map(lambda power: 10.0**power),
    share=st.floats(0.05, 0.999),
    emf=st.floats(0.001, 0.5),
    viscous=st.sampled_from([0.0, 1e-4, 0.02]),
    around=st.booleans(),
)
def test_full_motor_is_stable_wherever_the_quasi_static_one_is(
    inductance: float, share: float, emf: float, viscous: float, around: bool
) -> None:
    """For any inductance: motor_dc.h shows that both eigenvalues of a step lie within the unit circle."""
    motor = {"torque_constant": emf, "emf_constant": emf, "viscous_n_m_s": viscous, "coulomb_n_m": 0.0}
    motor |= {"torque_maximum_n_m": 1e9, "inductance_h": inductance}
    limit = driven(1e-9, motor).euler_limit
    vehicle = Vehicle(driven(share * limit, motor), arena_of())
    vehicle.place((0, 0, 0), speed=0.0 if around else 1.0, turn_rate=1.0 if around else 0.0)
    highest = []
    for _ in range(20):
        speeds = []
        for _ in range(50):
            vehicle.step(0.0, 0.0)
            speeds.append(abs(vehicle.body.turn_rate if around else vehicle.body.speed))
        highest.append(max(speeds))
    assert highest[0] < 3.0 and highest[-1] <= highest[0] * (1 + 1e-9)
    with pytest.raises(RobotError, match="Euler limit"):
        driven(1.001 * limit, motor)


def test_without_inductance_full_and_quasi_static_are_one() -> None:
    a, b = (Vehicle(driven(0.01, {"inductance_h": 0.0}, full), arena_of()) for full in (True, False))
    for step in range(200):
        for vehicle in (a, b):
            vehicle.step(0.5 + 0.4 * math.sin(step / 20), 0.6)
        assert a.true_pose == b.true_pose


def test_current_of_a_full_motor_rises_with_its_time_constant_and_that_of_the_other_at_once() -> None:
    """At standstill (1.1) gives i = V/R (1 - exp(-t R/L)); a heavy body does not move meanwhile."""
    heavy = ARSIM_BODY | {"mass": 1e9, "inertia": 1e9}
    vehicles = []
    for full in (True, False):
        model = VehicleModel(heavy)
        model.dc_motors({"inductance_h": 0.05}, {"inductance_h": 0.05}, full=full)
        vehicles.append(Vehicle(model, arena_of()))
    assert vehicles[0].currents == (0.0, 0.0)
    for step in range(1, 60):
        for vehicle in vehicles:
            vehicle.step(0.5, -0.25)
        risen = 1 - math.exp(-0.01 * step * 0.62 / 0.05)
        assert vehicles[0].currents == pytest.approx((6 / 0.62 * risen, -3 / 0.62 * risen), rel=1e-6)
        assert vehicles[1].currents == pytest.approx((6 / 0.62, -3 / 0.62), rel=1e-6)


def test_compass_is_disturbed_by_the_current_that_flows() -> None:
    """Fields of (1, 0) and 0.1 per ampere across it: the reading follows the slow current, not its settled value."""
    model = driven(0.01, {"inductance_h": 0.5})
    model.sensor("compass", "compass", current_y=0.1)
    vehicle = Vehicle(model, arena_of())
    for _ in range(30):
        vehicle.step(0.4, 0.4)
        flowing = sum(map(abs, vehicle.currents))
        assert vehicle["compass"] == pytest.approx(math.atan2(-0.1 * flowing, 1.0), abs=1e-9)
    assert 0 < flowing < 0.5 * 2 * 4.8 / 0.62


def test_the_hash_carries_the_current() -> None:
    quiet = Vehicle(driven(0.01, SLOW), load_arena("arsim"), seed=3)
    before = quiet.hash()
    quiet.step(0.001, 0.001)  # Coulomb friction holds it: nothing but time, signals and current is new
    other = Vehicle(driven(0.01, SLOW | {"inductance_h": 0.06}), load_arena("arsim"), seed=3)
    other.step(0.001, 0.001)
    assert quiet.true_pose == other.true_pose and quiet.hash() not in (before, other.hash())


# ---- the regulated motor ---------------------------------------------------------------------------------------------


def regulated(gain: float = 10.0, dt: float = 0.01, torque: float = 100.0, speed: float = 0.3) -> VehicleModel:
    model = VehicleModel(ARSIM_BODY, dt=dt)
    motor = {"gain_n_s": gain, "torque_maximum_n_m": torque, "speed_maximum_m_s": speed}
    model.regulated_motors(motor, motor)
    return model


@pytest.mark.parametrize(("gain", "steady"), [(0.5, 0.2727), (2.0, 0.2927), (10.0, 0.2985)])
def test_e03_vehicle_with_regulated_motors(gain: float, steady: float) -> None:
    """V_k = V_ss (1 - (1 - dt (2AK + alpha)/M)^k) in every Euler step; V_ss = V_ref 2AK/(2AK + alpha)."""
    model = regulated(gain)
    vehicle = Vehicle(model, arena_of())
    pull = 2 * model.a * gain
    rate, end = (pull + 1.0) / 3.0, 0.3 * pull / (pull + 1.0)
    assert end == pytest.approx(steady, abs=5e-5)
    for step in range(1, 800):
        vehicle.step(1.0, 1.0)
        assert vehicle.body.speed == pytest.approx(end * (1 - (1 - 0.01 * rate) ** step), rel=1e-12)
    assert vehicle.body.speed == pytest.approx(steady, abs=1e-3)


def test_e03_step_of_regulated_motors_is_limited() -> None:
    """K = 10: 2M/(2AK + alpha) = 0.030 s straight on, the lesser of the two limits."""
    assert regulated().euler_limit == pytest.approx(6 / 201, rel=1e-12)
    Vehicle(regulated(dt=0.0298), arena_of())
    with pytest.raises(RobotError, match=r"dt = 0\.031 s; expected less than 0\.02985 s, the Euler limit"):
        regulated(dt=0.031)


def test_limited_regulated_motors_against_an_integrator() -> None:
    """(3.15) with its limit, (2.31), (2.32): from rest to a curve, then reversed; errors go with the step."""
    gain, most, a, b = 10.0, 0.15, regulated().a, regulated().b

    def rates(t: float, state: Any) -> list[float]:
        speed, turn_rate, heading = state[:3]
        wanted = (0.3, 0.15) if t < 1.0 else (-0.15, 0.3)
        rims = (speed - 0.2 * turn_rate, speed + 0.2 * turn_rate)
        left, right = (min(max(gain * (v - rim), -most), most) for v, rim in zip(wanted, rims, strict=True))
        dv = (a * (left + right) - 1.0 * speed) / 3.0
        dw = (b * (right - left) - 0.1 * turn_rate) / 0.2
        return [dv, dw, turn_rate, speed * math.cos(heading), speed * math.sin(heading)]

    truth = solve_ivp(rates, (0, 2), [0.0] * 5, max_step=1e-3, rtol=1e-8, atol=1e-10).y[:, -1]
    errors = []
    for dt in (0.01, 0.005, 0.0025):
        vehicle = Vehicle(regulated(gain, dt, most), arena_of())
        for step in range(round(2 / dt)):
            vehicle.step(*((1.0, 0.5) if step * dt < 1 - 1e-9 else (-0.5, 1.0)))
        x, y, heading = vehicle.true_pose
        errors.append(np.abs(np.array([vehicle.body.speed, vehicle.body.turn_rate, heading, x, y]) - truth))
    assert errors[0].max() < 0.02 and errors[2].max() < 0.3 * errors[0].max()
    assert truth[0] == pytest.approx(0.075, abs=0.01), "close to its reference by then"


def test_signal_of_a_regulated_motor_is_a_share_of_its_speed_and_0_brakes() -> None:
    vehicle = Vehicle(regulated(), arena_of())
    vehicle.place((0, 0, 0), speed=0.5)
    for _ in range(300):
        vehicle.step(0.0, 0.0)
    assert abs(vehicle.body.speed) < 1e-9 and vehicle.currents == (0.0, 0.0)
    motor = RegulatedMotor(gain_n_s=2.0, torque_maximum_n_m=0.3, speed_maximum_m_s=0.4)
    assert [motor.reference(s) for s in (-3, -0.5, 1)] == [-0.4, -0.2, 0.4]
    assert motor.torque(0.4, 0.3) == pytest.approx(2.0 * 0.1) and motor.torque(0.4, -1.0) == 0.3
    assert motor.torque(-0.4, 1.0) == -0.3


# ---- robots' files ---------------------------------------------------------------------------------------------------


def variant(folder: Path, text: str) -> Path:
    path = folder / "variant.toml"
    path.write_text(f'extends = "arsim"\n{text}\n')
    return path


def test_a_file_says_full_and_regulated(tmp_path: Path) -> None:
    slow = "inductance_h = 0.05\nfull = true"
    file = variant(tmp_path, f"[device.motor_left]\n{slow}\n[device.motor_right]\n{slow}")
    by_file = Vehicle(vehicle_model(file), arena_of())
    model = VehicleModel(ARSIM_BODY)
    model.dc_motors({"inductance_h": 0.05}, {"inductance_h": 0.05}, full=True)
    by_hand = Vehicle(model, arena_of())
    for vehicle in (by_file, by_hand):
        for _ in range(100):
            vehicle.step(0.5, 0.8)
    assert by_file.true_pose == by_hand.true_pose and by_file.currents == by_hand.currents

    motor = 'type = "regulated_motor"\ngain_n_s = 2.0'
    file = variant(
        tmp_path, f"[body]\nwheel_speed_maximum_m_s = 0.3\n[device.motor_left]\n{motor}\n[device.motor_right]\n{motor}"
    )
    vehicle = Vehicle(vehicle_model(file), arena_of())
    for _ in range(800):
        vehicle.step(1.0, 1.0)
    assert vehicle.body.speed == pytest.approx(0.2927, abs=1e-4)


def test_one_motor_full_and_the_other_not(tmp_path: Path) -> None:
    file = variant(tmp_path, "[device.motor_left]\ninductance_h = 0.5\nfull = true")
    vehicle = Vehicle(vehicle_model(file), arena_of())
    vehicle.step(0.5, 0.5)
    left, right = vehicle.currents
    assert left < 0.1 * right and right == pytest.approx(6 / 0.62, rel=1e-2)


def test_motors_of_two_types_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"motor_right is regulated_motor, device\.motor_left dc_motor"):
        vehicle_model(variant(tmp_path, '[device.motor_right]\ntype = "regulated_motor"'))


# ---- motors by themselves --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("volts", "load", "expected"), [(6.0, 0.0, 14.423), (12.0, 0.1, 24.624)])
def test_e01_by_the_python_face(volts: float, load: float, expected: float) -> None:
    """L 0.2 mH, I 5e-5 kg m^2, no gear: within 0.1 % of the steady formula, whose current is that of (1.1) at rest."""
    motor, current, speed, dt = DCMotor(gear=1.0), 0.0, 0.0, 2e-5
    for _ in range(10_000):
        torque, current = motor.step(volts, speed, current, dt)
        speed += dt / 5e-5 * (torque - load)
    formula = (0.0333 * volts / 0.62 - 0.008 - load) / (0.0333**2 / 0.62 + 0.02)
    assert formula == pytest.approx(expected, abs=1e-3) and speed == pytest.approx(formula, rel=1e-3)
    assert current == pytest.approx(motor.current(volts, speed), rel=1e-6)


def test_position_servo_turns_as_an_integrator_says() -> None:
    """d(alpha)/dt = clamp(K_s (alpha_ref - alpha), +-omega_s), K_s 20 1/s, 5 rad/s (the kit's own)."""
    servo = PositionServo(dead_band_us=0.0)
    assert servo.pulse_of(math.pi / 4) == pytest.approx(2000.0)
    target, truth = -0.9, 0.0
    for _ in range(30):
        servo.pulse(servo.pulse_of(target))
        servo.step(0.02)
        rate = solve_ivp(
            lambda t, a: np.clip(20 * (target - a), -5, 5), (0, 0.02), [truth], rtol=1e-9, atol=1e-11, max_step=1e-3
        )
        truth = rate.y[0, -1]
        assert servo.angle == pytest.approx(truth, abs=1e-5)
    assert servo.angle == pytest.approx(target, abs=1e-3)
    with pytest.raises(RobotError, match="pulse_us is 400; expected a number from 500 to 2500"):
        servo.pulse(400)
    with pytest.raises(RobotError, match="dt is 0; expected a number more than 0"):
        servo.step(0)


def test_servo_motor_by_itself_is_the_published_curve() -> None:
    left, right = ServoMotor(), ServoMotor(mount=-1)
    assert left.pulse(0.5) == 1600 and right.pulse(0.5) == 1400
    top = 51.25 * 2 * math.pi / 60 * 0.0331
    for servo in (left, right):
        assert servo.speed(servo.pulse(0.5)) == pytest.approx(top * math.tanh(100 / 78.5))
    assert left.speed(1508) == 0.0


@pytest.mark.parametrize("value", [math.nan, math.inf, "x", None])
def test_motors_take_no_numbers_that_are_none(value: Any) -> None:
    motor, drive, servo = DCMotor(), RegulatedMotor(), ServoMotor()
    for ask in (
        lambda: motor.voltage(value), lambda: motor.torque(value, 0.0), lambda: motor.torque(0.0, value),
        lambda: motor.current(1.0, value), lambda: motor.step(1, 1, value, 0.01), lambda: motor.step(1, 1, 1, value),
        lambda: drive.reference(value), lambda: drive.torque(value, 0), lambda: servo.pulse(value),
        lambda: servo.speed(value), lambda: PositionServo(value), lambda: DCMotor(gear=value),
    ):  # fmt: skip
        with pytest.raises(RobotError, match=r" is .*; expected a (finite )?number"):
            ask()


def test_motors_refuse_what_no_motor_is() -> None:
    for build, what in (
        (lambda: DCMotor(resistance_ohm=0), "motor: resistance_ohm is 0; expected a number more than 0"),
        (lambda: DCMotor(efficiency=1.2), "efficiency is 1.2; expected a number more than 0 up to 1"),
        (lambda: RegulatedMotor(gain_n_s=-1), "gain_n_s is -1; expected a number more than 0"),
        (lambda: RegulatedMotor(coast_n_s=1), "there is no key 'coast_n_s'; expected gain_n_s, torque_maximum_n_m"),
        (lambda: ServoMotor(mount=2), "mount is 2; expected 1 or -1"),
        (lambda: ServoMotor(motor={"gain": 1}), "servo: motor: there is no key 'gain'; expected gain_n_s"),
        (lambda: PositionServo(range_rad=0), "range_rad is 0; expected a number more than 0"),
    ):
        with pytest.raises(RobotError, match=what):
            build()
