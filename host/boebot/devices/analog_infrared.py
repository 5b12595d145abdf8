"""Analog infra-red distance sensor, Sharp GP2Y0A21 or GP2D12 (their data sheets).

V ≈ 33.9 / (d + 4.74)   with d in cm, from 10 to 80 cm; so   d = 33.9 / V - 4.74.
Nearer than 10 cm the voltage falls again: what is read there looks farther away than it is.
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.devices.analog import READ_TICKS, voltage
from boebot.devices.freshness import MESSAGE_TICKS, fresh_ticks
from boebot.devices.infrared import NEVER
from boebot.link.messages import DevicesTelemetry

SCALE_V_M = 0.339
OFFSET_M = 0.0474
RANGE_MIN_M = 0.10
RANGE_MAX_M = 0.80


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


class AnalogInfraredReader:
    """Reads the sensor; `told_ticks`: from one message to the next."""

    def __init__(self, tick_s: float, told_ticks: int = MESSAGE_TICKS) -> None:
        self._fresh = fresh_ticks(READ_TICKS, told_ticks)
        self._tick_s = tick_s

    def __call__(self, devices: DevicesTelemetry, since: float = 0) -> AnalogInfrared:
        """The last reading, `since` ticks after that message."""
        told = devices.analog_infrared_age
        ticks = told + since
        at_pin = voltage(devices.analog_infrared, devices.supply)
        if told >= NEVER or at_pin is None:
            return AnalogInfrared(None, None, float("inf"), False)
        return AnalogInfrared(distance(at_pin), at_pin, ticks * self._tick_s, ticks <= self._fresh)
