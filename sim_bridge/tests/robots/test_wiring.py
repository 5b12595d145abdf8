"""Devices of a description become parts at their pins; several boards with firmware share a run."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import msgspec
import pytest

from boebot.arenas import Arena, ArenaDescription, Moving, Waypoint
from boebot.description import robots
from boebot.description.robots import load_robot
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.battery import BatteryDivider
from boebot.devices.buzzer import PiezoBuzzer
from boebot.devices.compass import MagneticCompass
from boebot.devices.encoder import SingleEncoder
from boebot.devices.led import Led
from boebot.devices.light import LightSensor
from boebot.devices.turret import PositionServo
from boebot.errors import ArenaError, BoardError, RobotError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import native_board, native_library
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import (
    MS,
    US,
    add_scripted,
    arena_of,
    pack_voltage,
    scripted,
    scripts,
    shortest_ray,
    square,
    turret_angle,
)

DEVICES: dict[str, robots.AnyDevice] = {
    "turret": PositionServo(pin=11, position_m=(0.045, 0.0)),
    "compass": MagneticCompass(sda_pin="A4", scl_pin="A5"),
    "analog_infrared": SharpSensor(pin="A2", position_m=(0.02, 0.0), heading_rad=0.3),
    "battery": BatteryDivider(pin="A0"),
    "light_left": LightSensor(pin=6, position_m=(0.05, 0.04), heading_rad=0.5),
    "buzzer": PiezoBuzzer(pin=4),
}


def equipped() -> robots.RobotDescription:
    robot = load_robot("shieldbot")
    kept = {name: device for name, device in robot.device.items() if not isinstance(device, SingleEncoder)}
    return msgspec.structs.replace(robot, device={**kept, **DEVICES})


def test_each_device_sits_at_its_pins() -> None:
    sim = Sim(arena_of(outline=square(0, 0, 2)), noise=False)
    robot = add_scripted(sim, equipped(), pose=(0, 0, 0))
    robot.pulses(0.5, {11: 2000})
    robot.edge(500 * MS, 6, 1)
    robot.edge(501 * MS, 6, 2)
    robot.edge(800 * MS, 8, 1)
    robot.edge(800 * MS + 5 * US, 8, 2)
    robot.run(1.0)
    angle = turret_angle(robot.robot, 11)
    assert angle == pytest.approx(500 / 573.0, abs=0.008)
    x, y = 0.045 + 0.015 * math.cos(angle), 0.015 * math.sin(angle)  # the Ping is on it
    distance = robot.robot.readings()[robot.robot.layout["ping"]][0]
    assert distance == pytest.approx(shortest_ray(1.0, x, y, angle), rel=1e-9)
    lows = [cycle for cycle, level in robot.inputs(6) if level == 0]
    assert lows[-1] - 501 * MS == pytest.approx(1500 * US, abs=2)
    assert "buzzer" in robot.robot.parts
    ahead = 100 * (1.0 - 0.02) / math.cos(0.3)  # as it is mounted here
    assert scripts.script_board_volts(robot.script, 2) == pytest.approx(33.9 / (ahead + 4.74))
    assert scripts.script_board_volts(robot.script, 0) == pytest.approx(pack_voltage(robot.robot) / 2)
    assert {robot.inputs(pin)[0][1] for pin in (18, 19)} == {1}  # the compass board's pull-ups


@pytest.mark.parametrize(
    ("name", "device"),
    [
        ("second_compass", MagneticCompass(sda_pin="A4", scl_pin="A5")),
        ("light_right", LightSensor(pin=8, position_m=(0.05, -0.04), heading_rad=-0.5)),
        ("second_sharp", SharpSensor(pin="A2", position_m=(0.0, 0.0), heading_rad=0.0)),
    ],
)
def test_two_devices_that_drive_one_pin_are_refused_in_one_sentence(name: str, device: robots.AnyDevice) -> None:
    robot = equipped()
    doubled = msgspec.structs.replace(robot, device={**robot.device, name: device})
    sim = Sim(arena_of(), noise=False)
    with pytest.raises(
        BoardError, match=f"^device '{name}' cannot be joined .*: another device drives one of its pins, or"
    ):
        add_scripted(sim, doubled)


def test_devices_that_only_hear_share_a_pin_up_to_seven() -> None:
    robot = equipped()
    lamps = {f"lamp_{i}": Led(pin=4) for i in range(6)}  # beside the buzzer
    both = add_scripted(Sim(arena_of(), noise=False), msgspec.structs.replace(robot, device={**robot.device, **lamps}))
    for i in range(100):
        both.edge(i * MS, 4, 1)
        both.edge(i * MS + 500 * US, 4, 0)
    both.run(0.2)
    shown = both.robot.readings()
    assert [shown[both.robot.layout[name]][0] for name in lamps] == pytest.approx([0.25] * 6, rel=0.02)
    crowded = msgspec.structs.replace(robot, device={**robot.device, **lamps, "lamp_6": Led(pin=4)})
    with pytest.raises(BoardError, match=r"^device 'lamp_6' cannot be joined .* too many listen there$"):
        add_scripted(Sim(arena_of(), noise=False), crowded)


def test_values_out_of_range_are_refused_in_one_sentence() -> None:
    robot = equipped()
    sensor = SharpSensor(pin="A2", position_m=(0.0, 0.0), heading_rad=math.nan)
    wrong = msgspec.structs.replace(robot, device={**robot.device, "analog_infrared": sensor})
    with pytest.raises(BoardError, match=r"^device 'analog_infrared' cannot be joined .* is out of its range$"):
        add_scripted(Sim(arena_of(), noise=False), wrong)


def test_a_start_on_a_robot_or_on_an_obstacle_on_its_way_is_refused() -> None:
    """Two discs of 0.07 m, and the cart's disc of 0.10 m."""
    cart = Moving(path=[Waypoint(0.0, 1.0, 0.0), Waypoint(10.0, 2.0, 0.0)], radius_m=0.10)
    sim = Sim(Arena(ArenaDescription(name="busy", moving=[cart])), noise=False)
    first = add_scripted(sim, pose=(0.0, 0.0, 0.0))
    for x, free in ((0.139, False), (0.831, False), (0.829, True)):
        if free:
            second = add_scripted(sim, pose=(x, 0.0, 0.0))
        else:
            with pytest.raises(ArenaError, match="no free space"):
                add_scripted(sim, pose=(x, 0.0, 0.0))
    sim.run(5 * CLOCK_HZ)
    for x, free in ((0.141, True), (0.0, False), (1.34, False), (1.2, True), (1.7, True)):
        if free:
            second.robot.place(x, 0.0, 0.0)
        else:
            with pytest.raises(ArenaError, match="cannot stand at"):
                second.robot.place(x, 0.0, 0.0)
    first.robot.place(0.0, 0.0, 1.0)  # a robot is not in its own way


def firmware_run(order: tuple[int, ...]) -> tuple[int, list[bytes]]:
    sim = Sim(arena_of(outline=square(0, 0, 3)), seed=3)
    poses = {0: (0.0, 0.0, 0.0), 1: (0.6, 0.1, 3.0), 2: (0.0, 0.7, -1.5)}
    members = {
        n: sim.add(native_board(native_library("shieldbot")), load_robot("shieldbot"), pose=poses[n], number=n)
        for n in order
    }
    sim.run(CLOCK_HZ)
    outcome = sim.hash(), [members[n].receive() for n in sorted(members)]
    sim.close()
    return outcome


def test_firmware_on_several_boards_does_not_depend_on_their_order() -> None:
    outcomes = [firmware_run(order) for order in itertools.permutations((0, 1, 2))]
    assert all(outcome == outcomes[0] for outcome in outcomes)
    assert all(len(data) > 20 for data in outcomes[0][1])  # each board says hello


def test_a_turret_carries_what_its_robot_names(tmp_path: Path) -> None:
    """Another sensor than the Ping, which then stays ahead; its angle is what the robot shows."""
    text = 'firmware = "none"\nremove = ["uart"]\n[device.analog_infrared]\ntype = "analog_infrared"\npin = "A0"\n'
    text += "position_m = [0.06, 0.0]\nheading_rad = 0.0\n[device.turret]\non = true\ncarries = "
    file = tmp_path / "mine.toml"
    file.write_text(f'extends = "shieldbot"\nname = "mine"\n{text}["analog_infrared"]\n')
    wall = square(0.045, 0.4, 0.4)  # at the left of the turret
    robot = scripted(arena_of(wall), load_robot(file))
    robot.pulses(1.0, {11: 1500 + 573 * math.pi / 2})
    ahead = scripts.script_board_volts(robot.script, 0)
    robot.run(1.0)
    where = robot.robot.layout["turret"].start
    assert robot.robot.readings()[where] == pytest.approx(math.pi / 2, abs=0.01)
    assert scripts.script_board_volts(robot.script, 0) > ahead + 1.0
    for wrong in ("ears", "turret", "servo_left"):
        file.write_text(f'extends = "shieldbot"\nname = "mine"\n{text}["{wrong}"]\n')
        with pytest.raises(RobotError, match=f"device.turret.carries names '{wrong}'; expected sensors, such as "):
            load_robot(file)
