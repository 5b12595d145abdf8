"""Light sensors: a phototransistor discharges a capacitor; the time that it takes is the shorter, the brighter it is.

The current of the phototransistor is proportional to the light, so   brightness ∝ 1 / decay time.
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.devices.freshness import MESSAGE_TICKS, fresh_ticks
from boebot.devices.infrared import NEVER
from boebot.link.messages import DevicesTelemetry

LONGEST_US = 14_000  # on the wire: so long or longer
FRAME_TICKS = 2  # one reading in each servo frame


class Light(NamedTuple):
    """One light sensor."""

    decay_time: float | None
    """Seconds that the capacitor took; None if it could not be measured."""
    brightness: float | None
    """Twice as much in twice the light: 1 / decay time (1/s), or the irradiance in a robot without a board, whose
    sensor needs no time. None if it could not be measured."""
    dark: bool
    """It took as long as the board waits, or longer."""
    age: float
    """Seconds since the measurement; infinite if there was none."""
    valid: bool
    """The reading is fresh and could be measured."""


class LightReader:
    """Reads one light sensor; `told_ticks`: from one message to the next."""

    def __init__(self, left: bool, tick_s: float, told_ticks: int = MESSAGE_TICKS) -> None:
        self._left = left
        self._fresh = fresh_ticks(FRAME_TICKS, told_ticks)
        self._tick_s = tick_s

    def __call__(self, devices: DevicesTelemetry, since: float = 0) -> Light:
        """The last reading, `since` ticks after that message."""
        us = devices.light_left if self._left else devices.light_right
        told = devices.light_age
        ticks = told + since
        age = ticks * self._tick_s if told < NEVER else float("inf")
        if told >= NEVER or us == 0:
            return Light(None, None, False, age, False)
        return Light(us * 1e-6, 1e6 / us, us >= LONGEST_US, age, ticks <= self._fresh)
