"""Light sensors.

On a board a phototransistor discharges a capacitor; the time that it takes is the shorter, the brighter it is. The
current of the phototransistor is proportional to the light, so   brightness ∝ 1 / decay time.
In a robot without a board the irradiance itself is read, by section 1.9 of the notes.

Capacitor and phototransistor stand side by side (Robotics with the Board of Education Shield, chapter 6).

    [device.light_left]
    type = "light_sensor"
    pin = "A1"
    position_m = [0.050, 0.040]
    heading_rad = 0.5

    robot.light_left.brightness
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

from boebot.devices.device import (
    ANALOG_PINS,
    GROUND,
    Angle,
    Checkup,
    NotNegative,
    Point,
    Positive,
    Sensor,
    SlowDevice,
    Wire,
)
from boebot.devices.faults import DIRTY

LONGEST_US = 14_000  # on the wire: this time or longer
FRAME_TICKS = 2  # one reading in each servo frame


class Light(NamedTuple):
    """One light sensor."""

    decay_time: float | None
    """Seconds that the capacitor took; None if it could not be measured, or there is none."""
    brightness: float | None
    """Twice as much in twice the light: 1 / decay time (1/s), or the irradiance in a robot without a board, whose
    sensor needs no time. None if it could not be measured."""
    dark: bool
    """It took as long as the board waits, or longer."""
    age: float
    """Seconds since the measurement; infinite if there was none."""
    valid: bool
    """The reading is fresh and could be measured."""


class LightSensor(SlowDevice, tag="light_sensor", frozen=True, kw_only=True):
    """Phototransistor read by its RC decay time."""

    pin: int | str
    position_m: Point
    heading_rad: float

    READING: ClassVar = Light
    GROUP: ClassVar[str] = "lights"
    NAMES: ClassVar[tuple[str, ...]] = ("light_left", "light_right")
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    FAULTS: ClassVar = DIRTY
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("pin", "collector", part="1 kΩ"),
        Wire(GROUND, "collector", part="0.1 µF"),
        Wire(GROUND, "emitter"),
    )
    # Port D has its own pin-change interrupt; on port C the encoders' interrupt stamps the edge, on pin 8 Timer1.
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": (*range(9), *ANALOG_PINS)}
    AGE: ClassVar[str] = "light_age"
    PERIOD_TICKS: ClassVar[int] = FRAME_TICKS
    COLUMNS: ClassVar = (("decay_time", "s", 6),)
    SHOWN: ClassVar = ("decay_time", "ms", 1e3, 3)

    def checkup(self, readings: Sequence[Light]) -> Checkup:
        """See `Device`."""
        newest = readings[-1]
        expected = f"up to {LONGEST_US / 1000:g} ms, less in brighter light"
        if newest.decay_time is None:
            return Checkup("not measured", expected, f"is its capacitor (0.1 µF) between {self.wired_to} and ground?")
        if newest.dark:
            return Checkup(f"dark, {LONGEST_US / 1000:g} ms or longer", expected)
        return Checkup(f"{1000 * newest.decay_time:.3f} ms", expected)

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> Light:
        """See `SlowDevice`."""
        us = getattr(message, name)
        if age == math.inf or us == 0:
            return Light(None, None, False, age, False)
        return Light(us * 1e-6, 1e6 / us, us >= LONGEST_US, age, fresh)


class Phototransistor(Sensor, tag="phototransistor", frozen=True, kw_only=True):
    """A light sensor (section 1.9): L = sum of P max(0, cos theta) / (d0^2 + d^2)."""

    position_m: Point
    heading_rad: Angle
    near_distance_m: Positive = 0.05  # d0
    ambient: NotNegative = 0.0
    sigma: NotNegative = 0.01
    height_m: NotNegative = 0.09

    READING: ClassVar = Light
    GROUP: ClassVar[str] = "lights"
    COLUMNS: ClassVar = (("brightness", "w_m2", 5),)
    SHOWN: ClassVar = ("brightness", "W/m²", 1.0, 2)

    def reading(self, values: Sequence[float], age: float) -> Light:
        """See `VehicleDevice`."""
        return Light(None, values[0], False, age, True)
