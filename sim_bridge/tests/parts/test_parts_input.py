"""Buttons, switches and potentiometers: what they do to their pin as a person works them."""

from __future__ import annotations

import itertools
from typing import Literal

import msgspec
import numpy as np
import pytest

from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.device import Device
from boebot.devices.input import Button, Potentiometer, SlideSwitch
from boebot.errors import BoebotError
from sim_bridge.tests.simulated import MS, US, scripted, scripts

LOW, HIGH, RELEASED = range(3)


def with_devices(**devices: Device) -> RobotDescription:
    return msgspec.structs.replace(load_robot("shieldbot"), firmware="none", device=devices)


@pytest.mark.parametrize(("to", "resistor"), list(itertools.product(("ground", "supply"), (False, True))))
def test_a_contact_joins_its_pin_to_one_end_and_else_leaves_it_or_pulls_it_the_other_way(
    to: Literal["ground", "supply"], resistor: bool
) -> None:
    closed = LOW if to == "ground" else HIGH
    opened = RELEASED if not resistor else HIGH if to == "ground" else LOW
    button, switch = Button(pin=2, to=to, resistor=resistor), SlideSwitch(pin=3, to=to, resistor=resistor, closed=True)
    robot = scripted(robot=with_devices(start=button, mode=switch))
    robot.run(0.1)
    for value in (1, 1, 0):
        robot.robot.set_part("start", value)
        robot.robot.set_part("mode", 1 - value)
        assert robot.robot.readings() == (value, 1 - value)
        robot.run(0.1)
    assert [level for _, level in robot.inputs(2)] == [opened, closed, opened]
    assert [level for _, level in robot.inputs(3)] == [closed, opened, closed]
    for pin in (2, 3):
        times = [cycle for cycle, _ in robot.inputs(pin)]
        assert times[0] == 0 and times[1:] == pytest.approx([100 * MS, 300 * MS], abs=5 * US)
    for name, wrong, words in (
        *(("start", wrong, "start cannot be set to .*; expected 0 or 1") for wrong in (0.5, 2, -1)),
        ("mode", float("nan"), "mode is set: the value is nan"),
        ("stat", 1, "stat of robot 'shieldbot' is no button, switch or knob; .*did you mean 'start'"),
    ):
        with pytest.raises(BoebotError, match=words):
            robot.robot.set_part(name, wrong)


def test_contacts_bounce_for_milliseconds_and_each_in_its_own_way() -> None:
    """0 to 4 flicks fill half of an exponential length of 2 ms on average, at most twice; it is cut at 10 ms."""
    robot = scripted(robot=with_devices(start=Button(pin=2, resistor=True), mode=SlideSwitch(pin=3)), noise=True)
    for i in range(200):
        for name in ("start", "mode"):
            robot.robot.set_part(name, (i + 1) % 2)
        robot.run(0.05)
    lengths = {}
    for pin in (2, 3):
        edges = np.array([cycle for cycle, _ in robot.inputs(pin)][1:])
        last = robot.inputs(pin)[-1][1]
        assert last == (HIGH if pin == 2 else RELEASED)
        step = (edges - 64) // (50 * MS)
        lengths[pin] = np.array([np.ptp(edges[step == i]) for i in range(200)]) / MS
        assert lengths[pin].max() < 20 and np.count_nonzero(lengths[pin]) > 120  # four of five have flicks
    assert np.mean([*lengths.values()]) == pytest.approx(0.5 * 2.0 * (1 - np.exp(-5)), rel=0.15)
    assert not np.array_equal(lengths[2], lengths[3])
    quiet = scripted(robot=with_devices(start=Button(pin=2)), noise=True, without=("bounce",))
    quiet.robot.set_part("start", 1)
    quiet.run(0.1)
    assert len(quiet.inputs(2)) == 2


def test_a_potentiometer_gives_its_share_of_the_rail() -> None:
    robot = scripted(robot=with_devices(dial=Potentiometer(pin="A1", position=0.3)))
    robot.run(0.01)
    assert scripts.script_board_volts(robot.script, 1) == pytest.approx(1.5)
    robot.robot.set_part("dial", 0.8)
    robot.pins.supply(4.5)
    assert scripts.script_board_volts(robot.script, 1) == pytest.approx(0.8 * 4.5)
    assert robot.robot.readings() == (0.8,)
    for position in (0.5, 0.41, 0.5, 0.53):  # a digital input keeps its level from 2.1 V to 2.6 V
        robot.robot.set_part("dial", position)
        robot.run(0.01)
    assert [level for _, level in robot.inputs(15)] == [LOW, HIGH, LOW, HIGH]
    robot.pins.unplug("dial")
    assert scripts.script_board_volts(robot.script, 1) == 0.0
    noisy = scripted(robot=with_devices(dial=Potentiometer(pin="A1")), noise=True)
    seen = np.array([scripts.script_board_volts(noisy.script, 1) for _ in range(1000)])
    assert seen.mean() == pytest.approx(2.5, abs=0.001) and seen.std() == pytest.approx(0.005, rel=0.1)
