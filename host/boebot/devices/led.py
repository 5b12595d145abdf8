"""LED: lights while current flows, through a resistor, between a pin and ground or 5 V.

What a page shows of it is its mean brightness since it last looked, so that a dimmed one (analogWrite) looks dimmed.
For programs of one's own: the kit's firmware has none.

    [device.lamp]
    type = "led"
    pin = 6
    colour = "green"
    to = "supply"                  # lit while the pin is low; "ground", which is usual: while it is high
    position_m = [0.02, 0.0]
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from boebot.devices.device import FIVE_VOLTS, GROUND, Column, Device, Place, Point, Run, Wire
from boebot.devices.drawing import TOP, Item, circle

SEEN = 0.01  # of full brightness: less looks dark
RADIUS_M = 0.005
BOARD_LED_PIN = 13  # of an Uno, which has one itself, "L"
_COLOURS = {"red": "#e53935", "yellow": "#fdd835", "green": "#43a047", "blue": "#1e88e5", "white": "#fafafa"}


class Led(Device, tag="led", frozen=True, kw_only=True):
    """A light-emitting diode with its resistor."""

    pin: int | str
    position_m: Point = (0.0, 0.0)
    colour: Literal["red", "yellow", "green", "blue", "white"] = "red"
    to: Literal["ground", "supply"] = "ground"

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    HEARS: ClassVar[frozenset[str]] = frozenset({"pin"})
    COLUMNS: ClassVar = (("brightness", "", 3),)
    SHOWN: ClassVar = ("brightness", "%", 100.0, 0)

    def wires(self) -> tuple[Wire, ...]:
        """See `Device`."""
        if self.to == "ground":
            return Wire("pin", "anode", part="220 Ω"), Wire(GROUND, "cathode")
        return Wire("pin", "cathode", part="220 Ω"), Wire(FIVE_VOLTS, "anode")

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Brightness, of the full one; and whether it looks lit."""
        (brightness,) = super().columns(place, run)
        return [brightness, Column("lit", "", np.asarray(brightness.values > SEEN), None)]

    def sign(self) -> tuple[str, str]:
        """See `Device`."""
        return "lit", _COLOURS[self.colour]

    def drawing(self, name: str) -> list[Item]:
        """Filled and larger while it is lit."""
        dark = Item(circle(self.position_m, RADIUS_M), ink="ink", fill="floor", closed=True, width=0.8, layer=TOP)
        lit = dark._replace(points=circle(self.position_m, 2 * RADIUS_M), fill=_COLOURS[self.colour], when=name)
        return [dark, lit]
