"""Whiskers: wires that close a switch when something bends them (telemetry `whiskers`, debounced by the firmware)."""

from __future__ import annotations

from typing import Final, NamedTuple

from boebot.link.messages import Telemetry


class Whisker(NamedTuple):
    """One whisker."""

    pressed: bool
    """Something bends it."""
    age: float
    """Seconds since it was sampled."""
    valid: bool
    """Whether the value may be trusted."""


_PRESSED: Final = Whisker(True, 0.0, True)
_FREE: Final = Whisker(False, 0.0, True)


class WhiskerReader:
    """Reads one whisker; `bit` is its flag in telemetry."""

    def __init__(self, bit: int) -> None:
        self._bit = int(bit)

    def __call__(self, telemetry: Telemetry) -> Whisker:
        """The whisker at that tick: it is sampled in every tick, so its age is 0."""
        return _PRESSED if telemetry.whiskers & self._bit else _FREE
