"""Battery: the pack's voltage behind a divider, against the supply.

voltage = ratio · result / 1024 · supply
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.devices.analog import READ_TICKS, voltage
from boebot.devices.freshness import MESSAGE_TICKS, fresh_ticks
from boebot.devices.infrared import NEVER
from boebot.link.messages import DevicesTelemetry


class Battery(NamedTuple):
    """The pack."""

    voltage: float | None
    """Volts of the pack, or None if nothing was measured yet."""
    age: float
    """Seconds since it was measured; infinite if never."""
    valid: bool
    """The measurement is fresh."""


class BatteryReader:
    """Reads the pack; `ratio`: its voltage for each volt at the pin; `told_ticks`: from one message to the next."""

    def __init__(self, ratio: float, tick_s: float, told_ticks: int = MESSAGE_TICKS) -> None:
        self._fresh = fresh_ticks(READ_TICKS, told_ticks)
        self._ratio = ratio
        self._tick_s = tick_s

    def __call__(self, devices: DevicesTelemetry, since: float = 0) -> Battery:
        """The last measurement, `since` ticks after that message."""
        told = devices.battery_age
        ticks = told + since
        at_pin = voltage(devices.battery, devices.supply)
        if told >= NEVER or at_pin is None:
            return Battery(None, float("inf"), False)
        return Battery(at_pin * self._ratio, ticks * self._tick_s, ticks <= self._fresh)
