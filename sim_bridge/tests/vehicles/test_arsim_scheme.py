"""ARSim's own scheme (`scheme = "arsim"`) against a second implementation of its step, and the kit's against the same.

Truth: `run` below, the step of the notes (sections 1.2.3, 2.2, 3.2.4, 3.2.6; appendix A) in Python, with what ARSim 1.2
has of its own as arguments.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import boebot
from boebot.arenas import Arena
from boebot.description.robots import load_robot
from sim_bridge.batch import Batch
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import Vehicle
from sim_bridge.vehicles.model import VehicleModel
from sim_bridge.vehicles.model_file import vehicle_model

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

DT = 0.01
M, INERTIA, R, WHEEL = 3.0, 0.2, 0.2, 0.1
VOLTS, C_T, C_E, OHM, COULOMB, VISCOUS, GEAR, MOST = 12.0, 0.0333, 0.0333, 0.62, 0.008, 0.02, 2.0, 1.0
ROOM: Arena = arena_of(outline=square(0, 0, 60))

Signals = Callable[[float], tuple[float, float]]


@dataclasses.dataclass(frozen=True)
class Scheme:
    """What the two differ in."""

    axis_half_track: float
    alpha: float
    beta: float
    share: float  # of a step's turn that the odometer makes before its travel is laid off


SCHEMES = {"arsim": Scheme(R, 1.0, 0.1, 0.5), "arsim-1.2": Scheme(R / 2, 15.0, 0.78, 1.0)}


def torque(signal: float, axis: float) -> float:
    """(1.8)-(1.10) with friction at rest, efficiency 1, at the wheel."""
    shaft = GEAR * axis
    generated = C_T * (signal * VOLTS - C_E * shaft) / OHM
    if abs(shaft) < 1e-6:
        driving = 0.0 if abs(generated) < COULOMB else generated - math.copysign(COULOMB, generated)
    else:
        driving = generated - math.copysign(COULOMB, shaft) - VISCOUS * shaft
    return max(-MOST, min(MOST, GEAR * driving))


def run(scheme: Scheme, signals: Signals, steps: int) -> NDArray[np.float64]:
    """x, y, heading, V, turn rate, odometer's x, y, heading after each step; A = 1 / r, B = R / r."""
    rows = []
    x = y = heading = speed = rate = ghost_x = ghost_y = ghost_heading = axis_left = axis_right = 0.0
    for step in range(steps):
        s_left, s_right = signals(step * DT)
        left, right = torque(s_left, axis_left), torque(s_right, axis_right)
        speed, rate = (
            speed + DT * ((left + right) / WHEEL - scheme.alpha * speed) / M,  # (2.31), (3.16)
            rate + DT * (R / WHEEL * (right - left) - scheme.beta * rate) / INERTIA,  # (2.32), (3.17)
        )
        heading += rate * DT
        x += speed * math.cos(heading) * DT
        y += speed * math.sin(heading) * DT
        before = axis_left, axis_right
        axis_left = (speed - scheme.axis_half_track * rate) / WHEEL  # UpdateMotorAxisAngularSpeed
        axis_right = (speed + scheme.axis_half_track * rate) / WHEEL
        assert all(a * b >= 0 for a, b in zip(before, (axis_left, axis_right), strict=True)), "no axis turns round"
        d_left, d_right = (speed - R * rate) * DT, (speed + R * rate) * DT  # GetOdometerReading
        turn = (d_right - d_left) / (2 * R)
        ghost_x += (d_left + d_right) / 2 * math.cos(ghost_heading + scheme.share * turn)
        ghost_y += (d_left + d_right) / 2 * math.sin(ghost_heading + scheme.share * turn)
        ghost_heading += turn
        rows.append((x, y, heading, speed, rate, ghost_x, ghost_y, ghost_heading))
    return np.array(rows)


DRIVES: dict[str, Signals] = {
    "straight": lambda t: (0.5, 0.5),
    "full": lambda t: (1.0, 1.0),
    "turn": lambda t: (-0.7, 0.7),
    "curves": lambda t: (0.5 + 0.2 * math.sin(t), 0.5 + 0.2 * math.cos(0.7 * t)),
}


def wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.arctan2(np.sin(angle), np.cos(angle))


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("robot", SCHEMES)
def test_20_s_are_those_of_the_second_implementation(robot: str, drive: str) -> None:
    """To 1e-9 m, rad, m/s and rad/s in each of 2000 steps; one vehicle alone and worlds side by side."""
    expected = run(SCHEMES[robot], DRIVES[drive], 2000)
    model = vehicle_model(robot, noise=False)
    vehicle = Vehicle(model, ROOM)
    batch = Batch(vehicle_model(robot, noise=False), ROOM, np.zeros((16, 3)), np.arange(16))
    rows, far = [], []
    for step in range(2000):
        signals = DRIVES[drive](step * DT)
        vehicle.step(*signals)
        batch.step(np.tile(signals, (16, 1)))
        rows.append((*vehicle.true_pose, vehicle.body.speed, vehicle.body.turn_rate, *vehicle["odometer"]))
        far.append(batch.true_poses[11])
    found = np.array(rows)
    found[:, (2, 7)] = wrapped(found[:, (2, 7)] - expected[:, (2, 7)]) + expected[:, (2, 7)]
    assert found == pytest.approx(expected, abs=1e-9, rel=0)
    assert np.array_equal(np.array(far), np.array(rows)[:, :3])


def test_each_difference_is_seen() -> None:
    """The comparison above tells the schemes apart by each of the four: far more than its 1e-9."""
    kit, own = SCHEMES.values()
    usual = run(kit, DRIVES["curves"], 2000)
    for field in dataclasses.fields(Scheme):
        changed = dataclasses.replace(kit, **{field.name: getattr(own, field.name)})
        assert np.abs(run(changed, DRIVES["curves"], 2000) - usual).max() > 1e-4, field.name


@pytest.mark.parametrize(("robot", "speed"), [("arsim", 1.381), ("arsim-1.2", 0.785)])
def test_greatest_speed_of_the_file_is_that_of_motor_signal_1(robot: str, speed: float) -> None:
    """2 tau / r = alpha V with the torque of (1.8)-(1.10) at V / r."""
    alpha = SCHEMES[robot].alpha
    stall = GEAR * (C_T / OHM * VOLTS - COULOMB)
    per_speed = GEAR**2 * (C_T * C_E / OHM + VISCOUS) / WHEEL
    assert 2 * stall / WHEEL / (alpha + 2 * per_speed / WHEEL) == pytest.approx(speed, abs=5e-4)
    assert load_robot(robot).body.wheel_speed_maximum_m_s == speed


def test_motors_of_every_kind_see_half_of_r(tmp_path: Path) -> None:
    """Placed at 0.3 m/s and 1 rad/s, their axes turn as at 0.2 and 0.4 m/s."""
    vehicle = Vehicle(vehicle_model("arsim-1.2", noise=False), ROOM)
    vehicle.place((0, 0, 0), speed=0.3, turn_rate=1.0)
    currents = [-C_E * GEAR * v / WHEEL / OHM for v in (0.2, 0.4)]  # (1.8) without volts
    assert vehicle.currents == pytest.approx(currents, rel=1e-12)
    file = tmp_path / "regulated.toml"
    motor = 'type = "regulated_motor"\ngain_n_s = 0.5\n'
    file.write_text(f'extends = "arsim-1.2"\n[device.motor_left]\n{motor}[device.motor_right]\n{motor}')
    regulated = Vehicle(vehicle_model(file, noise=False), ROOM)
    regulated.place((0, 0, 0), speed=0.3, turn_rate=1.0)
    regulated.step(0.0, 0.0)
    left, right = -0.5 * 0.2, -0.5 * 0.4  # (3.15)
    assert regulated.body.speed == pytest.approx(0.3 + DT * ((left + right) / WHEEL - 15.0 * 0.3) / M, rel=1e-12)
    turned = 1.0 + DT * (R / WHEEL * (right - left) - 0.78) / INERTIA
    assert regulated.body.turn_rate == pytest.approx(turned, rel=1e-12)


def test_full_motors_without_inductance_go_the_same_way(tmp_path: Path) -> None:
    file = tmp_path / "full.toml"
    motor = 'type = "dc_motor"\nfull = true\ninductance_h = 0.0\n'
    file.write_text(f'extends = "arsim-1.2"\n[device.motor_left]\n{motor}[device.motor_right]\n{motor}')
    vehicle = Vehicle(vehicle_model(file, noise=False), ROOM)
    expected = run(SCHEMES["arsim-1.2"], DRIVES["curves"], 500)[-1]
    for step in range(500):
        vehicle.step(*DRIVES["curves"](step * DT))
    assert vehicle.true_pose == pytest.approx(tuple(expected[:3]), abs=1e-9)


def test_euler_limit_is_that_of_the_linearised_rates() -> None:
    per_rad = GEAR**2 * (C_T * C_E / OHM + VISCOUS)
    along = (2 / WHEEL * per_rad / WHEEL + 15.0) / M
    around = (2 * R / WHEEL * per_rad * (R / 2) / WHEEL + 0.78) / INERTIA
    assert vehicle_model("arsim-1.2").euler_limit == pytest.approx(2 / max(along, around), rel=1e-12)
    slow = {"mass": 300.0, "inertia": INERTIA, "radius": R, "half_track": R, "wheel_radius": WHEEL}
    slow |= {"wheel_mass": 0.0, "wheel_inertia": 0.0, "linear_damping": 0.0, "angular_damping": 0.78, "grip": 0.7}
    model = VehicleModel(slow | {"axis_half_track": R / 2})  # turning is the faster one
    model.dc_motors()
    assert model.euler_limit == pytest.approx(2 / around, rel=1e-12)


def test_a_run_is_the_vehicles() -> None:
    """`boebot run --robot arsim-1.2` drives what a script does."""
    signals = DRIVES["curves"]
    result = boebot.run(
        lambda robot: robot.drive(*signals(robot.time)),
        robot="arsim-1.2",
        arena="empty",
        seconds=3,
        period=DT,
        pose=(0.0, 0.0, 0.0),
    )
    assert result.error is None and result.truth is not None
    found = np.array([result.truth.x, result.truth.y, result.truth.heading]).T[1:]
    assert found == pytest.approx(run(SCHEMES["arsim-1.2"], signals, 300)[:, :3], abs=1e-9, rel=0)


# ---- files -----------------------------------------------------------------------------------------------------------


def damping(tmp_path: Path, text: str) -> tuple[str, float, float]:
    file = tmp_path / "own.toml"
    file.write_text(text)
    robot = load_robot(file)
    return robot.scheme, robot.body.linear_damping_n_s_m, robot.body.angular_damping_n_m_s


def test_a_scheme_brings_its_damping_and_keys_of_its_file_win(tmp_path: Path) -> None:
    assert damping(tmp_path, 'extends = "arsim"') == ("kit", 1.0, 0.1)
    assert damping(tmp_path, 'extends = "arsim"\nscheme = "arsim"') == ("arsim", 15.0, 0.78)
    own = 'scheme = "arsim"\n[body]\nangular_damping_n_m_s = 0.3'
    assert damping(tmp_path, f'extends = "arsim"\n{own}') == ("arsim", 15.0, 0.3)
    assert damping(tmp_path, 'extends = "arsim-1.2"\n[body]\nlinear_damping_n_s_m = 2') == ("arsim", 2.0, 0.78)
    assert damping(tmp_path, 'extends = "arsim-1.2"\nscheme = "kit"') == ("kit", 15.0, 0.78)


def test_a_vehicle_of_a_file_back_in_the_kits_scheme_sees_all_of_r(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text('extends = "arsim-1.2"\nscheme = "kit"\n')
    model = vehicle_model(file, noise=False)
    expected = run(dataclasses.replace(SCHEMES["arsim"], alpha=15.0, beta=0.78), DRIVES["curves"], 300)[-1]
    vehicle = Vehicle(model, ROOM)
    for step in range(300):
        vehicle.step(*DRIVES["curves"](step * DT))
    assert vehicle.true_pose == pytest.approx(tuple(expected[:3]), abs=1e-9)
    assert list(vehicle["odometer"]) == pytest.approx(expected[5:], abs=1e-9)
