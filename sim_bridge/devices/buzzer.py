"""The buzzer: it is there, and its pin says what it sounds."""

from __future__ import annotations

from boebot.devices.buzzer import PiezoBuzzer
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined


@joined(PiezoBuzzer)
def part(device: PiezoBuzzer, at: At) -> Part:
    """Its pin."""
    return Part("buzzer_kind", at.number, [device.pin], ffi.NULL)
