"""Character displays: how fast their controller works."""

from __future__ import annotations

from boebot.devices.display import Display
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined


@joined(Display)
def part(device: Display, at: At) -> Part:
    """Controller and glass."""
    oscillator = max(0.1, 1.0 + at.draw["display_spread"] * at.draw(280 + at.number, 0))
    pins = [device.rs_pin, device.enable_pin, device.d4_pin, device.d5_pin, device.d6_pin, device.d7_pin]
    return Part("display_kind", at.number, pins, ffi.new("display_parameters *", [oscillator]))
