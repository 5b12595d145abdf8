"""The turret: the notes' standard servo, with this unit's offset; a Ping sits on it where there are both."""

from __future__ import annotations

import math
from typing import Any

from boebot.devices.turret import PositionServo
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices.catalogue import At, Part, joined
from sim_bridge.robots.imperfections import Draw


@joined(PositionServo)
def part(device: PositionServo, at: At) -> Part:
    """Its pulses."""
    return Part("turret_kind", at.number, [device.pin], turret_parameters(device, at.draw))


def turret_parameters(turret: PositionServo, draw: Draw) -> Any:
    """The turret in C."""
    out = ffi.new("turret_parameters *")
    out.x, out.y = turret.position_m
    motor = out.motor
    lib.motor_position_default(ffi.addressof(motor))
    gain = turret.gain_us_per_rad
    motor.mount = math.copysign(1.0, gain)
    motor.us_per_rad = abs(gain)
    motor.centre_us = turret.centre_us + draw["turret_centre_spread_us"] * draw(76, 0)
    return out
