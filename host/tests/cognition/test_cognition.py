"""Cognitive processes, each alone: readings in, what it makes of them against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boebot.behaviors import Stop
from boebot.brain import Brain, CognitiveProcess, MotorBehavior
from boebot.cognition import (
    BatteryLevel,
    Contact,
    Drift,
    LightSense,
    Odometry,
    Proximity,
    StuckDetector,
    SunCompass,
    contact,
    near,
    nearness_ahead,
    sun_azimuth,
    wrapped,
)
from boebot.errors import BrainError
from boebot.link.messages import CompassStatus, PingStatus
from steps import ANYTHING, FULL, QUAD, Stepped, SteppedVehicle, alone

RADIUS = QUAD.body.wheel_radius_m
TRACK = QUAD.body.track_width_m
EDGE_M = 2 * math.pi * RADIUS / 64  # single-channel encoders of the shieldbot
angles = st.floats(-1e4, 1e4)


class Driven(MotorBehavior):
    """Drives with the signals that a test gives."""

    signals = (0.0, 0.0)

    def step(self, robot: object) -> None:
        robot.drive(*self.signals)  # type: ignore[attr-defined]


# ---- odometry -----------------------------------------------------------------------------------------------------


def test_midpoint_rule_comes_to_the_exact_arc_with_the_square_of_the_step() -> None:
    """A circle's arc: x = R sin φ, y = R (1 - cos φ). The rule's chord is the step s, not 2 (s/φ) sin(φ/2): its
    error is φ²/24 of the way, φ the angle of a step."""
    edges_per_turn = QUAD.device["encoder_left"].edges_per_turn  # type: ignore[attr-defined]
    edge = 2 * math.pi * RADIUS / edges_per_turn
    for left, right in ((20, 40), (40, 20), (-20, 40), (-30, -10)):
        odometry, stepped = Odometry(use="encoders"), Stepped(description=QUAD)
        brain = alone(Stop(), odometry)
        for index in range(61):
            stepped.step(brain, encoder_left=left * index, encoder_right=right * index)
        turn = (right - left) * edge / TRACK  # of a step
        way = (right + left) / 2 * edge
        radius = way / turn
        x, y = radius * math.sin(60 * turn), radius * (1 - math.cos(60 * turn))
        assert odometry.heading == pytest.approx(wrapped(60 * turn), abs=1e-9)
        bound = abs(60 * way) * turn**2 / 24 * 1.1 + 1e-12
        assert math.dist(odometry.position, (x, y)) < bound
        assert odometry.travelled == pytest.approx(abs(60 * way))
        assert odometry.speed == pytest.approx(way / 0.01)
        assert odometry.turn_rate == pytest.approx(turn / 0.01)


def test_single_channel_encoders_take_their_sign_from_the_signals() -> None:
    """Backward counts after 0.06 s of backward commands (docs/decisions/0002): the first of it is lost."""
    odometry, stepped = Odometry(use="encoders"), Stepped()
    brain, count = alone(Stop(), odometry), 0
    stepped.step(brain)
    for signal, steps in ((0.5, 20), (-0.5, 20)):
        for _ in range(steps):
            count += 1
            offset = round(signal * 200)
            stepped.step(
                brain,
                encoder_left=count,
                encoder_right=count,
                pulse_left=(1500 + offset) * 16,
                pulse_right=(1500 - offset) * 16,
            )
    # 20 steps ahead, 5 more of the sign's hold, 15 back
    assert odometry.pose[0] == pytest.approx((20 + 5 - 15) * EDGE_M)
    assert odometry.travelled == pytest.approx(40 * EDGE_M)


@given(st.integers(-(2**31), 2**31 - 1), st.lists(st.integers(-50, 50), min_size=1, max_size=12))
@settings(max_examples=60)
def test_encoder_counters_may_roll_over(start: int, moves: list[int]) -> None:
    odometry, stepped = Odometry(use="encoders"), Stepped(description=QUAD)
    brain, count = alone(Stop(), odometry), start
    stepped.step(brain, encoder_left=count, encoder_right=count)
    for move in moves:
        count = (count + move + 2**31) % 2**32 - 2**31
        stepped.step(brain, encoder_left=count, encoder_right=count)
    edge = 2 * math.pi * RADIUS / QUAD.device["encoder_left"].edges_per_turn  # type: ignore[attr-defined]
    assert odometry.pose == pytest.approx((sum(moves) * edge, 0.0, 0.0), abs=1e-9)


def test_commanded_speed_stands_in_for_encoders() -> None:
    """A step to signal s: x = v (t - τ (1 - e^(-t/τ))), v = s V, τ = 0.065 s."""
    odometry, stepped = Odometry(use="commands"), Stepped()
    brain = alone(Stop(), odometry)
    stepped.step(brain)
    for _ in range(50):
        stepped.step(brain, pulse_left=1600 * 16, pulse_right=1400 * 16)
    v, t, tau = 0.5 * QUAD.body.wheel_speed_maximum_m_s, 0.5, 0.065
    assert odometry.source == "commands"
    assert odometry.pose == pytest.approx((v * (t - tau * (1 - math.exp(-t / tau))), 0.0, 0.0), abs=1e-9)


def test_odometry_takes_the_best_there_is_and_says_so() -> None:
    by_odometer, by_encoders = Odometry(), Odometry()
    SteppedVehicle().steer(alone(Stop(), by_odometer), 0, 0, 1.0, 2.0, 0.5)
    assert by_odometer.source == "odometer" and by_odometer.pose == (1.0, 2.0, 0.5)
    Stepped().step(alone(Stop(), by_encoders))
    assert by_encoders.source == "encoders"
    with pytest.raises(BrainError, match="odometry: robot 'shieldbot' has no odometer"):
        Stepped().step(alone(Stop(), Odometry(use="odometer")))
    with pytest.raises(BrainError, match="odometry: use is 'wheels'; expected one of odometer, encoders, commands"):
        Odometry(use="wheels")  # type: ignore[arg-type]


@given(angles)
def test_wrapped_angles_are_the_same_angle_within_half_a_turn(angle: float) -> None:
    found = wrapped(angle)
    assert -math.pi < found <= math.pi
    assert math.cos(found) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(found) == pytest.approx(math.sin(angle), abs=1e-9)
    assert wrapped(-math.pi) == math.pi


@given(st.lists(angles, min_size=2, max_size=6))
@settings(max_examples=40)
def test_turn_rate_is_of_the_shorter_way_round(headings: list[float]) -> None:
    odometry, vehicle = Odometry(), SteppedVehicle()
    brain = alone(Stop(), odometry)
    vehicle.steer(brain, 0, 0, 0, 0, headings[0])
    for before, heading in pairwise(headings):
        vehicle.steer(brain, 0, 0, 0, 0, heading)
        assert abs(odometry.turn_rate) * 0.01 <= math.pi + 1e-9
        assert math.cos(odometry.turn_rate * 0.01) == pytest.approx(math.cos(heading - before), abs=1e-6)


# ---- what depends on odometry --------------------------------------------------------------------------------------


@given(st.floats(0.1, 50), st.floats(0.0, 100.0))
@settings(max_examples=40)
def test_drift_grows_with_the_way(scale: float, way: float) -> None:
    drift, vehicle = Drift(distance=scale), SteppedVehicle()
    brain = alone(Stop(), Odometry(), drift)
    for share in (0.0, 0.3, 1.0):
        vehicle.steer(brain, 0, 0, way * share)
    assert drift.value == pytest.approx(1 - math.exp(-way / scale), abs=1e-9)
    assert drift.variable().value(vehicle.robot) == drift.value
    drift.set_right()
    assert drift.value == 0.0
    vehicle.steer(brain, 0, 0, way - 1.0)  # backward is way, too
    assert drift.value == pytest.approx(1 - math.exp(-1.0 / scale), abs=1e-6)


@pytest.mark.parametrize(("moves", "share"), [(0.0, 1.0), (0.5, 0.5), (1.0, 0.0)])
def test_a_stuck_robot_lacks_the_share_of_what_was_asked(moves: float, share: float) -> None:
    stuck, vehicle, drive = StuckDetector(), SteppedVehicle(0.05), Driven()
    drive.signals = (0.4, 0.4)
    brain = alone(drive, Odometry(), stuck)
    asked = 0.4 * vehicle.robot.dimensions.speed
    for index in range(60):
        vehicle.steer(brain, 0, 0, moves * asked * 0.05 * index)
        if vehicle.time < 0.8:
            assert stuck.share == 0.0, "too early to know"
    assert stuck.share == pytest.approx(share, abs=0.01)


def test_a_robot_that_turns_or_that_is_asked_nothing_is_not_stuck() -> None:
    for signals, rate in (((-0.4, 0.4), 2 * 0.4 * 1.381 / 0.4), ((0.0, 0.0), 0.0), ((0.05, 0.05), 0.0)):
        stuck, vehicle, drive = StuckDetector(), SteppedVehicle(0.05), Driven()
        drive.signals = signals
        brain = alone(drive, Odometry(), stuck)
        for index in range(60):
            vehicle.steer(brain, 0, 0, 0, 0, wrapped(rate * 0.05 * index))
        assert stuck.share == pytest.approx(0.0, abs=0.01)


# ---- battery ------------------------------------------------------------------------------------------------------


def measure(battery: BatteryLevel, vehicle: SteppedVehicle, brain: Brain, volts: float, steps: int) -> None:
    for _ in range(steps):
        vehicle.steer(brain, 0, 0, 0, 0, 0, 0, 0, 0, volts)


@given(st.floats(0.05, 5), st.floats(10.0, 12.0), st.floats(10.0, 12.0), st.integers(1, 100))
@settings(max_examples=40)
def test_battery_filter_follows_the_closed_form(tau: float, first: float, then: float, steps: int) -> None:
    battery, vehicle = BatteryLevel(empty=10, full=12, tau=tau, rise=99.0, fall=99.0), SteppedVehicle()
    brain = alone(Stop(), battery)
    measure(battery, vehicle, brain, first, 1)
    assert battery.level == pytest.approx((first - 10) / 2)
    measure(battery, vehicle, brain, then, steps)
    assert battery.voltage == pytest.approx(then + (first - then) * math.exp(-steps * 0.01 / tau))
    assert battery.voltage is not None
    assert battery.variable().value(vehicle.robot) == pytest.approx(1 - (battery.voltage - 10) / 2)


def test_nothing_is_known_before_the_first_reading_and_stale_ones_change_nothing() -> None:
    battery, stepped = BatteryLevel(empty=5.0, full=7.75, tau=0.5), Stepped(description=FULL)
    brain = alone(Stop(), battery)
    stepped.step(brain)
    assert battery.level is None and battery.variable().value(stepped.robot) == 0.0
    stepped.step(brain, battery=700, battery_age=1)  # 700/1024 · 5 V · 2
    first = battery.voltage
    assert first == pytest.approx(700 / 1024 * 10)
    for age in (30, 254, 255):
        stepped.step(brain, battery=100, battery_age=age)
        assert battery.voltage == first
    stepped.step(brain, battery=690, battery_age=0)
    # the filter makes up for the time without readings: four steps of 0.01 s
    assert battery.voltage == pytest.approx(690 / 102.4 + 10 / 102.4 * math.exp(-0.04 / 0.5))


def test_charging_begins_with_a_rise_and_ends_with_a_fall() -> None:
    battery, vehicle = BatteryLevel(empty=10, full=12, tau=1e-3, rise=0.1, fall=0.05), SteppedVehicle()
    brain, variable = alone(Stop(), battery), battery.charging_variable()
    for volts, charging in (
        (11.0, False),
        (10.9, False),
        (10.98, False),  # up by 0.08
        (11.01, True),  # by 0.11 from the lowest
        (11.5, True),
        (11.46, True),  # down by 0.04
        (11.44, False),  # by 0.06 from the highest
        (11.40, False),
        (11.49, False),
        (11.51, True),
    ):
        measure(battery, vehicle, brain, volts, 2)
        assert battery.charging is charging, volts
        assert variable.value(vehicle.robot) == float(charging)


def test_a_pack_that_recovers_from_its_load_is_not_charged() -> None:
    """Motors at full signal pull it down by 0.3 V; the process knows the commands."""
    for sag, charging in ((0.3, False), (0.0, True)):
        battery, vehicle, drive = BatteryLevel(empty=10, full=12, tau=0.05, sag=sag), SteppedVehicle(), Driven()
        brain = alone(drive, battery)
        drive.signals = (1.0, -1.0)
        measure(battery, vehicle, brain, 11.0, 1)  # the first step sees the command of none before it
        measure(battery, vehicle, brain, 10.7, 100)
        drive.signals = (0.0, 0.0)
        measure(battery, vehicle, brain, 10.7, 1)
        measure(battery, vehicle, brain, 11.0, 100)
        assert battery.charging is charging
        assert battery.voltage == pytest.approx(11.0, abs=1e-3)


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"empty": 12.0, "full": 12.0}, "full is 12.0 V; expected more than empty, 12.0 V"),
        ({"empty": 10.0, "full": 12.0, "tau": 0.0}, "tau is 0.0; expected more than 0"),
        ({"empty": 10.0, "full": 12.0, "rise": math.nan}, "rise is nan; expected a number"),
    ],
)
def test_batteries_that_are_none(parameters: dict[str, float], sentence: str) -> None:
    with pytest.raises(BrainError, match=f"battery_level: {sentence}"):
        BatteryLevel(**parameters)  # type: ignore[arg-type]


# ---- light, sky, contact, nearness -----------------------------------------------------------------------------------


@given(st.floats(0, 1e6), st.floats(0, 1e6))
@settings(max_examples=60)
def test_light_asymmetry(left: float, right: float) -> None:
    light, vehicle = LightSense(scale=2.0), SteppedVehicle()
    vehicle.steer(alone(Stop(), light), 0, 0, 0, 0, 0, 0, left, right)
    expected = (left - right) / (left + right) if left + right > 0 else 0.0
    assert light.asymmetry == pytest.approx(expected) and -1 <= light.asymmetry <= 1
    assert light.variable().value(vehicle.robot) == pytest.approx(max(left, right) / (max(left, right) + 2.0))


def test_one_light_sensor_alone_gives_no_asymmetry() -> None:
    light, stepped = LightSense(), Stepped(description=FULL)
    brain = alone(Stop(), light)
    stepped.step(brain, light_left=1000, light_right=0, light_age=0)
    assert (light.left, light.right, light.asymmetry) == (1000.0, None, 0.0)
    stepped.step(brain, light_left=1000, light_right=2000, light_age=200)
    assert (light.left, light.right, light.asymmetry) == (None, None, 0.0)


@given(st.floats(0, 1e6), st.floats(-math.pi, math.pi))
def test_the_sun_goes_round_once_a_day(time: float, at_start: float) -> None:
    found = sun_azimuth(time, at_start)
    assert math.cos(found) == pytest.approx(math.cos(at_start + 2 * math.pi * time / 86_400), abs=1e-9)
    assert sun_azimuth(time + 86_400, at_start) == pytest.approx(found, abs=1e-6) or abs(abs(found) - math.pi) < 1e-6
    assert sun_azimuth(21_600) == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(("turning", "expected"), [(False, 1.0), (True, wrapped(1.0 + 0.3 + 2 * math.pi / 864))])
def test_sun_compass_makes_up_for_the_turning_sky(turning: bool, expected: float) -> None:
    compass, vehicle = SunCompass(turning=turning, azimuth_at_start=0.3), SteppedVehicle(10.0)
    brain = Brain([Stop(), compass], period=10.0)
    for _ in range(11):
        vehicle.steer(brain, 0, 0, 0, 0, 0, 1.0)
    assert compass.heading == pytest.approx(expected)


def test_without_a_sky_the_last_heading_stands() -> None:
    compass, stepped = SunCompass(), Stepped(description=FULL)
    brain = alone(Stop(), compass)
    stepped.step(brain)
    assert compass.heading is None
    stepped.step(brain, compass_x=300, compass_y=-300, compass_age=1, compass_status=int(CompassStatus.OK))
    assert compass.heading == pytest.approx(math.pi / 4)
    stepped.step(brain, compass_x=-300, compass_y=0, compass_age=250, compass_status=int(CompassStatus.OK))
    assert compass.heading == pytest.approx(math.pi / 4)


def test_touches_are_counted_when_they_begin() -> None:
    felt, stepped = Contact(), Stepped()
    brain = alone(Stop(), felt)
    for whiskers in (0, 1, 1, 3, 2, 0, 3, 0):
        stepped.step(brain, whiskers=whiskers)
    assert felt.touches == 4 and felt.last == pytest.approx(0.06) and not (felt.left or felt.right)
    stepped.see(whiskers=2)
    assert contact().value(stepped.robot) == 1.0
    assert contact().value(SteppedVehicle().robot) == 0.0, "a robot without whiskers"


@given(st.floats(0, 1), st.floats(0, 1))
@settings(max_examples=40)
def test_near_is_the_nearest_of_all(left: float, right: float) -> None:
    proximity, vehicle = Proximity(), SteppedVehicle()
    vehicle.steer(alone(Stop(), proximity), left, right)
    assert (proximity.left, proximity.right, proximity.ahead) == (left, right, None)
    assert (proximity.last_left is not None, proximity.last_right is not None) == (left >= 0.3, right >= 0.3)
    assert near().value(vehicle.robot) == max(left, right)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"ping_status": PingStatus.NOTHING_NEAR, "ping_age": 1}, 0.0),
        ({"ping_status": PingStatus.TOO_NEAR, "ping_age": 1}, 1.0),
        ({"ping_status": PingStatus.ABSENT, "ping_age": 1}, None),
        ({"ping_status": PingStatus.OK, "ping_echo": 1166, "ping_age": 1}, 0.5),  # 0.2 m at 343 m/s, of 0.4 m
        ({"ping_status": PingStatus.OFF, "ping_age": 255}, None),
        ({"ping_status": PingStatus.OK, "ping_echo": 18_000, "ping_age": 1}, 0.0),  # 3.1 m: beyond
    ],
)
def test_nearness_ahead_of_what_ping_says(fields: dict[str, int], expected: float | None) -> None:
    stepped = Stepped()
    stepped.see(infrared_age=255, **fields)
    assert nearness_ahead(stepped.robot) == (None if expected is None else pytest.approx(expected, abs=0.01))
    assert near().value(stepped.robot) == pytest.approx(expected or 0.0, abs=0.01), "stale infra-red is left out"


# ---- any readings --------------------------------------------------------------------------------------------------


def numbers_of(process: CognitiveProcess) -> list[float]:
    """All its numbers."""
    found: list[float] = []
    for name in dir(process):
        value = None if name.startswith("_") else getattr(process, name)
        for one in value if isinstance(value, tuple) else (value,):
            if isinstance(one, int | float):
                found.append(float(one))
    return found


@given(st.lists(ANYTHING, min_size=1, max_size=5))
@settings(max_examples=40)
def test_no_observation_makes_a_number_that_is_none(seen: list[dict[str, int]]) -> None:
    battery, odometry, drift, stuck = BatteryLevel(empty=5, full=7.75), Odometry(), Drift(), StuckDetector()
    light = LightSense()
    processes = (odometry, battery, drift, stuck, light, Contact(), Proximity(), SunCompass(turning=True))
    variables = [near(), contact()] + [one.variable() for one in (battery, drift, stuck, light)]
    brain, stepped = Brain([Stop(), *processes], [*variables, battery.charging_variable()]), Stepped(description=FULL)
    for fields in seen:
        stepped.step(brain, **fields)
        for process in processes:
            process.step_time = 0.0
            assert all(math.isfinite(number) for number in numbers_of(process)), process.name
        assert all(0 <= variable.value(stepped.robot) <= 1 for variable in brain.variables)
