"""Readers of the slow devices: wire values to SI values, ages, validity; the truth is each device's formula."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.devices import buzzer, turret
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.battery import BatteryDivider
from boebot.devices.buzzer import PiezoBuzzer
from boebot.devices.compass import MagneticCompass
from boebot.devices.device import Place
from boebot.devices.infrared import Infrared, InfraredPair, InfraredSchedule
from boebot.devices.latest import MESSAGE_TICKS, Latest, without_readings
from boebot.devices.light import LightSensor
from boebot.devices.turret import PositionServo
from boebot.link.messages import CompassStatus, DevicesTelemetry, Telemetry
from reading import TICK_S, read

NOTHING = without_readings(DevicesTelemetry)._replace(supply=5000)
BATTERY, SHARP, COMPASS = (
    BatteryDivider(pin="A0"),
    SharpSensor(pin="A2", position_m=(0, 0), heading_rad=0),
    MagneticCompass(sda_pin="A4", scl_pin="A5"),
)
LIGHT, BUZZER, TURRET = (
    LightSensor(pin=6, position_m=(0, 0), heading_rad=0),
    PiezoBuzzer(pin=4),
    PositionServo(pin=11, position_m=(0, 0)),
)


def test_without_a_reading_nothing_is_valid() -> None:
    light, compass = read(LIGHT, "light_left", NOTHING), read(COMPASS, "compass", NOTHING)
    battery, sharp = read(BATTERY, "battery", NOTHING), read(SHARP, "analog_infrared", NOTHING)
    assert not any(view.valid for view in (light, compass, battery, sharp))
    assert all(math.isinf(view.age) for view in (light, compass, battery, sharp))
    assert battery.voltage is None and sharp.distance is None and light.decay_time is None and compass.heading is None


@given(pack=st.floats(2.0, 9.9), supply_mv=st.integers(3000, 5500))
def test_battery_is_the_pack_to_a_step_of_the_converter(pack: float, supply_mv: int) -> None:
    result = min(1023, int(pack / 2.0 / (supply_mv / 1000) * 1024))
    view = read(BATTERY, "battery", NOTHING._replace(battery=result, battery_age=1, supply=supply_mv))
    assert view.voltage is not None and view.valid
    if result < 1023:
        assert -1e-9 <= pack - view.voltage <= 2.0 * supply_mv / 1000 / 1024 + 1e-9  # rounding of the floats


def test_battery_without_a_known_supply_is_not_valid() -> None:
    assert not read(BATTERY, "battery", NOTHING._replace(battery=500, battery_age=1, supply=0)).valid


@given(st.floats(10.5, 75.0))
def test_analog_infrared_inverts_the_curve(distance_cm: float) -> None:
    volts = 33.9 / (distance_cm + 4.74)
    view = read(
        SHARP, "analog_infrared", NOTHING._replace(analog_infrared=int(volts / 5.0 * 1024), analog_infrared_age=2)
    )
    step_cm = 33.9 / volts**2 * 5.0 / 1024  # what a step of the converter is there
    assert view.distance is not None and abs(100 * view.distance - distance_cm) <= 1.1 * step_cm
    assert view.valid and view.age == pytest.approx(0.02)


@pytest.mark.parametrize(("result", "distance"), [(0, None), (60, None), (1023, 0.10)])
def test_analog_infrared_beyond_its_range(result: int, distance: float | None) -> None:
    view = read(SHARP, "analog_infrared", NOTHING._replace(analog_infrared=result, analog_infrared_age=1))
    assert view.distance == distance and view.valid


def test_light_is_brighter_where_the_time_is_shorter() -> None:
    message = NOTHING._replace(light_left=500, light_right=1000, light_age=1)
    left, right = read(LIGHT, "light_left", message), read(LIGHT, "light_right", message)
    assert left.decay_time == pytest.approx(500e-6)
    assert left.brightness is not None and right.brightness is not None
    assert left.brightness == pytest.approx(2 * right.brightness)
    assert left.valid and not left.dark
    assert read(LIGHT, "light_left", message._replace(light_left=14_000)).dark
    assert not read(LIGHT, "light_left", message._replace(light_left=0)).valid
    assert not read(LIGHT, "light_left", message._replace(light_age=7)).valid


@given(heading=st.floats(-3.1, 3.1), x0=st.integers(-200, 200), y0=st.integers(-200, 200))
def test_compass_gives_the_heading_that_turned_the_field(heading: float, x0: int, y0: int) -> None:
    """North lies at -heading in the robot's frame: a field of 300 counts turned by that, and the robot's own."""
    x, y = round(x0 + 300 * math.cos(heading)), round(y0 - 300 * math.sin(heading))
    message = NOTHING._replace(compass_x=x, compass_y=y, compass_z=-400, compass_age=1, compass_status=CompassStatus.OK)
    view = read(MagneticCompass(sda_pin="A4", scl_pin="A5", offset_counts=(x0, y0)), "compass", message)
    assert view.heading is not None and view.valid
    assert abs(math.remainder(view.heading - heading, 2 * math.pi)) < 1.0 / 300
    assert view.field is not None and view.field[2] == pytest.approx(-400 / 1090 * 1e-4)


def test_compass_that_overflows_or_is_gone_is_not_valid() -> None:
    message = NOTHING._replace(compass_x=100, compass_age=1, compass_status=CompassStatus.OK)
    assert read(COMPASS, "compass", message).valid
    assert not read(COMPASS, "compass", message._replace(compass_y=-4096)).valid
    assert not read(COMPASS, "compass", message._replace(compass_x=0)).valid
    gone = read(COMPASS, "compass", message._replace(compass_status=CompassStatus.NO_ANSWER))
    assert not gone.valid and gone.status == CompassStatus.NO_ANSWER
    assert not read(COMPASS, "compass", message._replace(compass_age=13)).valid


def test_zone_of_each_side() -> None:
    pair = InfraredPair(led_pin=9, receiver_pin=10, position_m=(0, 0), heading_rad=0, beam_rad=0.4, range_m=0.2)
    devices = {"infrared_left": pair, "infrared_right": pair, "infrared": InfraredSchedule(sweep=True)}
    telemetry = Telemetry(*(0,) * len(Telemetry._fields))

    def zone(name: str, age: int) -> int | None:
        place = Place(name, devices, 0.033, TICK_S, MESSAGE_TICKS, slice(0, 1))
        message = NOTHING._replace(infrared_zone_left=4, infrared_zone_right=1, infrared_zone_age=age)
        found: Infrared = pair.reader(place)(telemetry, Latest({DevicesTelemetry: message}, 0))
        return found.zone

    assert (zone("infrared_left", 3), zone("infrared_right", 3)) == (4, 1)
    assert zone("infrared_left", 15) == 4 and zone("infrared_left", 16) is None and zone("infrared_left", 255) is None


@given(st.floats(-1.5, 1.5))
def test_turret_commanded_and_read_back_is_the_same_angle(angle: float) -> None:
    message = turret.command(angle)
    pulse = round((1500.0 + 573.0 * message.angle * 1e-4) / 0.0625)
    view = read(TURRET, "turret", NOTHING._replace(turret_pulse=pulse))
    assert message.hold == 1 and view.angle is not None and abs(view.angle - angle) <= 1.2e-4


def test_turret_released_and_wrong_angles() -> None:
    assert turret.command(None).hold == 0
    assert read(TURRET, "turret", NOTHING).angle is None
    assert turret.command(math.inf).angle == 16_000 and turret.command(-9.0).angle == -16_000
    with pytest.raises(ValueError, match="not a number"):
        turret.command(math.nan)


def test_buzzer_tokens_never_become_the_boards_own() -> None:
    token, seen = 0, set()
    for _ in range(600):
        token = buzzer.next_token(token)
        seen.add(token)
    assert seen == set(range(1, 256))
    assert buzzer.command(440.0, 0.1, 7) == (440, 10, 7)
    assert read(BUZZER, "buzzer", NOTHING._replace(buzzer_token=9)).token == 9


@pytest.mark.parametrize(
    ("frequency", "duration"), [(39.0, 1.0), (8001.0, 1.0), (math.nan, 1.0), (440.0, 2.6), (440.0, -0.1)]
)
def test_buzzer_refuses_what_the_board_does_not_have(frequency: float, duration: float) -> None:
    with pytest.raises(ValueError, match="expected"):
        buzzer.command(frequency, duration, 1)
