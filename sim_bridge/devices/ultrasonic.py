"""HC-SR04: trigger and echo."""

from __future__ import annotations

from boebot.devices.ultrasonic import UltrasonicSensor
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined
from sim_bridge.devices.ping import sonar_parameters


@joined(UltrasonicSensor)
def part(device: UltrasonicSensor, at: At) -> Part:
    """Its two pins."""
    draw = at.draw
    sonar = sonar_parameters(device, draw, draw["ultrasonic_spread"])
    values = [sonar, draw["ultrasonic_delay_s"], draw["ultrasonic_nothing_s"]]
    pins = [device.trigger_pin, device.echo_pin]
    return Part("ultrasonic_kind", at.number, pins, ffi.new("ultrasonic_parameters *", values))
