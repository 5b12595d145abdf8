"""Each part between its pins and the world, on a board that plays a script."""

from __future__ import annotations

import cmath
import itertools
import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.description import robots
from boebot.description.robots import load_robot
from boebot.devices.battery import BatteryDivider
from boebot.devices.infrared import InfraredPair
from boebot.devices.servo import ContinuousServo
from boebot.errors import BoardError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices import battery as battery_model
from sim_bridge.devices import servo as servo_model
from sim_bridge.robots import imperfections
from sim_bridge.tests.simulated import MS, SUPPLY, US, Scripted, arena_of, pack_voltage, scripted, scripts, square

LEFT, RIGHT = 13, 12
ENCODERS = 16, 17
WHISKERS = 5, 7
LED, RECEIVER = 9, 10
PING = 8
RPM = 2 * math.pi / 60
WHEEL = 0.0331


def servo(**changes: float) -> Any:
    robot = load_robot("shieldbot")
    device = robot.device["servo_left"]
    assert isinstance(device, ContinuousServo)
    parameters = servo_model.servo_parameters(device, robot.body, 0, imperfections.Draw(1, noise=False))
    for key, value in changes.items():
        setattr(parameters, key, value)
    return parameters


# ---- servo -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("offset_us", "rpm"),
    [(-200, -50), (-100, -45), (-52, -30), (-30, -15), (0, 0), (26, 15), (50, 30), (100, 45), (200, 50)],
)
def test_servo_follows_the_measured_curve(offset_us: float, rpm: float) -> None:
    """The first of two measured servos; the fit is within 4 rpm of every measured point."""
    speed = lib.servo_motor_curve(servo(), 1500 + offset_us)
    assert speed / WHEEL / RPM == pytest.approx(rpm, abs=4)
    assert speed / WHEEL / RPM == pytest.approx(51.25 * math.tanh(offset_us / 78.5), abs=1e-6)


def test_servo_dead_band_and_centre() -> None:
    unit = servo(centre_us=1490.0)
    assert lib.servo_motor_curve(unit, 1490 + 8.9) == 0 == lib.servo_motor_curve(unit, 1490 - 8.9)
    assert lib.servo_motor_curve(unit, 1490 + 9.1) > 0 > lib.servo_motor_curve(unit, 1490 - 9.1)
    assert lib.servo_motor_curve(unit, 1500) > 0


def test_servo_may_be_weaker_one_way() -> None:
    """Unit B: 36 rpm forward, 30 backward."""
    unit = servo(top_ccw_rad_s=36 * RPM, scale_ccw_us=50.5, top_cw_rad_s=30 * RPM, scale_cw_us=43.5)
    assert lib.servo_motor_curve(unit, 1600) / WHEEL / RPM == pytest.approx(35.8, abs=1.5)
    assert lib.servo_motor_curve(unit, 1400) / WHEEL / RPM == pytest.approx(-30.7, abs=1.5)


@pytest.mark.parametrize("offset_us", [20, 60, 200, -60])
def test_robot_reaches_the_speed_of_the_curve(offset_us: float) -> None:
    """Both wheels forward: the right servo is mounted mirrored. Damping takes 1.6 %, (3.15)."""
    robot = scripted()
    robot.pulses(2.0, {LEFT: 1500 + offset_us, RIGHT: 1500 - offset_us})
    robot.run(2.0)
    expected = lib.servo_motor_curve(servo(), 1500 + offset_us)
    a, gain, alpha = lib.body_a(imperfections.body_parameters(robot.robot.description.body)), 1.2, 1.0
    assert robot.robot.body().speed == pytest.approx(expected * 2 * a * gain / (2 * a * gain + alpha), rel=2e-3)
    assert abs(robot.robot.body().heading) < 1e-9


def test_servo_lags() -> None:
    """63 % of the speed 50 to 80 ms after the first pulse has ended."""
    robot = scripted()
    robot.pulses(1.0, {LEFT: 1700, RIGHT: 1300})
    robot.run(1.0)
    truth = robot.robot.truth()
    rise = float(np.interp(0.63 * truth["speed"][-1], truth["speed"], truth["time"]))
    assert 0.050 <= rise - 0.0017 <= 0.080


def test_without_pulses_it_rolls_out_and_is_free() -> None:
    robot = scripted()
    robot.pulses(1.0, {LEFT: 1700, RIGHT: 1300})
    robot.run(1.0)
    assert robot.robot.body().speed > 0.15
    robot.run(0.5)
    assert abs(robot.robot.body().speed) < 0.001


@pytest.mark.parametrize("width_us", [100, 400, 2600, 5000])
def test_what_is_no_pulse_is_ignored(width_us: float) -> None:
    robot = scripted()
    robot.pulses(0.5, {LEFT: width_us, RIGHT: width_us})
    robot.run(0.5)
    assert robot.robot.body().distance == 0


def test_pulse_that_a_reset_cuts_short_still_twitches() -> None:
    """Released in mid-pulse, the line falls: the servo takes the 700 us that it saw."""
    robot = scripted()
    robot.edge(1000, LEFT, 1)
    robot.edge(1000 + 700 * US, LEFT, 2)
    robot.run(0.1)
    assert robot.robot.body().wheel_left < -0.01


def supplied(**supply: float) -> robots.RobotDescription:
    """The shieldbot with another pack."""
    robot = load_robot("shieldbot")
    assert robot.supply is not None
    return msgspec.structs.replace(robot, supply=msgspec.structs.replace(robot.supply, **supply))


def test_weak_supply_slows_the_servos() -> None:
    def speed(**supply: float) -> float:
        robot = scripted(robot=supplied(**supply))
        robot.pulses(1.0, {LEFT: 1700, RIGHT: 1300})
        robot.run(1.0)
        return float(robot.robot.body().speed)

    assert 0.70 * speed() < speed(full_v=4.9, empty_v=4.5) < 0.90 * speed()


def test_units_differ_by_seed_and_keep_their_nature() -> None:
    robot = load_robot("shieldbot")
    device = robot.device["servo_left"]
    assert isinstance(device, ContinuousServo)

    def unit(seed: int, side: int) -> float:
        draw = imperfections.Draw(seed, noise=True)
        return float(servo_model.servo_parameters(device, robot.body, side, draw).top_ccw_rad_s)

    assert unit(1, 0) == unit(1, 0)
    assert len({unit(seed, side) for seed in range(5) for side in (0, 1)}) == 10
    spread = np.std([unit(seed, 0) for seed in range(400)]) / (imperfections.AS_BUILT["servo_top_rpm"] * RPM)
    assert spread == pytest.approx(math.hypot(0.025, 0.015), rel=0.15)


# ---- encoder ---------------------------------------------------------------------------------------------


def edges(robot: Scripted, pin: int) -> list[tuple[int, int]]:
    """Changes of level on an encoder pin, without the one that sets it at the start."""
    return robot.inputs(pin)[1:]


@given(st.integers(-200, 200).filter(lambda o: abs(o) > 10), st.integers(-200, 200).filter(lambda o: abs(o) > 10))
def test_encoder_edges_are_the_wheels_angle(left_us: int, right_us: int) -> None:
    robot = scripted()
    robot.pulses(1.0, {LEFT: 1500 + left_us, RIGHT: 1500 - right_us})
    robot.run(1.0)
    body = robot.robot.body()
    for pin, angle in zip(ENCODERS, (body.wheel_left, body.wheel_right), strict=True):
        # The disc starts half way between two edges; those of the last 4 us are still to come.
        expected = abs(math.floor(angle * 64 / (2 * math.pi) + 0.5))
        assert abs(len(edges(robot, pin)) - expected) <= 1
        levels = [level for _, level in robot.inputs(pin)]
        assert all(a != b for a, b in itertools.pairwise(levels))


def test_encoder_edges_come_at_exact_times() -> None:
    """At steady speed the periods are equal, far finer than the world's step, and those of the speed."""
    robot = scripted()
    robot.pulses(3.0, {LEFT: 1600, RIGHT: 1400})
    robot.run(3.0)
    periods = np.diff([cycle for cycle, _ in edges(robot, 16)][-20:])
    expected = 2 * math.pi * WHEEL / 64 / robot.robot.body().speed * CLOCK_HZ
    assert periods == pytest.approx(expected, abs=3)


def test_encoder_edges_do_not_come_late() -> None:
    """Every edge was queued ahead of the board: its stamp is not that of the step's begin."""
    robot = scripted()
    robot.pulses(1.0, {LEFT: 1700, RIGHT: 1300})
    robot.run(1.0)
    assert len({cycle % (1 * MS) for cycle, _ in edges(robot, 16)}) > 0.9 * len(edges(robot, 16))


@pytest.mark.parametrize("forward", [True, False])
def test_quadrature_tells_the_direction(forward: bool) -> None:
    """A leads B forward; decoded by the notes' table, every step is one count of the same sign."""
    robot = scripted(robot=load_robot("shieldbot-quad"))
    way = 100 if forward else -100
    robot.pulses(1.0, {LEFT: 1500 + way, RIGHT: 1500 - way})
    robot.run(1.0)
    table = [0, -1, 1, None, 1, 0, None, -1, -1, None, 0, 1, None, 1, -1, 0]
    changes = sorted([(*edge, 2) for edge in robot.inputs(14)] + [(*edge, 1) for edge in robot.inputs(15)])
    state = 0
    for _, level, bit in changes[:2]:
        state |= bit if level else 0
    count = 0
    for _, level, bit in changes[2:]:
        following = state | bit if level else state & ~bit
        change = table[state << 2 | following]
        assert change in (-1, 1)
        count += change
        state = following
    assert abs(count - robot.robot.body().wheel_left * 128 / (2 * math.pi)) <= 1
    assert (count > 50) == forward


def bouncing(*, noise: bool) -> list[tuple[int, int]]:
    """A turning wheel's edges, at each of which the sensor goes back and forth up to three times."""
    jittery = msgspec.structs.replace(load_robot("shieldbot"), imperfections={"encoder_bounces": 3.0})
    robot = scripted(robot=jittery, noise=noise, without=("servo_spread", "servo_centre"))
    robot.pulses(2.0, {LEFT: 1600, RIGHT: 1400})
    robot.run(2.0)
    return edges(robot, 16)


def test_encoder_bounces() -> None:
    changes = bouncing(noise=True)
    gaps = np.diff([cycle for cycle, _ in changes])
    within = gaps < 1 * MS  # the wheel's own edges are 20 ms apart
    assert gaps[within].min() > 0 and gaps[within].max() <= 40 * US + 2
    assert gaps[within].mean() == pytest.approx(20 * US, rel=0.1)
    sizes = np.diff(np.flatnonzero(np.append(True, ~within)))  # changes at each of the wheel's edges
    assert set(sizes) == {1, 3, 5, 7}


def test_without_noise_no_encoder_bounces() -> None:
    assert np.diff([cycle for cycle, _ in bouncing(noise=False)]).min() > 10 * MS


# ---- whisker ---------------------------------------------------------------------------------------------


def test_whisker_grounds_its_pin_while_it_touches() -> None:
    arena = arena_of(square(1, 0, 1))  # face at x = 0.5; tips reach 0.1 ahead
    robot = scripted(arena, pose=(0.39, 0, 0))
    robot.run(0.1)
    assert [level for _, level in robot.inputs(5)] == [1]
    robot.robot.place(0.41, 0, 0)
    robot.run(0.1)
    assert [level for _, level in robot.inputs(5)] == [1, 0]
    assert [level for _, level in robot.inputs(7)] == [1, 0]
    robot.robot.place(0, 0, 0)
    robot.run(0.1)
    assert [level for _, level in robot.inputs(5)] == [1, 0, 1]


def test_each_whisker_feels_its_own_side() -> None:
    arena = arena_of([(0.09, 0.05), (0.2, 0.05), (0.2, 0.2), (0.09, 0.2)])
    robot = scripted(arena)
    robot.run(0.01)
    assert [level for _, level in robot.inputs(5)] == [1, 0]
    assert [level for _, level in robot.inputs(7)] == [1]


def test_whisker_bounces_and_settles() -> None:
    flicks = []
    for seed in range(40):
        robot = scripted(arena_of(square(1, 0, 1)), pose=(0.41, 0, 0), noise=True, seed=seed)
        robot.run(0.05)
        for pin in WHISKERS:
            changes = robot.inputs(pin)[1:]
            assert changes[-1][1] == 0
            assert changes[-1][0] - changes[0][0] <= 10 * MS + 1
            assert len(changes) % 2 == 1
            flicks.append(len(changes) // 2)
    assert 0 < sum(flicks) / len(flicks) < 4
    assert min(flicks) == 0 < max(flicks)


# ---- IR pair ---------------------------------------------------------------------------------------------


def before_wall(distance: float, noise: bool = False, seed: int = 1) -> Scripted:
    """A wall across the left pair's beam at that distance from the pair."""
    robot = load_robot("shieldbot")
    pair = robot.device["infrared_left"]
    assert isinstance(pair, InfraredPair)
    x, y = pair.position_m
    wall_y = y + distance  # turned so that the pair looks along +y
    arena = arena_of([(-2, wall_y), (2, wall_y), (2, wall_y + 0.1), (-2, wall_y + 0.1)])
    heading = math.pi / 2 - pair.heading_rad
    px = x * math.cos(heading) - y * math.sin(heading)
    py = x * math.sin(heading) + y * math.cos(heading)
    return scripted(arena, pose=(-px, y - py, heading), noise=noise, seed=seed)


def seen_from(distance: float, period: int = 421, cycles: int = 38, noise: bool = False, seed: int = 1) -> Scripted:
    """A burst of the left LED with a wall across its beam at that distance from the pair."""
    scene = before_wall(distance, noise, seed)
    scene.burst(1 * MS, LED, period, cycles)
    scene.run(0.01)
    return scene


@pytest.mark.parametrize(
    ("distance", "expected"), [(0.03, True), (0.15, True), (0.195, True), (0.205, False), (0.6, False)]
)
def test_infrared_sees_what_is_in_range(distance: float, expected: bool) -> None:
    levels = [level for _, level in seen_from(distance).inputs(RECEIVER)]
    assert levels == ([1, 0, 1] if expected else [1])


def test_infrared_output_follows_the_burst() -> None:
    """Low from the eighth period of the carrier until ten periods after its end."""
    low, high = seen_from(0.1).inputs(RECEIVER)[1:]
    assert low == (1 * MS + 8 * 421, 0)
    assert high == (1 * MS + 37 * 421 + 4210, 1)


@pytest.mark.parametrize(("cycles", "expected"), [(7, False), (8, False), (9, True)])
def test_infrared_needs_eight_periods(cycles: int, expected: bool) -> None:
    assert (len(seen_from(0.1, cycles=cycles).inputs(RECEIVER)) > 1) == expected


@pytest.mark.parametrize(
    ("kilohertz", "distance", "expected"),
    [
        (38.5, 0.2, True),
        (40, 0.13, True),
        (40, 0.15, False),
        (42, 0.085, True),
        (42, 0.1, False),
        (30, 0.03, False),
    ],
)
def test_infrared_zones_by_frequency(kilohertz: float, distance: float, expected: bool) -> None:
    """Half the sensitivity at 40 kHz, a fifth at 42: light falls with the square of the distance."""
    period = round(16_000 / kilohertz)
    assert (len(seen_from(distance, period=period).inputs(RECEIVER)) > 1) == expected


def filtered(edges: list[int]) -> float:
    """What a receiver's filter is left with at the last edge: two poles at 38.5 kHz, half of the peak at 40 kHz."""
    detuning = 40 / 38.5 - 38.5 / 40
    quality = math.sqrt(3) / detuning  # |1 + i quality detuning| = 2
    pole = 2 * math.pi * 38_500 / 16e6 * complex(-0.5 / quality, 1)
    state = 0j
    for i, (begin, end) in enumerate(itertools.pairwise(edges)):
        decay = cmath.exp(pole * (end - begin))
        state = state * decay + (i % 2 == 0) * (decay - 1) / pole
    return abs(state)


@pytest.mark.parametrize(
    ("late", "cycles"),
    [(range(i, i + 1), 90) for i in range(76)] + [(range(i, 76, 8), 65) for i in range(8)],
    ids=str,
)
def test_infrared_hears_a_carrier_whose_toggles_come_late_as_a_filter_does(late: range, cycles: int) -> None:
    """At 40 kHz, when the burst ends. Nearer to the reach of such a filter than 4 % it may be either."""
    on_time = [200 * i for i in range(76)]
    edges = [at + cycles * (i in late) for i, at in enumerate(on_time)]
    reach = 0.2 * math.sqrt(0.5 / 0.97 * filtered(edges) / filtered(on_time))
    for distance in (0.96 * reach, 1.04 * reach):
        scene = before_wall(distance)
        for i, at in enumerate(edges):
            scene.edge(1 * MS + at, LED, 1 - i % 2)
        scene.run(0.01)
        at_end = [level for cycle, level in scene.inputs(RECEIVER) if cycle <= 1 * MS + edges[-1]][-1]
        assert at_end == (0 if distance < reach else 1)


def test_infrared_beam_is_narrow() -> None:
    """What stands beside the beam is not seen."""
    robot = scripted(arena_of(square(0.05, -0.14, 0.1)))  # to the right of the robot, close
    robot.burst(1 * MS, LED)
    robot.run(0.01)
    assert len(robot.inputs(RECEIVER)) == 1


def test_infrared_hears_every_burst() -> None:
    robot = scripted(arena_of(square(0.3, 0.15, 0.2)))
    for i in range(5):
        robot.burst((1 + 50 * i) * MS, LED)
    robot.run(0.3)
    assert [level for _, level in robot.inputs(RECEIVER)] == [1] + 5 * [0, 1]


def test_infrared_false_hits_are_rare() -> None:
    robot = scripted(noise=True)
    for i in range(4000):
        robot.burst((1 + 3 * i) * MS, LED, cycles=10)
    robot.run(12.1)
    assert 0 < len(robot.inputs(RECEIVER)) // 2 < 15  # 4 expected


# ---- Ping ------------------------------------------------------------------------------------------------


def ping_at(
    distance: float | None, trigger_us: float = 5.0, noise: bool = False, seed: int = 1
) -> list[tuple[int, int]]:
    """What the sensor does to the pin after a trigger at 1 ms, facing a wall at that distance."""
    x = 0.06 + (0 if distance is None else distance)
    arena = arena_of() if distance is None else arena_of([(x, -3), (x + 0.1, -3), (x + 0.1, 3), (x, 3)])
    robot = scripted(arena, pose=(0, 0, 0), noise=noise, seed=seed)
    robot.edge(1 * MS, PING, 1)
    robot.edge(1 * MS + round(trigger_us * US), PING, 2)
    robot.run(0.05)
    return robot.inputs(PING)


def echo_us(answer: list[tuple[int, int]]) -> float:
    (rise, high), (fall, low) = answer[:2]
    assert (high, low) == (1, 0)
    assert rise == 1 * MS + 5 * US + 750 * US
    return (fall - rise) / US


@pytest.mark.parametrize("distance", [0.05, 0.10, 0.50, 1.00, 2.00, 2.99])
def test_echo_time_is_the_way_of_sound(distance: float) -> None:
    """At 20 degrees Celsius c = 343.5 m/s; (notes: t = 2 d / c)."""
    assert echo_us(ping_at(distance)) == pytest.approx(2 * distance / 343.5 * 1e6, abs=0.1)


def test_echo_has_its_limits() -> None:
    assert echo_us(ping_at(0.011)) == pytest.approx(2 * 0.02 / 343.5 * 1e6, abs=0.1)
    assert echo_us(ping_at(3.01)) == 18_500
    assert echo_us(ping_at(None)) == 18_500


@pytest.mark.parametrize(
    ("trigger_us", "expected"), [(1.9, False), (2.0, True), (5.0, True), (900.0, True), (1100.0, False)]
)
def test_trigger_is_a_short_pulse(trigger_us: float, expected: bool) -> None:
    assert bool(ping_at(1.0, trigger_us)) == expected


def test_pin_is_let_go_and_rests_between_pings() -> None:
    robot = scripted()
    for at in (
        1.0,
        10.0,
        20.4,
        40.0,
    ):  # ms; the second while it listens, the third 0.2 ms after the echo's end
        robot.edge(round(at * MS), PING, 1)
        robot.edge(round(at * MS) + 5 * US, PING, 2)
    robot.run(0.08)
    answers = robot.inputs(PING)
    rises = [cycle for cycle, level in answers if level == 1]
    assert rises == [round(at * MS) + 755 * US for at in (1.0, 40.0)]
    assert [level for _, level in answers] == 2 * [1, 0, 2]


def test_flat_surfaces_send_nothing_back() -> None:
    """A wall met at 60 degrees to its normal, all over the beam."""

    def echo(turn: float) -> float:
        c, s = math.cos(turn), math.sin(turn)
        corners = [(0.5, -5), (0.6, -5), (0.6, 5), (0.5, 5)]
        arena = arena_of([(c * x - s * y, s * x + c * y) for x, y in corners])
        robot = scripted(arena, pose=(0, 0, 0))
        robot.edge(1 * MS, PING, 1)
        robot.edge(1 * MS + 5 * US, PING, 2)
        robot.run(0.05)
        return echo_us(robot.inputs(PING))

    assert echo(0.3) < 4000
    assert echo(math.radians(70)) == 18_500


def test_missed_echoes_and_spread() -> None:
    """p = 0.98, and readings spread by (3.1)."""
    arena = arena_of([(1.06, -3), (1.2, -3), (1.2, 3), (1.06, 3)])
    robot = scripted(arena, noise=True, seed=3)
    count = 3000
    for i in range(count):
        robot.edge((1 + 25 * i) * MS, PING, 1)
        robot.edge((1 + 25 * i) * MS + 5 * US, PING, 2)
    robot.run(0.025 * count)
    answers = robot.inputs(PING)
    assert len(answers) == 3 * count
    echoes = np.array([(answers[i + 1][0] - answers[i][0]) / US for i in range(0, 3 * count, 3)])
    heard = echoes[echoes < 18_000]
    assert 1 - len(heard) / count == pytest.approx(0.02, abs=0.008)
    assert heard.mean() == pytest.approx(2 / 343.5 * 1e6, rel=0.001)
    assert heard.std() / heard.mean() == pytest.approx(0.005, rel=0.1)


# ---- battery ---------------------------------------------------------------------------------------------


def test_pack_sags_under_load_and_the_regulator_holds() -> None:
    robot = scripted()
    idle = pack_voltage(robot.robot)
    assert idle == pytest.approx(7.75 - 0.6 * 0.08, abs=1e-3)
    robot.pulses(1.0, {LEFT: 1700, RIGHT: 1300})
    robot.run(1.0)
    steady = pack_voltage(robot.robot)
    assert steady == pytest.approx(7.75 - 0.6 * (0.08 + 2 * (0.015 + 0.13)), abs=0.03)
    robot.pulses(0.5, {LEFT: 1300, RIGHT: 1700}, start=1.0)
    lowest = idle
    for _ in range(50):
        robot.run(0.01)
        lowest = min(lowest, pack_voltage(robot.robot))
        assert robot.robot.supply_voltage == 5.0
    assert lowest < steady - 0.1  # reversing costs most


def test_voltage_at_the_analog_pin() -> None:
    robot = load_robot("shieldbot")
    with_battery = {**robot.device, "battery": BatteryDivider(pin="A0")}
    scene = scripted(robot=msgspec.structs.replace(robot, device=with_battery))
    assert scripts.script_board_volts(scene.script, 0) == pytest.approx((7.75 - 0.6 * 0.08) / 2, abs=1e-3)
    assert scripts.script_board_volts(scene.script, 1) == 0
    assert scripts.script_board_volts(scripted().script, 0) == 0


def test_charge_runs_out() -> None:
    parameters = battery_model.battery_parameters(SUPPLY)
    parameters.supply.capacity_as = 1.0
    robot = scripted()
    assert lib.robot_add_battery(robot.robot.handle, 255, parameters) == 0
    robot.run(20.0)
    assert pack_voltage(robot.robot) == pytest.approx(5.0 - 0.6 * 0.08)
    assert robot.robot.supply_voltage == pytest.approx(4.5 - 0.6 * 0.08)


def test_supply_of_the_board_is_the_regulator_or_what_a_test_holds() -> None:
    robot = scripted()
    supply = 128  # BOARD_ANALOG_SUPPLY
    assert scripts.script_board_volts(robot.script, supply) == 5.0
    parameters = battery_model.battery_parameters(SUPPLY)
    parameters.supply.capacity_as = 1.0
    assert lib.robot_add_battery(robot.robot.handle, 255, parameters) == 0
    robot.run(20.0)
    # an empty pack of 5.0 V, sagging under the board's 0.08 A, less the drop-out of 0.5 V
    assert scripts.script_board_volts(robot.script, supply) == pytest.approx(5.0 - 0.6 * 0.08 - 0.5)
    robot.pins.supply(3.9)
    assert scripts.script_board_volts(robot.script, supply) == pytest.approx(3.9)
    robot.run(0.1)
    assert scripts.script_board_volts(robot.script, supply) == pytest.approx(3.9)
    assert robot.robot.supply_voltage == pytest.approx(3.9)
    robot.pins.supply(None)
    assert scripts.script_board_volts(robot.script, supply) == pytest.approx(4.452)
    with pytest.raises(BoardError):
        robot.pins.supply(-1.0)


def test_board_without_memory_says_so() -> None:
    robot = scripted()
    with pytest.raises(BoardError, match="no data memory"):
        robot.pins.read_memory(0x100, 1)
    with pytest.raises(BoardError, match="no EEPROM"):
        robot.pins.read_eeprom()


def test_pins_of_no_part_are_left_alone() -> None:
    robot = scripted()
    robot.run(0.05)
    driven = {pin for pin in range(20) if robot.inputs(pin)}
    assert driven == {*ENCODERS, *WHISKERS, 10, 3}
    assert scripts.script_board_inputs(robot.script, 99, ffi.NULL, ffi.NULL, 0) == 0


# ---- plugs -----------------------------------------------------------------------------------------------


def ping_twice(robot: Scripted, first_ms: int) -> list[tuple[int, int]]:
    """What a Ping does to its pin after two triggers, 40 ms apart."""
    before = len(robot.inputs(PING))
    for at in (first_ms, first_ms + 40):
        robot.edge(at * MS, PING, 1)
        robot.edge(at * MS + 5 * US, PING, 2)
    robot.run(0.08)
    return robot.inputs(PING)[before:]


def test_an_unplugged_ping_neither_hears_nor_answers() -> None:
    robot = scripted()
    assert len(ping_twice(robot, 1)) == 6
    robot.pins.unplug("ping")
    assert ping_twice(robot, 81) == []
    robot.pins.plug("ping")
    assert len(ping_twice(robot, 161)) == 6


def test_a_plug_pulled_in_mid_pulse_ends_it() -> None:
    robot = scripted()
    robot.edge(1 * MS, PING, 1)
    robot.edge(1 * MS + 5 * US, PING, 2)
    robot.run(0.005)
    robot.pins.unplug("ping")
    robot.run(0.05)
    assert [level for _, level in robot.inputs(PING)] == [1, 2]


def test_a_device_may_begin_unplugged() -> None:
    shieldbot = load_robot("shieldbot")
    unplugged = {
        name: msgspec.structs.replace(shieldbot.device[name], plugged=False)
        for name in ("ping", "whisker_left", "servo_left")
    }
    robot = scripted(robot=msgspec.structs.replace(shieldbot, device=shieldbot.device | unplugged))
    robot.pulses(0.2, {LEFT: 1700, RIGHT: 1300})
    robot.run(0.2)
    assert robot.robot.body().wheel_left < 0.1 * robot.robot.body().wheel_right
    assert robot.inputs(5)[-1] == (0, 2)
    assert ping_twice(robot, 201) == []


def test_an_encoder_plugged_in_again_shows_the_level_of_its_disc() -> None:
    robot, other = scripted(), scripted()
    robot.pins.unplug("encoder_left")
    for each in (robot, other):
        each.pulses(0.5, {LEFT: 1700, RIGHT: 1300})
        each.run(0.5)
    assert robot.inputs(16)[-1] == (0, 2)
    robot.pins.plug("encoder_left")
    robot.run(0.0001)
    assert robot.inputs(16)[-1][1] == other.inputs(16)[-1][1]


def test_no_plug_of_what_the_robot_lacks() -> None:
    for device in ("laser", "buzzer"):  # the second one is off: it has no part
        with pytest.raises(BoardError, match=f"device '{device}': the robot has no such thing"):
            scripted().pins.unplug(device)
