"""Character display: two lines of 16 letters, an HD44780 controller, joined by four data lines (LiquidCrystal). For
programs of one's own: the kit's firmware has none.

What it shows is a value of the run, one for each line, wherever what a brain shows is: on the page, in replay, record
and run.csv. Glyphs that the program has made (createChar) are a box. As the real one, it loses what comes while it is
busy: 37 µs after an instruction or a letter, 1.52 ms after clearing it, 10 ms after power-on.

    [device.display]
    type = "display"
    rs_pin = 12
    enable_pin = 11
    d4_pin = 5
    d5_pin = 4
    d6_pin = 3
    d7_pin = 2
    position_m = [-0.03, 0.0]
"""

from __future__ import annotations

from typing import ClassVar

from boebot.devices.device import FIVE_VOLTS, GROUND, Device, Point, Wire
from boebot.devices.drawing import TOP, Item

SIZE_M = (0.036, 0.080)  # of a module of 80 mm x 36 mm
_ROM = {0x5C: "¥", 0x7E: "→", 0x7F: "←", 0xDF: "°", 0xFF: "█"}  # of A00, where it is not ASCII or kana
_ROM |= {0xE0 + number: letter for number, letter in enumerate("αäβεμσρg√⁻jˣ¢£ñöpqθ∞ΩüΣπxy千万円÷")}


def letters_of(codes: bytes) -> str:
    """Text of a display's codes (HD44780U data sheet, table 4, ROM A00), without spaces at its end."""
    return "".join(map(_letter, codes)).rstrip()


def _letter(code: int) -> str:
    if code < 0x10:
        return "□"
    if 0xA1 <= code < 0xDF:
        return chr(0xFF61 + code - 0xA1)  # half-width kana stand in the same order
    return _ROM.get(code, chr(code) if 0x20 <= code < 0x7E else " ")


class Display(Device, tag="display", frozen=True, kw_only=True):
    """A display of 16 x 2 letters."""

    rs_pin: int | str
    enable_pin: int | str
    d4_pin: int | str
    d5_pin: int | str
    d6_pin: int | str
    d7_pin: int | str
    position_m: Point = (0.0, 0.0)

    PINS: ClassVar[dict[str, str]] = {f"{name}_pin": name for name in ("rs", "enable", "d4", "d5", "d6", "d7")}
    HEARS: ClassVar[frozenset[str]] = frozenset(PINS)
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("rs_pin", "RS"),
        Wire("enable_pin", "E"),
        *(Wire(f"d{number}_pin", f"D{number}") for number in range(4, 8)),
        Wire(GROUND, "RW"),
        Wire(FIVE_VOLTS, "VDD"),
        Wire(GROUND, "VSS"),
    )

    def drawing(self, name: str) -> list[Item]:
        """Its module, across the robot."""
        (x, y), (deep, wide) = self.position_m, SIZE_M
        corners = [(x + i * deep / 2, y + j * wide / 2) for i, j in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
        return [Item(corners, ink="ink", closed=True, width=1.0, layer=TOP)]
