"""Continuous-rotation servos: the pulse that the firmware sends them now, read back from telemetry.

signal = (pulse - centre) / gain
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.link.messages import Telemetry

PULSE_SCALE_US = 0.0625  # microseconds per count of the pulse widths on the wire


class Servo(NamedTuple):
    """One wheel's servo, as driven now."""

    pulse_us: float | None
    """Pulse width in force, or None: no pulses, the wheel turns freely."""
    signal: float
    """The motor signal -1..1 that this pulse stands for; 0 without pulses."""
    age: float
    """Seconds since this was so."""
    valid: bool
    """Whether the value may be trusted."""


class ServoReader:
    """Reads one servo."""

    def __init__(self, left: bool, centre_us: float, gain_us: float) -> None:
        self._left = left
        self._centre_us = centre_us
        self._gain_us = gain_us

    def __call__(self, telemetry: Telemetry) -> Servo:
        """The servo's pulse at that tick."""
        counts = telemetry.pulse_left if self._left else telemetry.pulse_right
        if counts == 0:
            return Servo(None, 0.0, 0.0, True)
        pulse_us = counts * PULSE_SCALE_US
        signal = (pulse_us - self._centre_us) / self._gain_us if self._gain_us else 0.0
        return Servo(pulse_us, signal, 0.0, True)
