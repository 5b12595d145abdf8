"""Infra-red pairs: an LED flashes at 38 kHz, a receiver says whether something reflects it.

The firmware reads both pairs every few ticks; between two readings the last one stands, with its age. With the
parameter infrared_sweep on it flashes at 38, 39, 40, 41 and 42 kHz in turn, at which the receiver is less and less
sensitive: the nearer the object, the more of the five show it (zones of a few centimetres: Parallax,
"Robotics with the Board of Education Shield for Arduino", chapter 8).
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.link.messages import DevicesTelemetry, Telemetry

NEVER = 255  # age in telemetry: never measured, or older
STALE_PERIODS = 3  # a reading older than this many of its periods is not valid
MESSAGE_TICKS = 2  # from one message of the slow devices to the next: parameter devices_period, unless set otherwise


class Infrared(NamedTuple):
    """One infra-red pair."""

    detected: bool
    """Something reflected the last flash."""
    age: float
    """Seconds since the last flash; infinite if there was none."""
    valid: bool
    """The reading is fresh."""


class InfraredReader:
    """Reads one pair; `bit` is its flag in telemetry."""

    def __init__(self, bit: int, period_ticks: int, tick_s: float) -> None:
        fresh = min(STALE_PERIODS * period_ticks, NEVER - 1)
        # [detected][age in ticks] -> view; a reading has only 512 values
        self._views = [
            [
                Infrared(detected, ticks * tick_s if ticks < NEVER else float("inf"), ticks <= fresh)
                for ticks in range(NEVER + 1)
            ]
            for detected in (False, True)
        ]
        self._bit = int(bit)

    def __call__(self, telemetry: Telemetry) -> Infrared:
        """The pair's last reading as of that tick."""
        return self._views[telemetry.infrared & self._bit != 0][telemetry.infrared_age]


SWEEP_TICKS = 5  # of a whole sweep: one frequency in each


class InfraredZone(NamedTuple):
    """One infra-red pair's zone."""

    zone: int
    """At how many of the five frequencies something reflected the flash: 0 nothing, 5 nearest."""
    age: float
    """Seconds since the sweep's last flash; infinite if there was none."""
    valid: bool
    """The zone is fresh."""


class InfraredZoneReader:
    """Reads the zone of one pair; `period_ticks` as of the pairs, `told_ticks` of the messages that tell it."""

    def __init__(self, left: bool, period_ticks: int, tick_s: float, told_ticks: int = MESSAGE_TICKS) -> None:
        self._left = left
        self._fresh = STALE_PERIODS * max(period_ticks, SWEEP_TICKS, told_ticks)
        self._tick_s = tick_s

    def __call__(self, devices: DevicesTelemetry, since: float = 0) -> InfraredZone:
        """The pair's last zone, `since` ticks after that message."""
        told = devices.infrared_zone_age
        ticks = told + since
        if told >= NEVER:
            return InfraredZone(0, float("inf"), False)
        zone = devices.infrared_zone_left if self._left else devices.infrared_zone_right
        return InfraredZone(zone, ticks * self._tick_s, ticks <= self._fresh)
