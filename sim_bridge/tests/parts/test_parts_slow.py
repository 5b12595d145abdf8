"""Light sensor, analog infrared, turret, and what encoders get wrong, at the pins of a scripted board."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from boebot.arenas import Arena
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.light import LightSensor
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices import analog_infrared as analog_infrared_model
from sim_bridge.devices import encoder as encoder_model
from sim_bridge.devices import light as light_model
from sim_bridge.devices.catalogue import Part
from sim_bridge.robots import imperfections
from sim_bridge.robots.wiring import add_part
from sim_bridge.tests.simulated import MS, US, Scripted, arena_of, scripted, scripts, shortest_ray, square, turret_angle

LIGHT, TURRET, PING = 6, 11, 8
LIGHT_SENSOR = LightSensor(pin=LIGHT, position_m=(0.0, 0.0), heading_rad=0.0)
SHARP = SharpSensor(pin="A2", position_m=(0.06, 0.0), heading_rad=0.0)
RELEASED = 2
ON, OFF = imperfections.Draw(1, noise=True), imperfections.Draw(1, noise=False)


# ---- light sensor ----------------------------------------------------------------------------------------


def lit(arena: Arena, heading: float = 0.0, **changes: float) -> Scripted:
    """A robot with one phototransistor at its middle that looks straight ahead."""
    parameters = light_model.light_parameters(LIGHT_SENSOR, 0, OFF)
    for name, value in changes.items():
        setattr(
            next(part for part in (parameters.light, parameters.capacitor, parameters) if hasattr(part, name)),
            name,
            value,
        )
    robot = scripted(arena, pose=(0, 0, heading))
    assert add_part(robot.robot.handle, Part("light_kind", 0, [LIGHT], parameters)) == 0
    return robot


def lamp_at(x: float, y: float, power: float, *obstacles: list[tuple[float, float]]) -> Arena:
    arena = arena_of(*obstacles)
    assert lib.arena_add_light(arena.handle, x, y, 1.0, power) >= 0
    lib.arena_build(arena.handle)
    return arena


def decay(robot: Scripted, charge_us: float = 100.0) -> float:
    """Seconds from letting go to the low level."""
    robot.edge(1 * MS, LIGHT, 1)
    let_go = 1 * MS + round(charge_us * US)
    robot.edge(let_go, LIGHT, RELEASED)
    robot.run(0.3)
    changes = [(cycle, level) for cycle, level in robot.inputs(LIGHT) if cycle >= let_go]
    return (changes[-1][0] - let_go) / CLOCK_HZ if changes[-1][1] == 0 else math.inf


@pytest.mark.parametrize("ambient", [0.5, 1.0, 2.0, 4.0])
def test_decay_time_is_inverse_to_the_light(ambient: float) -> None:
    """A constant current from a full charge: t = decay_s / L; 1.5 ms in a room (Parallax's book
    on the robot, chapter 6: 1 to 2 ms)."""
    assert decay(lit(arena_of(), ambient=ambient)) == pytest.approx(0.0015 / ambient, abs=1e-6)


def test_a_lamp_counts_by_its_distance_and_direction() -> None:
    """L = ambient + P cos(theta) / (d0^2 + d^2), world/sensors/light.h."""
    for heading, facing in ((0.0, 1.0), (1.0, math.cos(1.0)), (math.pi, 0.0)):
        robot = lit(lamp_at(2.0, 0.0, 8.0), heading)
        expected = 0.0015 / (1.0 + 8.0 * facing / (0.05**2 + 4.0))
        assert decay(robot) == pytest.approx(expected, abs=1e-6)


def test_an_obstacle_casts_a_shadow() -> None:
    shadow = decay(lit(lamp_at(2.0, 0.0, 8.0, square(1.0, 0.0, 0.4))))
    assert shadow == pytest.approx(0.0015, abs=1e-6)


def test_darkness_ends_with_the_leakage() -> None:
    assert decay(lit(arena_of(), ambient=0.0)) == pytest.approx(0.2, abs=1e-5)


@pytest.mark.parametrize("charge_us", [0.5, 1.0, 2.0, 5.0, 20.0])
def test_what_was_not_charged_in_full_decays_sooner(charge_us: float) -> None:
    """5 V (1 - exp(-t / RC)), RC = 2.2 us, falls to the threshold of 2.1 V in a straight line."""
    volts = 5.0 * (1.0 - math.exp(-charge_us / 2.2))
    expected = max(0.0, (volts - 2.1) / (5.0 - 2.1) * 0.0015)
    assert decay(lit(arena_of()), charge_us) == pytest.approx(expected, abs=1e-6)


def test_charging_again_takes_back_the_decay() -> None:
    robot = lit(arena_of())
    robot.edge(1 * MS, LIGHT, 1)
    robot.edge(2 * MS, LIGHT, RELEASED)
    robot.edge(2 * MS + 500 * US, LIGHT, 1)
    robot.edge(4 * MS, LIGHT, RELEASED)
    robot.run(0.02)
    lows = [cycle for cycle, level in robot.inputs(LIGHT) if level == 0 and cycle > 0]  # at first it is empty
    assert lows == pytest.approx([4 * MS + 1500 * US], abs=20)


# ---- analog infrared -------------------------------------------------------------------------------------


def sharp_before(distance: float, draw: imperfections.Draw = OFF) -> Scripted:
    """A robot that looks at a wall from that distance."""
    x = 0.06 + distance
    robot = scripted(arena_of([(x, -3), (x + 0.1, -3), (x + 0.1, 3), (x, 3)]), pose=(0, 0, 0))
    parameters = analog_infrared_model.analog_infrared_parameters(SHARP, draw)
    assert add_part(robot.robot.handle, Part("analog_infrared_kind", 0, ["A2"], parameters)) == 0
    return robot


@pytest.mark.parametrize("distance", [0.1, 0.15, 0.3, 0.5, 0.8])
def test_voltage_falls_with_the_distance(distance: float) -> None:
    """V = 33.9 / (d + 4.74), d in cm, fitted to the curve of the data sheet (Sharp GP2D12)."""
    robot = sharp_before(distance)
    robot.run(0.1)
    assert scripts.script_board_volts(robot.script, 2) == pytest.approx(33.9 / (100 * distance + 4.74), rel=1e-9)
    assert scripts.script_board_volts(robot.script, 1) == 0


def test_near_things_look_far() -> None:
    near, far = sharp_before(0.03), sharp_before(0.1)
    for robot in (near, far):
        robot.run(0.1)
    assert scripts.script_board_volts(near.script, 2) < 0.5 * scripts.script_board_volts(far.script, 2)


def test_a_new_value_every_38_ms_at_any_time_of_asking_and_7_6_ms_late() -> None:
    """The robot is put nearer at 50 ms: the measurement at 76.6 ms is the first that knows, out at 84.2 ms."""
    robot = sharp_before(0.8)
    robot.run(0.05)
    before = scripts.script_board_volts(robot.script, 2)
    robot.robot.place(0.4, 0, 0)
    seen = []
    for _ in range(60):
        robot.run(0.001)
        seen.append((robot.sim.cycle / CLOCK_HZ, scripts.script_board_volts(robot.script, 2)))
    change = next(time for time, volts in seen if volts != before)
    assert change == pytest.approx(2 * 0.0383 + 0.0076, abs=0.0011)
    silent = sharp_before(0.8)  # nobody asks until the end
    silent.run(0.05)
    silent.robot.place(0.4, 0, 0)
    silent.run(0.06)
    assert scripts.script_board_volts(silent.script, 2) == seen[-1][1]


# ---- turret ----------------------------------------------------------------------------------------------


def with_turret(arena: Arena, width_us: float, seconds: float = 1.0) -> Scripted:
    """A robot whose Ping sits on a turret at (0.045, 0); pulses of that width, then a ping."""
    robot = scripted(arena, pose=(0, 0, 0))
    parameters = ffi.new("turret_parameters *", {"x": 0.045})
    lib.motor_position_default(ffi.addressof(parameters.motor))
    assert add_part(robot.robot.handle, Part("turret_kind", 0, [TURRET], parameters)) == 0
    assert lib.robot_mount(robot.robot.handle, TURRET, PING) == 0
    robot.pulses(seconds, {TURRET: width_us})
    robot.run(seconds)
    return robot


def pinged(robot: Scripted) -> float:
    """The distance that it then has (m; -1: none)."""
    at = robot.sim.cycle + 1 * MS
    robot.edge(at, PING, 1)
    robot.edge(at + 5 * US, PING, RELEASED)
    robot.run(0.03)
    return robot.robot.readings()[robot.robot.layout["ping"]][0]


@pytest.mark.parametrize("degrees", [-60, -30, 0, 30, 45, 90])
def test_the_mounts_heading_follows_the_turret(degrees: float) -> None:
    """500 us for 45 degrees; the Ping sits 15 mm before the axis and goes round it."""
    robot = with_turret(arena_of(outline=square(0, 0, 4)), 1500 + 500 * degrees / 45)
    angle = turret_angle(robot.robot, TURRET)
    assert angle == pytest.approx(math.radians(degrees), abs=0.0064)  # its dead band, 4 us
    x, y = 0.045 + 0.015 * math.cos(angle), 0.015 * math.sin(angle)
    assert pinged(robot) == pytest.approx(shortest_ray(2.0, x, y, angle), rel=1e-9)


def test_a_turned_ping_measures_elsewhere() -> None:
    arena = arena_of(square(0.045, 1.0, 0.4), outline=square(0, 0, 8))
    ahead, left = pinged(with_turret(arena, 1500)), pinged(with_turret(arena, 2500))
    assert left == pytest.approx(0.8 - 0.015, abs=0.01)
    assert ahead == -1


def test_turret_turns_at_its_speed() -> None:
    """90 degrees at 5 rad/s, then the exponential of K_s = 20 1/s within 0.25 rad of the end."""
    robot = with_turret(arena_of(), 2500, seconds=0.0)
    robot.pulses(1.0, {TURRET: 2500})
    angles = []
    for _ in range(100):
        robot.run(0.01)
        angles.append(turret_angle(robot.robot, TURRET))
    speeds = np.diff(angles) / 0.01
    assert speeds.max() == pytest.approx(5.0, rel=1e-6)
    arrived = next(i for i, angle in enumerate(angles) if angle > math.pi / 2 - 0.02)
    assert 0.01 * arrived == pytest.approx((math.pi / 2 - 0.25) / 5 + math.log(0.25 / 0.02) / 20, abs=0.03)


def test_only_what_is_there_can_be_mounted() -> None:
    robot = scripted()
    assert lib.robot_mount(robot.robot.handle, TURRET, PING) == lib.SIM_BAD_ARGUMENT
    assert turret_angle(robot.robot, TURRET) == 0


# ---- encoders that err -----------------------------------------------------------------------------------


def turning(missed: float, extra: float, noise: bool = True) -> tuple[int, int]:
    """Edges that the left encoder shows in 20 s at full speed, and those that the wheel's angle has."""
    robot = scripted(noise=noise)
    parameters = encoder_model.encoder_parameters(64)
    parameters.missed, parameters.extra = missed, extra
    assert add_part(robot.robot.handle, Part("encoder_kind", 0, [2, 255], parameters)) == 0
    robot.pulses(20.0, {13: 1700, 12: 1300})
    robot.run(20.0)
    levels = [level for _, level in robot.inputs(2)]
    assert all(a != b for a, b in itertools.pairwise(levels))
    return len(levels) - 1, round(robot.robot.body().wheel_left * 64 / (2 * math.pi))


def test_without_errors_every_edge_is_there() -> None:
    shown, true = turning(0.0, 0.0)
    assert abs(shown - true) <= 1


def test_missed_edges_take_their_neighbours_with_them() -> None:
    """A pulse is lost with probability p per edge that would have begun it: a share 2 p / (1 + p) of the edges."""
    shown, true = turning(0.2, 0.0)
    assert shown % 2 == true % 2 or abs(shown - true) > 1
    assert shown / true == pytest.approx(1 - 2 * 0.2 / 1.2, abs=0.05)


def test_flickers_add_two_edges_each() -> None:
    shown, true = turning(0.0, 0.1)
    assert shown / true == pytest.approx(1.2, abs=0.05)


def test_errors_need_noise() -> None:
    shown, true = turning(0.2, 0.2, noise=False)
    assert abs(shown - true) <= 1
