"""Ping))): an ultrasonic range finder. The echo pulse lasts as long as sound takes to the obstacle and back.

distance = c · echo / 2,   c = 331.5 m/s + 0.6 m/(s K) · temperature
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from boebot.devices.infrared import NEVER, STALE_PERIODS
from boebot.link.messages import PingStatus, Telemetry

TEMPERATURE_C = 20.0


def speed_of_sound(temperature_c: float = TEMPERATURE_C) -> float:
    """Speed of sound in air (m/s)."""
    return 331.5 + 0.6 * temperature_c


class Ping(NamedTuple):
    """The range finder's last measurement."""

    distance: float | None
    """Metres to the nearest thing ahead, or None if no echo came back from within its range."""
    age: float
    """Seconds since the measurement ended or was given up; infinite if nothing was measured yet."""
    valid: bool
    """The measurement is fresh, and its status is OK or NOTHING_NEAR. Valid and None means: nothing near ahead."""
    status: PingStatus
    """OK: there is a distance. NOTHING_NEAR: no echo from within its range. TOO_NEAR: something is so near that its
    distance cannot be measured. ABSENT: no sensor answers. OFF: switched off, or not yet measured."""

    @property
    def too_near(self) -> bool:
        """Something is ahead, nearer than can be measured."""
        return self.status == PingStatus.TOO_NEAR

    @property
    def absent(self) -> bool:
        """No sensor answers: it is missing, or its wire is broken."""
        return self.status == PingStatus.ABSENT


class PingReader:
    """Reads the Ping; echoes from outside its range count as nothing near or too near."""

    def __init__(self, range_min_m: float, range_max_m: float, period_ticks: int, tick_s: float) -> None:
        self._metres_per_us = speed_of_sound() / 2 * 1e-6
        # The range's ends on the wire. A Ping that hears nothing ends its pulse after 18.5 ms, as if at 3.18 m.
        self._least_us = 0.9 * range_min_m / self._metres_per_us
        self._greatest_us = 1.03 * range_max_m / self._metres_per_us
        self._fresh = min(STALE_PERIODS * period_ticks, NEVER - 1)
        self._tick_s = tick_s

    def __call__(self, telemetry: Telemetry) -> Ping:
        """The last measurement as of that tick."""
        ticks, status = telemetry.ping_age, PingStatus(telemetry.ping_status)
        if ticks >= NEVER:
            return Ping(None, float("inf"), False, status)
        echo_us = telemetry.ping_echo
        if status == PingStatus.OK and echo_us > self._greatest_us:
            status = PingStatus.NOTHING_NEAR
        elif status == PingStatus.OK and echo_us < self._least_us:
            status = PingStatus.TOO_NEAR
        distance = echo_us * self._metres_per_us if status == PingStatus.OK else None
        knows = status in (PingStatus.OK, PingStatus.NOTHING_NEAR)
        return Ping(distance, ticks * self._tick_s, knows and ticks <= self._fresh, status)

    def distances(self, echo_us: NDArray[Any], age_ticks: NDArray[Any]) -> NDArray[np.float64]:
        """Distances of many telemetry messages at once (m), NaN where there was no echo."""
        heard = (self._least_us <= echo_us) & (echo_us <= self._greatest_us) & (age_ticks < NEVER)
        return np.where(heard, echo_us * self._metres_per_us, np.nan)
