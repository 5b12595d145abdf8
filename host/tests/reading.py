"""Readings of one device by itself, for tests."""

from __future__ import annotations

from typing import Any

from boebot.devices.device import Device, Place
from boebot.devices.latest import MESSAGE_TICKS, Latest

TICK_S = 0.01


def read(device: Device, name: str, message: Any, since: int = 0) -> Any:
    """What the board's device of that name reads, `since` ticks after a message of the slow devices."""
    place = Place(name, {name: device}, 0.033, TICK_S, MESSAGE_TICKS, slice(0, 1))
    return device.reader(place)(None, Latest({type(message): message}, message.tick + since))
