"""Analog infra-red distance sensor, Sharp GP2Y0A21 or GP2D12 (their data sheets).

V ≈ 33.9 / (d + 4.74)   with d in cm, from 10 to 80 cm; so   d = 33.9 / V - 4.74.
Nearer than 10 cm the voltage falls again: things there look farther away than they are.

    [device.analog_infrared]
    type = "analog_infrared"
    pin = "A2"
    position_m = [0.06, 0.0]
    heading_rad = 0.0

    robot.analog_infrared.distance
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

from boebot.devices.device import ANALOG_PINS, FIVE_VOLTS, GROUND, Checkup, Point, SlowDevice, Wire
from boebot.devices.drawing import Item, ray
from boebot.devices.latest import READ_TICKS, voltage

SCALE_V_M = 0.339
OFFSET_M = 0.0474
RANGE_MIN_M = 0.10
RANGE_MAX_M = 0.80
VOLTS_MOST = 3.5  # that it gives, with room for its spread


def distance(volts: float) -> float | None:
    """Distance (m) at which the sensor gives that voltage; None beyond its range, its least where it gives more."""
    if volts <= SCALE_V_M / (RANGE_MAX_M + OFFSET_M):
        return None
    return max(SCALE_V_M / volts - OFFSET_M, RANGE_MIN_M)


class AnalogInfrared(NamedTuple):
    """The sensor's last reading."""

    distance: float | None
    """Metres to the nearest thing ahead, or None if there is none within 0.8 m."""
    voltage: float | None
    """Volts at the pin, or None if nothing was measured yet."""
    age: float
    """Seconds since it was converted; infinite if never. The sensor itself is up to 48 ms behind."""
    valid: bool
    """The reading is fresh."""


class SharpSensor(SlowDevice, tag="analog_infrared", frozen=True, kw_only=True):
    """Sharp analog infra-red distance sensor."""

    pin: int | str
    position_m: Point
    heading_rad: float

    READING: ClassVar = AnalogInfrared
    NAMES: ClassVar[tuple[str, ...]] = ("analog_infrared",)
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("pin", "1 output"),
        Wire(GROUND, "2 ground"),
        Wire(FIVE_VOLTS, "3 supply"),
    )
    NEEDS: ClassVar[dict[str, str]] = {"analog converter": "analog inputs"}
    CHIP_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": ANALOG_PINS}
    AGE: ClassVar[str] = "analog_infrared_age"
    PERIOD_TICKS: ClassVar[int] = READ_TICKS
    COLUMNS: ClassVar = (("distance", "m", 4),)
    SHOWN: ClassVar = ("distance", "m", 1.0, 3)

    def checkup(self, readings: Sequence[AnalogInfrared]) -> Checkup:
        """See `Device`."""
        newest = readings[-1]
        expected = f"{RANGE_MIN_M:g} to {RANGE_MAX_M:g} m, or nothing near; less with a hand ahead"
        if newest.voltage is None:
            return Checkup("no reading", expected)
        seen = "nothing near" if newest.distance is None else f"{newest.distance:.2f} m"
        plug = "" if newest.voltage <= VOLTS_MOST else f"is its output plugged to {self.wired_to}?"
        return Checkup(f"{seen}, {newest.voltage:.2f} V", expected, plug)

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> AnalogInfrared:
        """See `SlowDevice`."""
        at_pin = voltage(message.analog_infrared, message.supply)
        if age == math.inf or at_pin is None:
            return AnalogInfrared(None, None, math.inf, False)
        return AnalogInfrared(distance(at_pin), at_pin, age, fresh)

    def drawing(self, name: str) -> list[Item]:
        """Its line of sight."""
        return [ray(self.position_m, self.heading_rad, RANGE_MAX_M)]
