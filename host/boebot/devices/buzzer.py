"""Buzzer: tones, told to the board with a token, so that one told twice sounds once.

A message may be lost: it is to be sent again, unchanged, until devices_telemetry brings its token back.
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.devices.freshness import MESSAGE_TICKS, fresh_ticks
from boebot.link.messages import Buzzer as BuzzerMessage
from boebot.link.messages import DevicesTelemetry

FREQUENCY_MIN, FREQUENCY_MAX = 40.0, 8000.0  # Hz
DURATION_SCALE = 0.01  # seconds per count on the wire
DURATION_MAX = 2.55  # s
TOKENS = 255  # 1..255; 0 is the board's at the start of a session


def next_token(token: int) -> int:
    """The token after that one."""
    return token % TOKENS + 1


def command(frequency: float, duration: float, token: int) -> BuzzerMessage:
    """The message of a tone (Hz, s); frequency or duration 0 is silence.

    Raises:
        ValueError: a frequency or duration that the board does not have.
    """
    if frequency and not FREQUENCY_MIN <= frequency <= FREQUENCY_MAX:
        raise ValueError(f"a tone of {frequency} Hz; expected {FREQUENCY_MIN:g} to {FREQUENCY_MAX:g}, or 0")
    if not 0.0 <= duration <= DURATION_MAX:
        raise ValueError(f"a tone of {duration} s; expected 0 to {DURATION_MAX}")
    return BuzzerMessage(round(frequency), round(duration / DURATION_SCALE), token)


class Buzzer(NamedTuple):
    """The buzzer."""

    token: int
    """Of the last tone that the board began in this session; 0: none."""
    age: float
    """Seconds since this was so."""
    valid: bool
    """Whether the value may be trusted."""


class BuzzerReader:
    """Reads the buzzer; `told_ticks`: from one message to the next."""

    def __init__(self, tick_s: float, told_ticks: int = MESSAGE_TICKS) -> None:
        self._fresh = fresh_ticks(1, told_ticks)
        self._tick_s = tick_s

    def __call__(self, devices: DevicesTelemetry, since: float = 0) -> Buzzer:
        """The buzzer as that message had it, `since` ticks ago."""
        return Buzzer(devices.buzzer_token, since * self._tick_s, since <= self._fresh)
