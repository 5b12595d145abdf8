"""Line modules: the voltage over bright and dark floors, and the comparator's level."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from boebot.arenas import load_arena
from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.line import LineModule
from boebot.errors import RobotError
from sim_bridge.tests.simulated import scripted, scripts

TAPE = (0.3, -0.55, 0.0)  # along the tape of the track
DIGITAL, ANALOG = 2, "A1"


def modules(**imperfections: float) -> RobotDescription:
    devices = {
        "middle": LineModule(pin=DIGITAL, position_m=(0.0, 0.0), dark="low"),
        "side": LineModule(pin=ANALOG, position_m=(0.0, 0.05), output="analog"),
        "other": LineModule(pin=3, position_m=(0.0, -0.05)),
    }
    return msgspec.structs.replace(
        load_robot("shieldbot"), firmware="none", device=devices, imperfections=imperfections
    )


def test_voltage_and_level_over_tape_and_floor() -> None:
    """The floor throws back 0.8 and 0.01 of stray light, the tape 0.05: 5 V (1 - 1.1 r), and 0.3 V at least."""
    robot = scripted(load_arena("track"), modules(), TAPE)
    assert robot.robot.readings()[1] == 1.0 and robot.inputs(DIGITAL) == [(0, 0)], (
        "from power-on, before the first step"
    )
    robot.run(0.01)
    middle, dark, side, bright, other, _ = robot.robot.readings()
    assert (dark, bright) == (1.0, 0.0)
    assert middle == pytest.approx(5 * (1 - 1.1 * 0.06), abs=0.01)
    assert side == other == pytest.approx(5 * (1 - 1.1 * 0.81), abs=0.01)
    assert scripts.script_board_volts(robot.script, 1) == pytest.approx(side)
    assert [robot.inputs(pin)[-1][1] for pin in (DIGITAL, 3)] == [0, 0], "low over tape; low over the bright floor"
    robot.robot.place(0.3, -0.5, 0.0)  # the third is over the tape now
    robot.run(0.01)
    assert [robot.inputs(pin)[-1][1] for pin in (DIGITAL, 3)] == [1, 1]
    assert len(robot.inputs(DIGITAL)) == 2
    robot.pins.supply(4.0)
    robot.run(0.01)
    assert robot.robot.readings()[0] == pytest.approx(4 * (1 - 1.1 * 0.81), abs=0.01)


def test_threshold_and_hysteresis_are_its_potentiometer() -> None:
    robot = scripted(load_arena("track"), modules(line_module_threshold=0.95), TAPE)
    robot.run(0.01)
    assert robot.robot.readings()[1] == 0.0, "the tape gives 0.934 of the supply"
    kept = modules(line_module_threshold=0.5, line_module_hysteresis=0.45)
    robot = scripted(load_arena("track"), kept, TAPE)
    robot.run(0.01)
    assert robot.robot.readings()[1] == 0.0, "0.95 is not reached"


def test_an_analog_one_needs_an_analog_pin(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('extends = "rover"\n[device.line_left]\noutput = "analog"\n')
    with pytest.raises(RobotError, match=r"line_left.pin is pin 2, which measures no voltage; expected A0 to A5"):
        load_robot(file)
