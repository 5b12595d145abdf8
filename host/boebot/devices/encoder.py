"""Wheel encoders: edges of a slotted disc, counted and timed by the firmware.

    distance = 2 pi r n / N,   speed = 2 pi r / (N t_edge)
A single-channel encoder knows no direction: its count only grows, its speed is never negative.

The kit's firmware stamps edges by the interrupt of port C, pins A0 to A5; programs of one's own have them on any pin,
such as 2 and 3 for attachInterrupt.

    [device.encoder_left]
    type = "encoder"
    pin = "A2"
    edges_per_turn = 64

    robot.encoder_left.distance
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, NamedTuple

import msgspec
import numpy as np

from boebot.devices.device import (
    ANALOG_PINS,
    FIVE_VOLTS,
    GROUND,
    Checkup,
    Column,
    Device,
    FaultKind,
    Place,
    Reader,
    Run,
    Wire,
)
from boebot.link.messages import Status, Telemetry

EDGE_PERIOD_SCALE = 16e-6  # seconds per count of the edge periods on the wire
_POWER = (Wire(FIVE_VOLTS, "supply"), Wire(GROUND, "ground"))


class Encoder(NamedTuple):
    """One wheel's encoder."""

    count: int  # type: ignore[assignment]  # hides a method of tuple that nobody wants here
    """Edges since the board started."""
    distance: float
    """Metres that the wheel has rolled since the board started; all of it counted forward if not `directed`."""
    speed: float
    """Metres per second along the ground, from the time between the last two edges; 0 if none within 0.5 s."""
    directed: bool
    """The encoder knows forward from backward."""
    age: float
    """Seconds since the count was read."""
    valid: bool
    """False while the line fires so fast that the firmware masks it."""


class WheelEncoder(Device, frozen=True, kw_only=True):
    """What both kinds of encoders have."""

    edges_per_turn: Annotated[int, msgspec.Meta(ge=2, le=4096)]  # of all lines together

    READING: ClassVar = Encoder
    GROUP: ClassVar[str] = "encoders"
    NAMES: ClassVar[tuple[str, ...]] = ("encoder_left", "encoder_right")
    NEEDS: ClassVar[dict[str, str]] = {"pin-change interrupt of port C": "encoders"}
    LINES: ClassVar[int]

    FAULTS: ClassVar[Mapping[str, FaultKind]] = {
        "missing": FaultKind("this share of the edges is not seen", default=1.0, harmless=0.0),
        "extra": FaultKind("after this share of the edges the line flickers", default=1.0, harmless=0.0),
        "noisy": FaultKind("a square wave is on its first line", "Hz", default=100e3, least=1.0, most=1e6),
    }

    def metres_per_edge(self, wheel_radius_m: float) -> float:
        """What the wheel rolls from one edge to the next (m)."""
        return 2 * math.pi * wheel_radius_m / self.edges_per_turn

    def checkup(self, readings: Sequence[Encoder]) -> Checkup:
        """See `Device`."""
        expected = "the same count; another one after you have turned the wheel"
        if not readings[-1].valid:
            return Checkup("too many edges", expected, f"the line fires by itself: look at {self.wired_to}")
        new = abs(readings[-1].count - readings[0].count)
        if new <= 1:  # a sensor may stand at the edge of a hole
            return Checkup(f"{readings[-1].count} edges", expected)
        return Checkup(
            f"{new} new edges", expected, f"if the wheel stands: look at the sensor, its gap and {self.wired_to}"
        )

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        side = place.name.removeprefix("encoder_")
        count_field, period_field = (Telemetry._fields.index(f"{what}_{side}") for what in ("encoder", "edge_period"))
        masked = int(Status[f"ENCODER_{side.upper()}_MASKED"])
        metres, directed = self.metres_per_edge(place.wheel_radius_m), self.LINES > 1

        def read(sample: Telemetry, _: object) -> Encoder:
            count, period = sample[count_field], sample[period_field]
            speed = metres / (period * EDGE_PERIOD_SCALE) if period else 0.0
            return Encoder(count, count * metres, speed, directed, 0.0, not sample.status & masked)

        return read

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Edges counted, and the time between the last two; of a program's run the edges that passed it, forward less
        backward."""
        if "values" in (run.raw.dtype.names or ()):
            return [Column("count", "", run.values(place.name)[:, 0].astype(np.int64), None)]
        side = place.name.removeprefix("encoder_")
        return [
            Column("count", "", run.raw[place.name], None),
            Column("period", "s", run.raw[f"edge_period_{side}"] * EDGE_PERIOD_SCALE, 6),
        ]


class SingleEncoder(WheelEncoder, tag="encoder", frozen=True, kw_only=True):
    """Single-channel wheel encoder: both edges counted, direction unknown."""

    pin: int | str

    LINES: ClassVar[int] = 1
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    WIRES: ClassVar[tuple[Wire, ...]] = (Wire("pin", "output"), *_POWER)
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": ANALOG_PINS}


class QuadratureEncoder(WheelEncoder, tag="quadrature_encoder", frozen=True, kw_only=True):
    """Two-channel wheel encoder: four edges per period, direction known."""

    pin_a: int | str
    pin_b: int | str

    LINES: ClassVar[int] = 2
    PINS: ClassVar[dict[str, str]] = {"pin_a": "a", "pin_b": "b"}
    WIRES: ClassVar[tuple[Wire, ...]] = (Wire("pin_a", "output A"), Wire("pin_b", "output B"), *_POWER)
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin_a": ANALOG_PINS, "pin_b": ANALOG_PINS}

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if self.edges_per_turn >= 4:
            return None
        return "edges_per_turn", f" is {self.edges_per_turn}; expected at least 4, two edges of each line"
