"""LEDs: the current through diode and resistor is their brightness."""

from __future__ import annotations

from boebot.devices.led import Led
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined

FORWARD_V = {"red": 2.0, "yellow": 2.1, "green": 2.2, "blue": 3.2, "white": 3.2}  # data: typical at 20 mA, 5 mm


@joined(Led)
def part(device: Led, at: At) -> Part:
    """Diode and resistor."""
    spread = max(0.1, 1.0 + at.draw["led_spread"] * at.draw(260 + at.number, 0))
    values = [FORWARD_V[device.colour], at.draw["led_resistor_ohm"], spread, device.to == "supply"]
    return Part("led_kind", at.number, [device.pin], ffi.new("led_parameters *", values))
