"""What the devices of a robot without a board say: named readings in SI units, and the views of them that a brain sees.

A brain meets them by the same names as the devices of a robot with a board (`robot.left_ir.detected`); views say more
where the device does (`robot.left_ir.reading`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from boebot.description import robots
from boebot.devices import vehicle_devices
from boebot.devices.battery import Battery
from boebot.devices.light import Light
from boebot.devices.ping import Ping
from boebot.devices.whisker import Whisker
from boebot.link.messages import PingStatus

Layout = Mapping[str, slice]
"""Where the readings of each device of the description stand."""


class Readings(NamedTuple):
    """All readings at one step."""

    tick: int
    """steps since the start"""
    status: int
    """flags as in telemetry: MOTORS_ENABLED"""
    ages: tuple[float, ...]
    """s since each was taken"""
    values: tuple[float, ...]
    """SI units; which stands where says the layout"""


class Proximity(NamedTuple):
    """An IR proximity sensor."""

    detected: bool
    """The reading is at the sensor's threshold or above."""
    age: float
    """Seconds since it was taken."""
    valid: bool
    """Whether the value may be trusted."""
    reading: float
    """0 (nothing within range) to 1 (close by)."""


class OdometerPose(NamedTuple):
    """Where the odometer believes the robot to be; it was told the true pose once, at the start."""

    x: float
    """m"""
    y: float
    """m"""
    heading: float
    """rad, counter-clockwise from the x axis"""
    age: float
    """Seconds since it was taken."""
    valid: bool
    """Whether the value may be trusted."""


class Heading(NamedTuple):
    """A compass, of a robot without a board."""

    heading: float
    """rad in (-pi, pi], counter-clockwise from the x axis"""
    age: float
    """Seconds since it was taken."""
    valid: bool
    """Whether the value may be trusted."""


class Scan(NamedTuple):
    """A laser range finder's last sweep, from right to left."""

    distances: tuple[float, ...]
    """m; -1: nothing within range"""
    angles: tuple[float, ...]
    """rad from straight ahead, counter-clockwise"""
    age: float
    """Seconds since it was taken."""
    valid: bool
    """Whether the value may be trusted."""


class Reading(NamedTuple):
    """One number: an acceleration along the heading (m/s^2)."""

    value: float
    """m/s^2, forward positive"""
    age: float
    """Seconds since it was taken."""
    valid: bool
    """Whether the value may be trusted."""


Reader = Callable[[Readings], object]
_TOUCHING, _FREE = Whisker(True, 0.0, True), Whisker(False, 0.0, True)

# the brain's name of a device of the description
BRAIN_NAMES: dict[str, str] = {
    "infrared_left": "left_ir",
    "infrared_right": "right_ir",
    "whisker_left": "left_whisker",
    "whisker_right": "right_whisker",
    "light_left": "left_light",
    "light_right": "right_light",
    "ping": "ping",
    "odometer": "odometer",
    "compass": "compass",
    "laser": "laser",
    "accelerometer": "accelerometer",
    "battery": "battery",
}


def readers(robot: robots.RobotDescription, layout: Layout) -> dict[str, Reader]:
    """One reader for each device that a brain can see, by the brain's name of it."""
    found: dict[str, Reader] = {}
    for name, where in layout.items():
        reader = _reader(robot.device[name], where)
        if reader is not None and name in BRAIN_NAMES:
            found[BRAIN_NAMES[name]] = reader
    return found


def _reader(device: robots.AnyDevice, where: slice) -> Reader | None:
    first = where.start
    match device:
        case vehicle_devices.InfraredProximity():
            threshold = device.threshold

            def proximity(sample: Readings) -> Proximity:
                value = sample.values[first]
                return Proximity(value >= threshold, sample.ages[first], True, value)

            return proximity
        case vehicle_devices.Sonar():
            beyond = device.range_max_m

            def sonar(sample: Readings) -> Ping:
                value = sample.values[first]
                near = value < beyond
                status = PingStatus.OK if near else PingStatus.NOTHING_NEAR
                return Ping(value if near else None, sample.ages[first], True, status)

            return sonar
        case vehicle_devices.Laser():
            begin = -device.step_rad * (device.rays - 1) / 2
            angles = tuple(begin + device.step_rad * ray for ray in range(device.rays))
            return lambda sample: Scan(sample.values[where], angles, sample.ages[first], True)
        case vehicle_devices.Odometer():

            def odometer(sample: Readings) -> OdometerPose:
                x, y, heading = sample.values[where]
                return OdometerPose(x, y, heading, sample.ages[first], True)

            return odometer
        case vehicle_devices.HeadingCompass():
            return lambda sample: Heading(sample.values[first], sample.ages[first], True)
        case vehicle_devices.TouchWhisker():
            return lambda sample: _TOUCHING if sample.values[first] else _FREE
        case vehicle_devices.Phototransistor():
            return lambda sample: Light(None, sample.values[first], False, sample.ages[first], True)
        case vehicle_devices.Energy():
            return lambda sample: Battery(sample.values[first], sample.ages[first], True)
        case vehicle_devices.Accelerometer():
            return lambda sample: Reading(sample.values[first], sample.ages[first], True)
    return None


def periods(robot: robots.RobotDescription, layout: Layout, count: int) -> tuple[float, ...]:
    """Seconds between two samples of each reading; 0: every step."""
    found = [0.0] * count
    for name, where in layout.items():
        period_s = getattr(robot.device[name], "period_s", 0.0)
        for index in range(where.start, where.stop):
            found[index] = period_s
    return tuple(found)


def ages(periods_s: tuple[float, ...], time_s: float, tick_s: float) -> tuple[float, ...]:
    """Age of each reading at a time: a sensor samples in the first step at or after each multiple of its period."""
    return tuple(_age(period_s, time_s, tick_s) if period_s > tick_s else 0.0 for period_s in periods_s)


def _age(period_s: float, time_s: float, tick_s: float) -> float:
    samples = math.floor(time_s / period_s + 1e-9)
    return max(0.0, time_s - math.ceil(samples * period_s / tick_s - 1e-9) * tick_s)
