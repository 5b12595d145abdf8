"""Buttons and switches, which bounce, and potentiometers, whose wiper is noisy."""

from __future__ import annotations

from boebot.devices.input import Button, Contact, Potentiometer, SlideSwitch
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined


@joined(Button, SlideSwitch)
def contact(device: Contact, at: At) -> Part:
    """A contact."""
    closed = isinstance(device, SlideSwitch) and device.closed
    values = [device.to == "supply", device.resistor, closed, at.draw["contact_bounce_s"]]
    number = at.number + 20 * isinstance(device, SlideSwitch)  # an Uno has 20 pins; their noise is another's
    return Part("contact_kind", number, [device.pin], ffi.new("contact_parameters *", values))


@joined(Potentiometer)
def potentiometer(device: Potentiometer, at: At) -> Part:
    """A wiper."""
    noise_v = at.draw["potentiometer_noise_v"]
    return Part("potentiometer_kind", at.number, [device.pin], ffi.new("double[]", [device.position, noise_v]))
