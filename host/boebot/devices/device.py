"""What every device of a robot's description has, and the pins of an Arduino board."""

from __future__ import annotations

from typing import ClassVar

import msgspec


def pin_number(pin: int | str) -> int:
    """The Arduino number 0..19 of a pin written as 0..13 or "A0".."A5".

    Raises:
        ValueError: there is no such pin.
    """
    if isinstance(pin, str) and len(pin) == 2 and pin[0] == "A" and pin[1] in "012345":
        return 14 + int(pin[1])
    if isinstance(pin, int) and 0 <= pin <= 13:
        return pin
    raise ValueError(f"there is no pin {pin!r}; expected 0..13 or 'A0'..'A5'")


def pin_name(number: int) -> str:
    """How the board's print names pin `number`: "0".."13", "A0".."A5"."""
    return str(number) if number < 14 else f"A{number - 14}"


class Device(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True, tag_field="type"):
    """What every device has. `on = false` reserves its pins and leaves it switched off; `plugged = false`: of a
    simulated robot's board it is switched on, but its plug is out."""

    on: bool = True
    plugged: bool = True

    PINS: ClassVar[dict[str, str]] = {}  # field of the pin -> role in the firmware's names ("" = the device itself)
    NEEDS: ClassVar[dict[str, str]] = {}  # unit of the chip -> who may share it ("" = nobody)
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {}  # field of the pin -> the pins that can do it

    def pins(self) -> dict[str, int]:
        """Role of each pin ("" for a device with one pin) and its Arduino number."""
        return {role: pin_number(getattr(self, field)) for field, role in self.PINS.items()}
