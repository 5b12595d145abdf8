"""Turret: a position servo, set by message, and the pulse that it gets now.

pulse = centre + gain · angle,   angle = (pulse - centre) / gain

Pins 8 to 13 can do it. A Ping is mounted on it, where there is one; `carries` names other sensors. Of a robot that runs
programs of one's own, pages show the angle that the turret has.

    [device.turret]
    type = "position_servo"
    pin = 11
    position_m = [0.045, 0.0]
    carries = ["ping"]

    robot.turn_turret(0.5)
    robot.turret.angle
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

import msgspec

from boebot.devices.device import AnyServo, Device, Point, SlowDevice
from boebot.devices.ping import PingSensor
from boebot.devices.servo import PULSE_SCALE_US
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


class PositionServo(AnyServo, SlowDevice, tag="position_servo", frozen=True, kw_only=True):
    """A servo that turns to an angle."""

    position_m: Point  # of its axis
    centre_us: Annotated[float, msgspec.Meta(ge=1000, le=2000)] = 1500.0
    gain_us_per_rad: Annotated[float, msgspec.Meta(ge=-1000, le=1000)] = 573.0  # 10 us a degree
    carries: tuple[str, ...] | None = None  # names of the sensors on it; none given: the Ping

    READING: ClassVar = Turret
    NAMES: ClassVar[tuple[str, ...]] = ("turret",)
    DOES: ClassVar[str] = "turns it"
    COLUMNS: ClassVar = (("angle", "rad", 4),)
    SHOWN: ClassVar = ("angle", "°", 180 / math.pi, 1)

    def pulse_of(self, message: TurretMessage) -> int:
        """The pulse (counts) by which the board shows that it has done so; 0: none."""
        if not message.hold:
            return 0
        pulse_us = self.centre_us + self.gain_us_per_rad * message.angle * ANGLE_SCALE
        return round(max(PULSE_MIN_US, min(PULSE_MAX_US, pulse_us)) / PULSE_SCALE_US)

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> Turret:
        """See `SlowDevice`."""
        if message.turret_pulse == 0:
            return Turret(None, None, age, fresh)
        pulse_us = message.turret_pulse * PULSE_SCALE_US
        gain = self.gain_us_per_rad
        return Turret((pulse_us - self.centre_us) / gain if gain else None, pulse_us, age, fresh)

    def carried(self, devices: Mapping[str, Device]) -> list[str]:
        """Names of what turns with it, among these devices of its robot: those that are on."""
        if self.carries is None:
            return [name for name, device in devices.items() if isinstance(device, PingSensor) and device.on]
        return [name for name in self.carries if devices[name].on]


def turret_name(devices: Mapping[str, Device]) -> str:
    """The turret that pictures show, the first that is on; "": there is none."""
    return next((name for name, device in devices.items() if isinstance(device, PositionServo) and device.on), "")
