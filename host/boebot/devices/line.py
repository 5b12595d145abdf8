"""Line sensors that look at the floor: Parallax QTI, an infra-red LED and a phototransistor.

The phototransistor discharges a capacitor; over a bright floor soon, over a dark line late. So a decay time above the
sensor's threshold is a dark floor. In a robot without a board the floor's reflectance itself is read.

    [device.line_left]
    type = "line_sensor"
    pin = 7
    position_m = [0.050, 0.019]

    if robot.line_left.dark: ...
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import msgspec

from boebot.devices.device import (
    ANALOG_PINS,
    FIVE_VOLTS,
    GROUND,
    Checkup,
    Column,
    Device,
    NotNegative,
    Place,
    Point,
    Run,
    Sensor,
    Share,
    SlowDevice,
    Wire,
    pin_number,
)
from boebot.devices.faults import DIRTY
from boebot.link.messages import LineTelemetry

FRAME_TICKS = 2  # one reading in each servo frame


class Line(NamedTuple):
    """One line sensor."""

    decay_time: float | None
    """Seconds that the capacitor took; None if it could not be measured, or there is none."""
    reflectance: float | None
    """Share of the light that the floor throws back, in a robot without a board; None on a board."""
    dark: bool
    """The floor below is dark, by the sensor's threshold."""
    age: float
    """Seconds since the measurement; infinite if there was none."""
    valid: bool
    """The reading is fresh and could be measured."""


class LineSensor(SlowDevice, tag="line_sensor", frozen=True, kw_only=True):
    """QTI sensor, read by its RC decay time."""

    pin: int | str
    position_m: Point
    dark_s: Annotated[float, msgspec.Meta(gt=0, lt=0.014)] = 0.001  # a longer decay is a dark floor

    READING: ClassVar = Line
    GROUP: ClassVar[str] = "lines"
    NAMES: ClassVar[tuple[str, ...]] = ("line_left", "line_middle", "line_right")
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    WIRES: ClassVar[tuple[Wire, ...]] = (  # Parallax, "QTI Sensor", document 555-27401
        Wire("pin", "R", "red"),
        Wire(FIVE_VOLTS, "W", "white"),
        Wire(GROUND, "B", "black"),
    )
    NEEDS: ClassVar[dict[str, str]] = {"pin-change interrupt of port D": "line sensors"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": tuple(range(8))}
    MESSAGE: ClassVar[type] = LineTelemetry
    AGE: ClassVar[str] = "line_age"
    PERIOD_TICKS: ClassVar[int] = FRAME_TICKS
    FAULTS: ClassVar = DIRTY
    COLUMNS: ClassVar = (("decay_time", "s", 6),)
    SHOWN: ClassVar = ("decay_time", "ms", 1e3, 3)

    def checkup(self, readings: Sequence[Line]) -> Checkup:
        """See `Device`."""
        newest = readings[-1]
        expected = f"less than {1000 * self.dark_s:g} ms over a bright floor, more over a line"
        if newest.decay_time is None:
            return Checkup("not measured", expected, f"is it plugged in: 5 V, ground, red to {self.wired_to}?")
        return Checkup(f"{1000 * newest.decay_time:.3f} ms, {'dark' if newest.dark else 'bright'}", expected)

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> Line:
        """See `SlowDevice`."""
        us = getattr(message, name)
        if age == math.inf or us == 0:
            return Line(None, None, False, age, False)
        return Line(us * 1e-6, None, us * 1e-6 > self.dark_s, age, fresh)


class ReflectanceSensor(Sensor, tag="reflectance_sensor", frozen=True, kw_only=True):
    """A sensor that looks at the floor of a robot without a board: the mean reflectance of the spot below it."""

    position_m: Point
    spot_m: NotNegative = 0.004  # radius of the spot
    dark_below: Share = 0.3  # less is a dark floor
    sigma: NotNegative = 0.02

    READING: ClassVar = Line
    GROUP: ClassVar[str] = "lines"
    COLUMNS: ClassVar = (("reflectance", "", 4),)
    SHOWN: ClassVar = ("reflectance", "", 1.0, 2)

    def reading(self, values: Sequence[float], age: float) -> Line:
        """See `VehicleDevice`."""
        return Line(None, values[0], values[0] < self.dark_below, age, True)


class LineModule(Device, tag="line_module", frozen=True, kw_only=True):
    """A reflex coupler with a comparator (TCRT5000 or ITR20001 modules), or its voltage. For programs of one's own: the
    kit's firmware has none."""

    pin: int | str
    position_m: Point
    output: Literal["digital", "analog"] = "digital"
    dark: Literal["low", "high"] = "high"  # level of a digital output over a dark floor

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    WIRES: ClassVar[tuple[Wire, ...]] = (Wire("pin", "OUT"), Wire(FIVE_VOLTS, "VCC"), Wire(GROUND, "GND"))
    FAULTS: ClassVar = DIRTY
    COLUMNS: ClassVar = (("voltage", "v", 3), ("dark", "", None))
    SHOWN: ClassVar = ("voltage", "V", 1.0, 2)
    SIGN: ClassVar = ("dark", "ink")

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if self.output == "digital" or pin_number(self.pin) in ANALOG_PINS:
            return None
        return "pin", f" is pin {self.pin}, which measures no voltage; expected A0 to A5"

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Voltage before the comparator; and whether that takes the floor for dark."""
        volts, dark = super().columns(place, run)
        return [volts, dark._replace(values=dark.values > 0)]
