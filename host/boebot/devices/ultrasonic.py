"""HC-SR04: an ultrasonic range finder on two pins. For programs of one's own: the kit's firmware has none.

A pulse of 10 µs or more on its trigger sends eight cycles of 40 kHz; then its echo pin is high for as long as sound
takes to the nearest thing and back, or for 38 ms if it hears nothing (Elecfreaks, HC-SR04 User Guide).

    [device.sonar]
    type = "ultrasonic"
    trigger_pin = 7
    echo_pin = 8
    position_m = [0.060, 0.0]
    heading_rad = 0.0
"""

from __future__ import annotations

from typing import ClassVar

from boebot.devices.device import FIVE_VOLTS, GROUND, Angle, Device, Opening, Point, Positive, Wire
from boebot.devices.ping import EchoPulse


class UltrasonicSensor(EchoPulse, Device, tag="ultrasonic", frozen=True, kw_only=True):
    """HC-SR04."""

    trigger_pin: int | str
    echo_pin: int | str
    position_m: Point
    heading_rad: Angle = 0.0
    beam_rad: Opening = 0.26  # data: 15 degrees
    range_min_m: Positive = 0.02
    range_max_m: Positive = 4.0

    PINS: ClassVar[dict[str, str]] = {"trigger_pin": "trigger", "echo_pin": "echo"}
    HEARS: ClassVar[frozenset[str]] = frozenset({"trigger_pin"})
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("trigger_pin", "TRIG"),
        Wire("echo_pin", "ECHO"),
        Wire(FIVE_VOLTS, "VCC"),
        Wire(GROUND, "GND"),
    )
