"""How a device is wired to a board, as data: each kind of device says it of itself (`WIRES`, `CONNECTOR`)."""

from __future__ import annotations

from typing import Final, NamedTuple

FIVE_VOLTS: Final = "5 V"
GROUND: Final = "ground"
PACK: Final = "pack +"
SERVO_POWER: Final = "servo power"  # 5 V, or the pack's plus: by the robot's supply

BREADBOARD: Final = "breadboard"
SERVO_PORTS: Final = range(10, 14)  # pins that the Board of Education Shield has three-pin sockets for


class Wire(NamedTuple):
    """One wire between a board and a device."""

    pin: str
    """Where it begins: the key of a pin in the robot's file, such as "led_pin", or one of the supplies above."""
    to: str
    """The terminal of the device where it ends."""
    colour: str = ""
    """In the device's own cable; empty: the wire is yours, and so is its colour."""
    part: str = ""
    """What is in it, such as "220 Ω"; empty: nothing."""


SERVO_CABLE: Final = (
    Wire("pin", "signal", "white"),
    Wire(SERVO_POWER, "power", "red"),
    Wire(GROUND, "ground", "black"),
)


def servo_socket(pin: int) -> str:
    """What a servo's plug goes into."""
    return f"servo port {pin}" if pin in SERVO_PORTS else "three-pin header on the breadboard"
