"""Compass. On a board an HMC5883L: the magnetic field along three axes, x forward, y left, z up.

With the sensor level the field's horizontal part points to magnetic north, so the robot's heading from there, counted
counter-clockwise, is   heading = atan2(-(y - y0), x - x0)   with (x0, y0) the field of the robot itself (hard iron).
In a robot without a board it is the notes' compass (section 1.8), with the heading from the x axis.

    [device.compass]
    type = "compass"
    sda_pin = "A4"
    scl_pin = "A5"

    robot.compass.heading
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, NamedTuple

import msgspec

from boebot.devices.device import FIVE_VOLTS, GROUND, Checkup, NotNegative, Sensor, SlowDevice, Wire
from boebot.link.messages import CompassStatus

TESLA_PER_COUNT = 1e-4 / 1090  # 1090 counts per gauss (data sheet, gain setting 1)
OVERFLOW = -4096
READ_TICKS = 4
FIELD_LEAST_UT, FIELD_MOST_UT = 15.0, 100.0  # the earth's is 22 to 67 µT; the robot's own iron adds to it
_SHOWN = ("heading", "°", 180 / math.pi, 1)


class Compass(NamedTuple):
    """The compass's last reading."""

    heading: float | None
    """Radians counter-clockwise, -pi..pi, from magnetic north, without a board from the x axis; None if not known."""
    field: tuple[float, float, float] | None
    """Tesla along x, y, z, or None."""
    status: CompassStatus
    """How the last exchange with it ended."""
    age: float
    """Seconds since it was read; infinite if never."""
    valid: bool
    """The reading is fresh."""


class MagneticCompass(SlowDevice, tag="compass", frozen=True, kw_only=True):
    """HMC5883L on the two-wire bus."""

    sda_pin: int | str
    scl_pin: int | str
    offset_counts: tuple[float, float] = (0.0, 0.0)  # of the robot's own iron along x and y, at 1090 counts a gauss

    READING: ClassVar = Compass
    NAMES: ClassVar[tuple[str, ...]] = ("compass",)
    PINS: ClassVar[dict[str, str]] = {"sda_pin": "sda", "scl_pin": "scl"}
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("sda_pin", "SDA"),
        Wire("scl_pin", "SCL"),
        Wire(FIVE_VOLTS, "VIN"),
        Wire(GROUND, "GND"),
    )
    NEEDS: ClassVar[dict[str, str]] = {"two-wire interface": "two-wire bus"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"sda_pin": (18,), "scl_pin": (19,)}
    AGE: ClassVar[str] = "compass_age"
    PERIOD_TICKS: ClassVar[int] = READ_TICKS
    COLUMNS: ClassVar = (("heading", "rad", 5),)
    SHOWN: ClassVar = _SHOWN

    def checkup(self, readings: Sequence[Compass]) -> Checkup:
        """See `Device`."""
        newest = readings[-1]
        expected = f"-180 to 180°, a field of {FIELD_LEAST_UT:g} to {FIELD_MOST_UT:g} µT"
        if newest.status != CompassStatus.OK or newest.field is None or newest.heading is None:
            hints = {
                CompassStatus.NO_ANSWER: f"is it plugged in: power, ground, SDA and SCL to {self.wired_to}?",
                CompassStatus.BUS_STUCK: f"something holds a wire of the bus low: {self.wired_to}",
            }
            reads = newest.status.name.lower().replace("_", " ")
            return Checkup(reads, expected, hints.get(newest.status, "its exchanges fail: look at its wires"))
        field_ut = 1e6 * math.hypot(*newest.field)
        reads = f"{math.degrees(newest.heading):.0f}°, {field_ut:.0f} µT"
        near = "is iron, a magnet or a motor near it? the field of the earth has 22 to 67 µT"
        return Checkup(reads, expected, "" if FIELD_LEAST_UT <= field_ut <= FIELD_MOST_UT else near)

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> Compass:
        """See `SlowDevice`."""
        status = CompassStatus(message.compass_status)
        counts = (message.compass_x, message.compass_y, message.compass_z)
        if age == math.inf or OVERFLOW in counts:
            return Compass(None, None, status, age, False)
        x, y, z = (count * TESLA_PER_COUNT for count in counts)
        ahead, aside = counts[0] - self.offset_counts[0], counts[1] - self.offset_counts[1]
        heading = math.atan2(-aside, ahead) if ahead or aside else None
        return Compass(heading, (x, y, z), status, age, status == CompassStatus.OK and heading is not None and fresh)


class HeadingCompass(Sensor, tag="heading_compass", frozen=True, kw_only=True):
    """The notes' compass (section 1.8): a heading."""

    sigma_rad: NotNegative = 0.05
    bias_rad: Annotated[float, msgspec.Meta(ge=-2 * math.pi, le=2 * math.pi)] = 0.0

    READING: ClassVar = Compass
    COLUMNS: ClassVar = (("heading", "rad", 5),)
    SHOWN: ClassVar = _SHOWN

    def reading(self, values: Sequence[float], age: float) -> Compass:
        """See `VehicleDevice`."""
        return Compass(values[0], None, CompassStatus.OK, age, True)
