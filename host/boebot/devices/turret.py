"""Turret: a position servo, set by message, and the pulse that it gets now.

angle = (pulse - centre) / gain
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.devices.servo import PULSE_SCALE_US
from boebot.link.messages import DevicesTelemetry
from boebot.link.messages import Turret as TurretMessage

ANGLE_SCALE = 1e-4  # radians per count on the wire
ANGLE_MAX = 1.6  # rad, either way


def command(angle: float | None) -> TurretMessage:
    """The message that turns the turret to an angle (rad, counter-clockwise; beyond ±1.6 that), or releases it (None).

    Raises:
        ValueError: the angle is no number.
    """
    if angle is None:
        return TurretMessage(0, 0)
    if angle != angle:
        raise ValueError("the turret's angle is not a number; expected radians, or None to release it")
    return TurretMessage(round(max(-ANGLE_MAX, min(ANGLE_MAX, angle)) / ANGLE_SCALE), 1)


class Turret(NamedTuple):
    """The turret, as driven now."""

    angle: float | None
    """Radians counter-clockwise from straight ahead that its pulse stands for, or None: no pulses, it is free."""
    pulse_us: float | None
    """Pulse width in force, or None."""
    age: float
    """Seconds since this was so."""
    valid: bool
    """Whether the value may be trusted."""


class TurretReader:
    """Reads the turret; centre and gain as its servo has them."""

    def __init__(self, centre_us: float, gain_us_per_rad: float) -> None:
        self._centre_us = centre_us
        self._gain_us_per_rad = gain_us_per_rad

    def __call__(self, devices: DevicesTelemetry) -> Turret:
        """The turret at that tick."""
        if devices.turret_pulse == 0:
            return Turret(None, None, 0.0, True)
        pulse_us = devices.turret_pulse * PULSE_SCALE_US
        gain = self._gain_us_per_rad
        return Turret((pulse_us - self._centre_us) / gain if gain else None, pulse_us, 0.0, True)
