"""What a brain touches: devices in SI units, commands, chance, and nothing beyond."""

from __future__ import annotations

import contextlib
import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.description.robots import load_robot
from boebot.devices.infrared import Infrared
from boebot.devices.ping import SPEED_OF_SOUND
from boebot.errors import BrainError
from boebot.link import messages
from boebot.link.messages import PingStatus
from boebot.robot import Command, Equipment, Observation, Robot

SHIELDBOT = load_robot("shieldbot")
TICK_S = 0.01
NOTHING = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))


def observe(**fields: int) -> Observation:
    return Observation(NOTHING._replace(**fields), Equipment(SHIELDBOT, TICK_S), time=1.0)


def robot_seeing(observation: Observation, period: float = 0.05, seed: int = 1) -> Robot:
    robot = Robot("shieldbot", period, seed)
    robot.observation = observation
    return robot


def test_whiskers() -> None:
    assert observe(whiskers=messages.Whiskers.LEFT).whisker_left.pressed
    assert not observe(whiskers=messages.Whiskers.LEFT).whisker_right.pressed
    assert observe(whiskers=messages.Whiskers.RIGHT).whisker_right == (True, 0.0, True)


@pytest.mark.parametrize(("ticks", "age", "valid"), [(0, 0.0, True), (15, 0.15, True), (16, 0.16, False)])
def test_infrared_ages(ticks: int, age: float, valid: bool) -> None:
    pair = observe(infrared=messages.Infrared.RIGHT, infrared_age=ticks)
    assert pair.infrared_right.detected and not pair.infrared_left.detected
    assert pair.infrared_left.age == pytest.approx(age)
    assert pair.infrared_left.valid is valid


def test_infrared_never_read() -> None:
    assert observe(infrared_age=255).infrared_left == Infrared(False, math.inf, False)


@given(st.floats(0.02, 3.0))
def test_echo_becomes_distance(distance: float) -> None:
    echo_us = round(2 * distance / SPEED_OF_SOUND * 1e6)
    ping = observe(ping_echo=echo_us, ping_age=3, ping_status=PingStatus.OK).ping
    assert ping.distance == pytest.approx(distance, abs=0.0002)
    assert ping.valid and ping.age == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("status", "echo_us", "ticks", "shown", "valid"),
    [
        (PingStatus.NOTHING_NEAR, 0, 2, PingStatus.NOTHING_NEAR, True),
        (PingStatus.OK, 17_600, 2, PingStatus.OK, True),
        (PingStatus.OK, 18_500, 2, PingStatus.NOTHING_NEAR, True),
        (PingStatus.OK, 101, 2, PingStatus.TOO_NEAR, False),
        (PingStatus.TOO_NEAR, 0, 2, PingStatus.TOO_NEAR, False),
        (PingStatus.ABSENT, 0, 2, PingStatus.ABSENT, False),
        (PingStatus.OFF, 0, 255, PingStatus.OFF, False),
        (PingStatus.OK, 5000, 90, PingStatus.OK, False),
    ],
)
def test_ping_says_what_it_does_not_know(
    status: PingStatus, echo_us: int, ticks: int, shown: PingStatus, valid: bool
) -> None:
    ping = observe(ping_echo=echo_us, ping_age=ticks, ping_status=status).ping
    assert ping.status == shown and ping.valid is valid
    assert (ping.distance is not None) is (shown == PingStatus.OK)
    assert (ping.too_near, ping.absent) == (shown == PingStatus.TOO_NEAR, shown == PingStatus.ABSENT)


def test_encoder() -> None:
    status = messages.Status.ENCODER_RIGHT_MASKED
    seen = observe(encoder_left=64, encoder_right=-3, edge_period_left=1250, status=status)
    turn = 2 * math.pi * SHIELDBOT.body.wheel_radius_m
    assert seen.encoder_left.count == 64
    assert seen.encoder_left.distance == pytest.approx(turn)
    assert seen.encoder_left.speed == pytest.approx(turn / 64 / 0.020)
    assert not seen.encoder_left.directed and seen.encoder_left.valid
    assert seen.encoder_right.speed == 0.0 and not seen.encoder_right.valid


def test_quadrature_encoder_knows_direction() -> None:
    quad = Equipment(load_robot("shieldbot-quad"), TICK_S)
    assert Observation(NOTHING, quad, 0.0).encoder_left.directed


def test_servo_is_read_back() -> None:
    seen = observe(pulse_left=1600 * 16, pulse_right=1600 * 16)
    assert (seen.servo_left.pulse_us, seen.servo_left.signal) == (1600.0, 0.5)
    assert seen.servo_right.signal == -0.5, "the right servo is mounted mirrored"
    assert observe().servo_left.pulse_us is None


def without(*devices: str) -> Equipment:
    fewer = {name: device for name, device in SHIELDBOT.device.items() if name not in devices}
    return Equipment(msgspec.structs.replace(SHIELDBOT, device=fewer), TICK_S)


def test_missing_device_is_refused_by_name() -> None:
    equipment = without("ping", "encoder_left")
    robot = robot_seeing(Observation(NOTHING, equipment, 0.0))
    with pytest.raises(BrainError, match="'shieldbot' has no ping"):
        _ = robot.ping
    with pytest.raises(BrainError, match="has no encoder_left"):
        _ = robot.encoder_left
    assert robot.encoder_right.count == 0
    assert equipment.missing(["whiskers", "ping", "encoders"]) == ["ping", "encoder_left"]
    with pytest.raises(BrainError, match="cannot need 'sonar'; expected one of encoders"):
        equipment.missing(["sonar"])


def test_observation_cannot_be_changed() -> None:
    seen = observe(encoder_left=5)
    with pytest.raises(AttributeError):
        seen.time = 2.0  # type: ignore[misc]
    with pytest.raises(AttributeError):
        seen.encoder_left.count = 6  # type: ignore[misc]


def test_commands_hold_until_the_next() -> None:
    robot = robot_seeing(observe())
    assert robot.command.kind == "stop"
    robot.drive(0.5, -1)
    assert robot.command == Command("signal", 0.5, -1)
    robot.drive_speed(0.1, 0.12)
    assert robot.command == Command("speed", 0.1, 0.12)
    robot.stop()
    assert robot.command.kind == "stop"


@pytest.mark.parametrize("wrong", [1.01, -1.01, math.nan, math.inf])
def test_command_out_of_range_is_refused(wrong: float) -> None:
    robot = robot_seeing(observe())
    for call in (robot.drive, robot.drive_speed):
        with pytest.raises(BrainError, match="go from -"):
            call(0.1, wrong)
        with pytest.raises(BrainError, match="go from -"):
            call(wrong, 0.1)
    assert robot.command.kind == "stop"


@pytest.mark.parametrize("wrong", [("a", None), (0.1, None), ("0.1", 0.1), (0.1, [0.1])])
def test_command_that_is_no_number_is_refused(wrong: tuple[float, float]) -> None:
    robot = robot_seeing(observe())
    for call in (robot.drive, robot.drive_speed):
        with pytest.raises(BrainError) as caught:
            call(*wrong)
        assert str(caught.value) == f"{call.__name__}({wrong[0]!r}, {wrong[1]!r}) expects two numbers"
    assert robot.command.kind == "stop"


def test_clock_and_tick() -> None:
    robot = robot_seeing(observe(tick=70_000), period=0.02)
    assert (robot.time, robot.tick, robot.period) == (1.0, 70_000, 0.02)


def test_same_seed_same_chance() -> None:
    a, b, c = (robot_seeing(observe(), seed=seed) for seed in (5, 5, 6))
    rows = [[robot.random.random() for _ in range(5)] for robot in (a, b, c)]
    assert rows[0] == rows[1] != rows[2]


@pytest.mark.parametrize("period", [0.01, 0.05, 0.2])
def test_chance_is_rescaled_to_the_brains_period(period: float) -> None:
    """1 % in each hundredth of a second: the chance of not having happened after 1 s is 0.99^100 at every period."""
    robot = robot_seeing(observe(), period=period)
    seconds, steps = 4000, round(1 / period)
    survived = sum(all(not robot.chance(0.01, per=0.01) for _ in range(steps)) for _ in range(seconds))
    expected = 0.99**100
    assert abs(survived / seconds - expected) < 4 * math.sqrt(expected * (1 - expected) / seconds)


def test_nothing_leads_from_a_robot_to_the_world() -> None:
    """Everything that can be reached by attributes is of the kit's own sensor and description classes."""
    robot = robot_seeing(observe())
    seen: set[int] = set()
    todo: list[object] = [robot]
    while todo:
        thing = todo.pop()
        if id(thing) in seen or isinstance(thing, str | bytes | int | float | type(None)):
            continue
        seen.add(id(thing))
        module = type(thing).__module__
        assert not module.startswith(("sim_bridge", "boebot.link.transport", "boebot.link.link", "boebot.boards"))
        if module.startswith("boebot"):
            for name in dir(thing):
                with contextlib.suppress(BrainError):  # a device that the robot does not have
                    todo += [getattr(thing, name)] if not name.startswith("__") else []
        if isinstance(thing, list | tuple):
            todo += thing
