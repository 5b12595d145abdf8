"""What a person works by hand: a button, a slide switch, a potentiometer. For programs of one's own: the kit's firmware
has none.

A button and a switch join their pin to ground or to 5 V while they are closed, and bounce. Open, the pin floats, unless
the program pulls it up (INPUT_PULLUP) or a resistor of 10 kΩ pulls it the other way. A potentiometer of 10 kΩ between
ground and 5 V gives the voltage of its wiper.

    [device.start]
    type = "button"
    pin = 2                        # to ground: digitalRead(2) is LOW while it is pressed

    [device.mode]
    type = "switch"
    pin = 3
    to = "supply"
    resistor = true                # to ground, while it is open
    closed = true                  # as a run begins

    [device.dial]
    type = "potentiometer"
    pin = "A0"
    position = 0.3                 # of its whole way, as a run begins

They are worked by `boebot run FILE --input start=1@0.5`, by `boebot.run(..., inputs=[("start", 1, 0.5)])`, on the live
page.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import msgspec
import numpy as np

from boebot.devices.device import ANALOG_PINS, FIVE_VOLTS, GROUND, Column, Device, Place, Point, Run, Wire
from boebot.devices.drawing import TOP, Item, circle, square

SIZE_M = 0.008
PULL = "10 kΩ"


class Contact(Device, frozen=True, kw_only=True):
    """What a button and a switch have in common."""

    pin: int | str
    position_m: Point = (0.0, 0.0)
    to: Literal["ground", "supply"] = "ground"
    resistor: bool = False
    """pulls the pin the other way while it is open"""

    PINS: ClassVar[dict[str, str]] = {"pin": ""}

    def wires(self) -> tuple[Wire, ...]:
        """See `Device`."""
        ends = (GROUND, FIVE_VOLTS) if self.to == "ground" else (FIVE_VOLTS, GROUND)
        pull = (Wire(ends[1], "one side", part=PULL),) if self.resistor else ()
        return Wire("pin", "one side"), *pull, Wire(ends[0], "other side")

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Whether it is closed."""
        assert self.SIGN is not None
        return [Column(self.SIGN[0], "", np.asarray(run.values(place.name)[:, 0] > 0), None)]

    def drawing(self, name: str) -> list[Item]:
        """Filled while it is closed."""
        edge = Item(square(self.position_m, SIZE_M), ink="ink", fill="floor", closed=True, width=1.0, layer=TOP)
        return [edge, edge._replace(fill="touch", when=name)]


class Button(Contact, tag="button", frozen=True, kw_only=True):
    """Closed while it is pressed."""

    SIGN: ClassVar = ("pressed", "touch")
    CONTROL: ClassVar = "button"


class SlideSwitch(Contact, tag="switch", frozen=True, kw_only=True):
    """Stays as it is."""

    closed: bool = False

    SIGN: ClassVar = ("closed", "touch")
    CONTROL: ClassVar = "switch"


class Potentiometer(Device, tag="potentiometer", frozen=True, kw_only=True):
    """A knob, or a slider."""

    pin: int | str
    position_m: Point = (0.0, 0.0)
    position: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.5

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    CHIP_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": ANALOG_PINS}
    WIRES: ClassVar[tuple[Wire, ...]] = (Wire("pin", "wiper"), Wire(GROUND, "low end"), Wire(FIVE_VOLTS, "high end"))
    COLUMNS: ClassVar = (("position", "", 3),)
    SHOWN: ClassVar = ("position", "%", 100.0, 0)
    CONTROL: ClassVar = "slider"

    def drawing(self, name: str) -> list[Item]:
        """A knob."""
        x, y = self.position_m
        knob = Item(circle((x, y), SIZE_M / 2), ink="ink", fill="floor", closed=True, width=1.0, layer=TOP)
        return [knob, Item([(x, y), (x + SIZE_M / 2, y)], ink="ink", width=1.0, layer=TOP)]
