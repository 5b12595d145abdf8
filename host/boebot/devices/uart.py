"""The serial line to the host, pins 0 and 1 of an Arduino board. There is nothing to read from it.

[device.uart]
type = "uart"
receive_pin = 0
transmit_pin = 1
baud = 500000
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import msgspec

from boebot.devices.device import Device, Wire


class Uart(Device, tag="uart", frozen=True, kw_only=True):
    """The serial line to the host."""

    receive_pin: int | str
    transmit_pin: int | str
    baud: Annotated[int, msgspec.Meta(ge=9600, le=1_000_000)]

    NAMES: ClassVar[tuple[str, ...]] = ("uart",)
    PINS: ClassVar[dict[str, str]] = {"receive_pin": "receive", "transmit_pin": "transmit"}
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("receive_pin", "from the host", part="USB chip"),
        Wire("transmit_pin", "to the host", part="USB chip"),
    )
    CONNECTOR: ClassVar[str] = "USB socket"
    NEEDS: ClassVar[dict[str, str]] = {"USART0": ""}
    CHIP_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"receive_pin": (0,), "transmit_pin": (1,)}
