"""Devices of a description become parts at their pins; several boards with firmware share a run."""

from __future__ import annotations

import itertools

import msgspec
import pytest

from boebot import robots
from boebot.robots import load_robot
from sim_bridge import imperfections
from sim_bridge._core import lib
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import native_board, native_library
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import MS, US, add_scripted, arena_of, square

DEVICES: dict[str, robots.AnyDevice] = {
    "turret": robots.PositionServo(pin=11),
    "compass": robots.Compass(sda_pin="A4", scl_pin="A5"),
    "analog_infrared": robots.AnalogInfrared(pin="A2"),
    "battery": robots.Battery(pin="A0"),
    "light_left": robots.LightSensor(pin=6),
    "buzzer": robots.Buzzer(pin=4),
}


def equipped() -> robots.RobotDescription:
    robot = load_robot("shieldbot")
    kept = {name: device for name, device in robot.device.items() if not isinstance(device, robots.Encoder)}
    return msgspec.structs.replace(robot, device={**kept, **DEVICES})


def test_each_device_sits_at_its_pins() -> None:
    sim = Sim(arena_of(outline=square(0, 0, 2)), noise=False)
    robot = add_scripted(sim, equipped(), pose=(0, 0, 0))
    robot.pulses(0.5, {11: 2000})
    robot.edge(500 * MS, 6, 1)
    robot.edge(501 * MS, 6, 2)
    for i in range(100):
        robot.edge(600 * MS + i * MS, 4, 1)
        robot.edge(600 * MS + i * MS + 500 * US, 4, 0)
    robot.edge(800 * MS, 8, 1)
    robot.edge(800 * MS + 5 * US, 8, 2)
    robot.run(1.0)
    assert robot.robot.turret_angle(11) == pytest.approx(500 / 573.0, abs=0.008)
    assert robot.robot.looks()["heading"][-1] == robot.robot.turret_angle(11)  # the Ping is on it
    lows = [cycle for cycle, level in robot.inputs(6) if level == 0]
    assert lows[-1] - 501 * MS == pytest.approx(1500 * US, abs=2)
    assert robot.robot.tones()["frequency"] == pytest.approx([1000.0])
    ahead = 100 * (1.0 - imperfections.SHARP_M[0])
    assert lib.script_board_volts(robot.script, 2) == pytest.approx(33.9 / (ahead + 4.74))
    assert lib.script_board_volts(robot.script, 0) == pytest.approx(robot.robot.pack_voltage / 2)
    assert {robot.inputs(pin)[0][1] for pin in (18, 19)} == {1}  # the compass board's pull-ups


def firmware_run(order: tuple[int, ...]) -> tuple[int, list[bytes]]:
    sim = Sim(arena_of(outline=square(0, 0, 3)), seed=3)
    poses = {0: (0.0, 0.0, 0.0), 1: (0.6, 0.1, 3.0), 2: (0.0, 0.7, -1.5)}
    members = {
        n: sim.add(native_board(native_library("shieldbot")), load_robot("shieldbot"), pose=poses[n], number=n)
        for n in order
    }
    sim.run(CLOCK_HZ, CLOCK_HZ)
    outcome = sim.hash(), [members[n].receive() for n in sorted(members)]
    sim.close()
    return outcome


def test_firmware_on_several_boards_does_not_depend_on_their_order() -> None:
    outcomes = [firmware_run(order) for order in itertools.permutations((0, 1, 2))]
    assert all(outcome == outcomes[0] for outcome in outcomes)
    assert all(len(data) > 20 for data in outcomes[0][1])  # each board says hello
