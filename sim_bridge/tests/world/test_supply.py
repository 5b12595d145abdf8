"""Battery, regulator, rails, brown-out, charger; the classic robot's sag against what was measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.description.robots import load_robot
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices import servo as servo_model
from sim_bridge.robots import imperfections
from sim_bridge.tests.world.bodies import BOE_BOT, Body
from sim_bridge.vehicles.drives import ENERGY

PACK: dict[str, Any] = {
    "full_v": 7.75,
    "empty_v": 5.0,
    "capacity_as": 7200.0,
    "resistance_ohm": 0.6,
    "drop_out_v": 0.5,
    "board_a": 0.08,
    "servo_idle_a": 0.015,
    "servo_run_a_s_m": 0.74,
    "servo_a_per_n_m": 3.7,
    "charger_a": 1.0,
}


def supply(charge: float = 1.0, **changes: Any) -> tuple[Any, Any]:
    parameters = ffi.new("supply_parameters *", {**PACK, **changes})
    state = ffi.new("supply *")
    lib.supply_init(parameters, state, charge)
    return parameters, state


def test_voltage_falls_with_charge_and_load() -> None:
    p, s = supply()
    assert s.pack_v == pytest.approx(7.75 - 0.6 * 0.08)
    assert (s.board_v, s.servo_v) == (5.0, 5.0)
    lib.supply_step(p, s, 2.0, 0, 1800.0)
    assert s.charge == pytest.approx(1 - 2.08 * 1800 / 7200)
    assert s.pack_v == pytest.approx(5.0 + 2.75 * s.charge - 0.6 * 2.08)
    assert s.board_v == pytest.approx(s.pack_v - 0.5)  # within its drop-out


@pytest.mark.parametrize("current", [2.0, 4.0, 6.0])
def test_rail_sags_with_the_load(current: float) -> None:
    """As soon as the load goes all is well again."""
    p, s = supply(empty_v=6.5, full_v=6.5, resistance_ohm=0.6)
    lib.supply_step(p, s, current, 0, 0.001)
    board = 6.5 - 0.6 * (current + 0.08) - 0.5
    assert s.board_v == pytest.approx(min(board, 5.0))
    lib.supply_step(p, s, 0.0, 0, 0.001)
    assert s.board_v == 5.0


def test_charger_fills_the_pack() -> None:
    p, s = supply(charge=0.2)
    lib.supply_step(p, s, 0.0, 1, 1000.0)
    assert s.charge == pytest.approx(0.2 + 0.92 * 1000 / 7200)
    lib.supply_step(p, s, 0.0, 1, 1e6)
    assert s.charge == 1.0


@given(st.floats(0, 1), st.lists(st.tuples(st.floats(0, 20), st.booleans(), st.floats(1e-4, 1e4)), max_size=20))
def test_charge_stays_within_its_bounds(charge: float, loads: list[tuple[float, bool, float]]) -> None:
    p, s = supply(charge=charge)
    for current, at_charger, dt in loads:
        lib.supply_step(p, s, current, at_charger, dt)
        assert 0 <= s.charge <= 1
        assert 0 <= s.board_v <= 5 and s.board_v <= s.pack_v


def test_energy_of_the_notes() -> None:
    """E' = -(p_0 + p_m (|s_L| + |s_R|)) + p_c at the charger, within 0 and 1 (section 1.9)."""
    p = ffi.new("energy_parameters *", ENERGY)
    assert lib.energy_step(p, 0.5, 0.5, -1.0, 0, 2.0) == pytest.approx(0.5 - 2 * (0.002 + 0.004 * 1.5))
    assert lib.energy_step(p, 0.5, 0.0, 0.0, 1, 2.0) == pytest.approx(0.5 + 2 * 0.098)
    assert lib.energy_step(p, 0.001, 1.0, 1.0, 0, 2.0) == 0.0
    assert lib.energy_step(p, 0.95, 0.0, 0.0, 1, 2.0) == 1.0


# Four worn AA cells of the classic robot: unregulated servos. Three values are chosen (the pack's resistance and
# voltage, 1.2 A at stall), so that the drive does to the pack what was measured.
CLASSIC: dict[str, Any] = {
    **PACK,
    "full_v": 5.65,
    "empty_v": 4.0,
    "resistance_ohm": 3.0,
    "drop_out_v": 0.2,
    "servo_a_per_n_m": 4.5,
    "unregulated": 1.0,
}


def test_classic_robot_sags_as_measured() -> None:
    """Pack 5.3 V idle, 4.6 V running, dips to 3.8 V on reversal (fact sheet 1.1), each within 0.1 V."""
    p, s = supply(**CLASSIC)
    robot = load_robot("shieldbot")
    device: Any = robot.device["servo_left"]
    servo = servo_model.servo_parameters(device, robot.body, 0, imperfections.Draw(1, noise=False))
    motors = [ffi.new("servo_motor *"), ffi.new("servo_motor *")]
    for motor in motors:
        lib.servo_motor_init(servo, motor, 0.001)
    body = Body(parameters=BOE_BOT, spin_inertia=4e-4)
    volts = []
    for step in range(3000):
        pulse = 1500.0 if step < 500 else 1700.0 if step < 2000 else 1300.0
        current, torques = 0.0, []
        for motor, rim in zip(motors, (body.state.rim_left, body.state.rim_right), strict=True):
            if step % 20 == 0:
                lib.servo_motor_pulse(servo, motor, pulse)
            torques.append(lib.servo_motor_torque(servo, motor, rim, s.servo_v / 5.0))
            current += lib.supply_servo_current(p, 1, rim, torques[-1])
        body.advance(*torques)
        lib.supply_step(p, s, current, 0, 0.001)
        volts.append(s.pack_v)
        assert s.servo_v == s.pack_v
    assert volts[400] == pytest.approx(5.3, abs=0.1)
    assert np.mean(volts[1500:2000]) == pytest.approx(4.6, abs=0.1)
    assert min(volts[2000:2300]) == pytest.approx(3.8, abs=0.1)
