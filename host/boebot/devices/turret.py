"""Turret: a position servo, set by message, and the pulse that it gets now.

angle = (pulse - centre) / gain
"""

from __future__ import annotations

from typing import NamedTuple

from boebot.devices.freshness import MESSAGE_TICKS, fresh_ticks
from boebot.devices.servo import PULSE_SCALE_US
from boebot.link.messages import DevicesTelemetry
from boebot.link.messages import Turret as TurretMessage

ANGLE_SCALE = 1e-4  # radians per count on the wire
ANGLE_MAX = 1.6  # rad, either way
PULSE_MIN_US, PULSE_MAX_US = 600.0, 2400.0  # the firmware goes no further


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


def pulse_of(message: TurretMessage, centre_us: float, gain_us_per_rad: float) -> int:
    """The pulse (counts) by which the board shows that it has done so; 0: none."""
    if not message.hold:
        return 0
    pulse_us = centre_us + gain_us_per_rad * message.angle * ANGLE_SCALE
    return round(max(PULSE_MIN_US, min(PULSE_MAX_US, pulse_us)) / PULSE_SCALE_US)


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
    """Reads the turret; centre and gain as its servo has them; `told_ticks`: from one message to the next."""

    def __init__(
        self, centre_us: float, gain_us_per_rad: float, tick_s: float, told_ticks: int = MESSAGE_TICKS
    ) -> None:
        self._fresh = fresh_ticks(1, told_ticks)
        self._tick_s = tick_s
        self._centre_us = centre_us
        self._gain_us_per_rad = gain_us_per_rad

    def __call__(self, devices: DevicesTelemetry, since: float = 0) -> Turret:
        """The turret as that message had it, `since` ticks ago."""
        age, valid = since * self._tick_s, since <= self._fresh
        if devices.turret_pulse == 0:
            return Turret(None, None, age, valid)
        pulse_us = devices.turret_pulse * PULSE_SCALE_US
        gain = self._gain_us_per_rad
        return Turret((pulse_us - self._centre_us) / gain if gain else None, pulse_us, age, valid)
