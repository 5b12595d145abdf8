"""The HC-SR04's pulses, against its data sheet (Elecfreaks, HC-SR04 User Guide) and the time that sound takes."""

from __future__ import annotations

import itertools

import msgspec
import pytest

from boebot.description.robots import load_robot
from boebot.devices.ultrasonic import UltrasonicSensor
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.tests.simulated import MS, US, Scripted, arena_of, scripted, square

TRIGGER, ECHO = 7, 8
LOW, HIGH, RELEASED = range(3)
SOUND = 331.5 + 0.6 * 20  # m/s


def watched(*walls_m: float, noise: bool = False, echo_pin: int = ECHO, **imperfections: float) -> Scripted:
    """A robot at the origin with a sensor in its middle, and walls so far ahead, 1 m deep and high enough."""
    sensor = UltrasonicSensor(trigger_pin=TRIGGER, echo_pin=echo_pin, position_m=(0.0, 0.0))
    shieldbot = load_robot("shieldbot")
    body = msgspec.structs.replace(shieldbot.body, radius_m=0.01)
    robot = msgspec.structs.replace(shieldbot, firmware="none", device={"sonar": sensor}, body=body)
    robot = msgspec.structs.replace(robot, imperfections=imperfections)
    walls = arena_of(*(square(wall + 0.5, 0.0, 1.0) for wall in walls_m))
    return scripted(walls, robot, noise=noise, without=() if noise else ("ping_misses",))


def trigger(robot: Scripted, at: int, width: int) -> None:
    robot.edge(at, TRIGGER, HIGH)
    robot.edge(at + width, TRIGGER, LOW)


def echoes(robot: Scripted, pin: int = ECHO) -> list[tuple[int, int]]:
    """Cycle and length of each."""
    edges = robot.inputs(pin)
    return [(a, b - a) for (a, level), (b, _) in itertools.pairwise(edges) if level == HIGH]


@pytest.mark.parametrize("distance", [0.05, 0.5, 1.0, 3.9])
def test_the_echo_lasts_as_long_as_sound_takes_there_and_back(distance: float) -> None:
    """The sheet: us / 58 = cm, within 3 mm; and that is of air of 18 °C or so: one part in a hundred here."""
    robot = watched(distance)
    trigger(robot, MS, 10 * US)
    robot.run(0.06)
    ((begin, length),) = echoes(robot)
    assert begin == MS + 10 * US + 460 * US
    assert length == pytest.approx(2 * distance / SOUND * CLOCK_HZ, abs=1)
    assert length / US / 58 == pytest.approx(100 * distance, rel=0.01, abs=0.3)
    seen_m, ago_s = robot.robot.readings()
    assert seen_m == pytest.approx(distance) and ago_s == pytest.approx(0.06 - 0.00101)


def test_nothing_near_is_a_pulse_of_38_ms() -> None:
    robot = watched(4.1)
    assert robot.robot.readings() == (-1.0, -1.0)
    trigger(robot, MS, 20 * US)
    robot.run(0.06)
    ((_, length),) = echoes(robot)
    assert length == 38 * MS and robot.robot.readings()[0] == -1.0
    copy = watched(ultrasonic_nothing_s=0.2, ultrasonic_delay_s=0.001)
    trigger(copy, MS, 20 * US)
    copy.run(0.25)
    assert echoes(copy) == [(2 * MS + 20 * US, 200 * MS)]


def test_what_triggers_it_is_a_pulse_of_10_us_while_its_echo_is_low() -> None:
    robot = watched(1.0)
    trigger(robot, MS, 9 * US)  # too short
    trigger(robot, 2 * MS, 5 * MS)  # as long as one likes: it begins as that ends
    trigger(robot, 9 * MS, 10 * US)  # in the echo
    trigger(robot, 20 * MS, 10 * US)
    robot.run(0.06)
    assert [begin for begin, _ in echoes(robot)] == [7 * MS + 460 * US, 20 * MS + 470 * US]
    assert robot.inputs(ECHO)[0] == (0, LOW), "its output is low between echoes"


def test_trigger_and_echo_may_be_one_pin() -> None:
    robot = watched(1.0, echo_pin=TRIGGER)
    robot.edge(MS, TRIGGER, HIGH)
    robot.edge(MS + 10 * US, TRIGGER, RELEASED)
    robot.run(0.06)
    assert [begin for begin, _ in echoes(robot, TRIGGER)] == [MS + 470 * US]


def test_noise_is_of_the_sheet_s_3_mm_at_1_m_and_an_echo_may_be_missed() -> None:
    robot = watched(1.0, noise=True)
    for i in range(400):
        trigger(robot, MS + i * 60 * MS, 10 * US)
    robot.run(24.1)
    lengths = [length / CLOCK_HZ * SOUND / 2 for _, length in echoes(robot)]
    heard = [one for one in lengths if one < 2]
    mean = sum(heard) / len(heard)
    spread = (sum((one - mean) ** 2 for one in heard) / len(heard)) ** 0.5
    assert mean == pytest.approx(1.0, abs=0.001) and spread == pytest.approx(0.003, rel=0.15)
    assert 1 <= 400 - len(heard) <= 20  # of 8, by chance 2 %
