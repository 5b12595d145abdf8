"""Infra-red pairs: an LED flashes at 38 kHz, a receiver says whether something reflects it.

The firmware reads both pairs every few ticks; between two readings the last one stands, with its age.
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.link.messages import Telemetry

NEVER = 255  # age in telemetry: never measured, or older
STALE_PERIODS = 3  # a reading older than this many of its periods is not valid


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
