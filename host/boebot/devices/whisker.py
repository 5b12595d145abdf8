"""Whiskers: wires that touch something or not.

On a board each closes a switch to ground when it is bent: the wire, grounded by its screw, meets a post that a resistor
pulls up (Robotics with the Board of Education Shield, chapter 5). The firmware debounces it and samples it in every
tick. In a robot without a board it is a segment that touches something.

    [device.whisker_left]
    type = "whisker"
    pin = 5
    root_m = [0.045, 0.030]
    tip_m = [0.100, 0.055]

    if robot.whisker_left.pressed: ...
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final, NamedTuple

from boebot.devices.device import (
    FIVE_VOLTS,
    GROUND,
    Checkup,
    Column,
    Device,
    FaultKind,
    Place,
    Point,
    Reader,
    Run,
    VehicleDevice,
    Wire,
)
from boebot.devices.drawing import PARTS, Item
from boebot.link.messages import Whiskers


class Whisker(NamedTuple):
    """One whisker."""

    pressed: bool
    """Something bends it."""
    age: float
    """Seconds since it was sampled."""
    valid: bool
    """Whether the value may be trusted."""


_PRESSED: Final = Whisker(True, 0.0, True)
_FREE: Final = Whisker(False, 0.0, True)


class BentWire:
    """What both kinds have in common, beside `Device`."""

    __slots__ = ()

    root_m: Point
    tip_m: Point

    READING: ClassVar[type | None] = Whisker
    GROUP: ClassVar[str] = "whiskers"
    SIGN: ClassVar[tuple[str, str] | None] = ("pressed", "touch")

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Pressed or not: by telemetry, or, without the kit's firmware, by its contact."""
        if "whiskers" not in (run.raw.dtype.names or ()):
            return [Column("pressed", "", run.values(place.name)[:, 0] > 0, None)]
        return [Column("pressed", "", (run.raw["whiskers"] & _bit(place)) != 0, None)]

    def drawing(self, name: str) -> list[Item]:
        """Thicker and in its colour while it is pressed."""
        free = Item([self.root_m, self.tip_m], ink="ink", width=1.1, layer=PARTS)
        return [free, free._replace(ink="touch", width=3.0, when=name)]


class WhiskerSwitch(BentWire, Device, tag="whisker", frozen=True, kw_only=True):
    """A wire that closes a switch to ground when it is bent."""

    pin: int | str
    root_m: Point
    tip_m: Point

    NAMES: ClassVar[tuple[str, ...]] = ("whisker_left", "whisker_right")
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("pin", "post", part="220 Ω"),
        Wire(FIVE_VOLTS, "post", part="10 kΩ"),
        Wire(GROUND, "whisker", part="its screw"),
    )
    FAULTS: ClassVar = {
        "stuck": FaultKind("the contact is stuck", words=("open", "pressed")),
        "bouncing": FaultKind("the contact bounces for so long on average", "s", default=0.02, most=1.0, harmless=0.0),
    }

    def checkup(self, readings: Sequence[Whisker]) -> Checkup:
        """See `Device`."""
        expected = "free; pressed while you bend it"
        if not any(reading.pressed for reading in readings):
            return Checkup("free", expected)
        return Checkup(
            "pressed", expected, f"if nothing bends it, {self.wired_to} has contact with ground: look for a bent wire"
        )

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        bit = _bit(place)
        return lambda sample, _: _PRESSED if sample.whiskers & bit else _FREE


def _bit(place: Place) -> int:
    return int(Whiskers[place.name.removeprefix("whisker_").upper()])


class TouchWhisker(BentWire, VehicleDevice, tag="touch_whisker", frozen=True, kw_only=True):
    """A whisker without a switch: a segment that touches something or not."""

    root_m: Point
    tip_m: Point

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if self.tip_m != self.root_m:
            return None
        return "tip_m", " is where root_m is; expected a whisker that has a length"

    def reading(self, values: Sequence[float], age: float) -> Whisker:
        """See `VehicleDevice`."""
        return _PRESSED if values[0] else _FREE
