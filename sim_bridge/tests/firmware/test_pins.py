"""What the board does to its pins: none floats, a device that is off drives none, lines of servos are low early."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boebot.description.robots import load_robot
from boebot.devices.servo import ContinuousServo
from boebot.devices.uart import Uart
from boebot.link import messages
from boebot_hil.rig import CYCLES_PER_S
from sim_bridge.bench.bench import bare
from sim_bridge.boards.board import Level
from sim_bridge.tests.boards.avr.bootloader import KITS
from sim_bridge.tests.rigs import SessionRig
from tools.tests.avr_program import IMAGES

pytestmark = pytest.mark.unsanitized

DRIVEN = {Level.LOW, Level.HIGH}
SERVOS = (13, 12)


def device_pins(pin_map: str) -> dict[str, list[int]]:
    """The pins of each device of a map but servos of wheels and the serial line, which are always in use."""
    devices = load_robot(pin_map).device.items()
    return {name: sorted(d.pins().values()) for name, d in devices if not isinstance(d, ContinuousServo | Uart)}


def levels(host: SessionRig, seconds: float) -> dict[int, set[Level]]:
    """What the board does to each pin within that time."""
    begun = host.board.cycle
    seen = {pin: {host.board.output(pin)} for pin in range(20)}
    host.listen(seconds)
    for cycle, pin, level in host.board.pin_log().tolist():
        if cycle >= begun:
            seen[pin].add(Level(level))
    return seen


@pytest.mark.parametrize("kind", [pytest.param("native", marks=pytest.mark.soak), "avr"])
@pytest.mark.parametrize("pin_map", IMAGES)
def test_devices_that_are_off_drive_no_pin_and_none_floats(kind: str, pin_map: str) -> None:
    host = SessionRig.open(kind, robot=bare(pin_map))
    host.open_session()
    assert host.request(messages.SetParameter, messages.PARAMETERS["devices"].id, 0).status == messages.AnswerStatus.OK
    host.listen(0.1)
    seen = levels(host, 0.5)
    for device, pins in device_pins(pin_map).items():
        for pin in pins:
            assert seen[pin] == {Level.PULLED_UP}, device


@pytest.mark.parametrize("kind", [pytest.param("native", marks=pytest.mark.soak), "avr"])
@pytest.mark.parametrize("pin_map", IMAGES)
def test_a_pin_floats_only_while_its_device_measures(kind: str, pin_map: str) -> None:
    """All devices on: an echo is awaited for 20 ms, a decay for 14 ms; what an analog sensor gives is not pulled at."""
    host = SessionRig.open(kind, robot=bare(pin_map))
    host.open_session()
    built = sum(int(bit) for bit, name in messages.DEVICE_OF_BIT.items() if name in load_robot(pin_map).device)
    host.request(messages.SetParameter, messages.PARAMETERS["devices"].id, built)
    host.listen(0.1)
    measured = {"ping", "light_left", "light_right", "battery", "analog_infrared"}
    measured |= {"line_left", "line_middle", "line_right"}
    seen = levels(host, 0.5)
    for device, pins in device_pins(pin_map).items():
        for pin in pins:
            assert device in measured or Level.RELEASED not in seen[pin], device


@pytest.mark.parametrize("kind", [pytest.param("native", marks=pytest.mark.soak), "avr"])
@pytest.mark.parametrize("pin_map", IMAGES)
def test_before_a_host_speaks_no_device_is_driven(kind: str, pin_map: str) -> None:
    """Who knows what is wired to the board before anyone says so?"""
    host = SessionRig.open(kind, robot=bare(pin_map))
    seen = levels(host, 1.5)
    for device, pins in device_pins(pin_map).items():
        for pin in pins:
            assert not seen[pin] & DRIVEN, device


# ---- from a reset on -------------------------------------------------------------------------------------------------


def low_after_ms(pin_map: str, bootloader: Path | None = None) -> float:
    """From the reset until the servos' lines are low, where they stay."""
    host = SessionRig.open("avr", robot=bare(pin_map), bootloader=bootloader and str(bootloader))
    host.listen(2.0)
    start = host.board.cycle
    host.board.reset("power")
    host.listen(2.0)
    log = host.board.pin_log()
    of_servos = log[np.isin(log["pin"], SERVOS) & (log["cycle"] > start + 10)]  # without those of the reset itself
    assert of_servos["level"].tolist() == [Level.LOW, Level.LOW]
    return float(of_servos["cycle"].max() - start) / CYCLES_PER_S * 1e3


@pytest.mark.parametrize("pin_map", IMAGES)
def test_servo_lines_are_low_within_milliseconds(pin_map: str) -> None:
    assert low_after_ms(pin_map) < 5.0


def test_behind_a_bootloader_too() -> None:
    """Which starts the program at once when the power comes; after an external reset it waits a second for another."""
    assert low_after_ms("shieldbot", KITS) < 5.0
