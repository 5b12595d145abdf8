"""Battery. On a board the pack's voltage behind a divider, against the supply:

voltage = ratio · result / 1024 · supply

In a robot without a board the notes' energy (section 1.9), read as a voltage.

    [device.battery]
    type = "battery"
    pin = "A0"
    ratio = 2.0

    robot.battery.voltage
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, NamedTuple

import msgspec

from boebot.devices.device import (
    ANALOG_PINS,
    GROUND,
    PACK,
    Checkup,
    NotNegative,
    Positive,
    SlowDevice,
    VehicleDevice,
    Wire,
)
from boebot.devices.latest import READ_TICKS, voltage

LOWER_KOHM = 10.0  # of the divider: the converter wants a source of 10 kΩ or less (data sheet, 24.6.1)
LEAST_V = 4.5  # of the pack; with less the servos hardly turn


class Battery(NamedTuple):
    """The pack."""

    voltage: float | None
    """Volts of the pack, or None if nothing was measured yet."""
    age: float
    """Seconds since it was measured; infinite if never."""
    valid: bool
    """The measurement is fresh."""


class BatteryDivider(SlowDevice, tag="battery", frozen=True, kw_only=True):
    """Battery voltage behind a divider."""

    pin: int | str
    ratio: Annotated[float, msgspec.Meta(ge=1)] = 2.0  # voltage of the pack for each volt at the pin

    READING: ClassVar = Battery
    NAMES: ClassVar[tuple[str, ...]] = ("battery",)
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"analog converter": "analog inputs"}
    CHIP_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": ANALOG_PINS}
    AGE: ClassVar[str] = "battery_age"
    PERIOD_TICKS: ClassVar[int] = READ_TICKS
    COLUMNS: ClassVar = (("voltage", "v", 3),)
    SHOWN: ClassVar = ("voltage", "V", 1.0, 2)

    def wires(self) -> tuple[Wire, ...]:
        """Two resistors from the pack to ground, and their middle to the pin: two equal ones halve the voltage."""
        pin = Wire("pin", "middle")
        if self.ratio == 1:
            return pin, Wire(PACK, "middle")
        upper_kohm = (self.ratio - 1) * LOWER_KOHM
        return pin, Wire(PACK, "middle", part=f"{upper_kohm:g} kΩ"), Wire(GROUND, "middle", part=f"{LOWER_KOHM:g} kΩ")

    def checkup(self, readings: Sequence[Battery]) -> Checkup:
        """See `Device`."""
        newest, expected = readings[-1], f"at least {LEAST_V:g} V"
        if newest.voltage is None:
            return Checkup("no reading", expected)
        low = f"charge or change the battery; if it is full, look at the divider on {self.wired_to}"
        return Checkup(f"{newest.voltage:.2f} V", expected, "" if newest.voltage >= LEAST_V else low)

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> Battery:
        """See `SlowDevice`."""
        at_pin = voltage(message.battery, message.supply)
        if age == math.inf or at_pin is None:
            return Battery(None, math.inf, False)
        return Battery(at_pin * self.ratio, age, fresh)


class Energy(VehicleDevice, tag="energy", frozen=True, kw_only=True):
    """The notes' battery (section 1.9): its energy E in [0, 1] is read as a voltage."""

    idle_per_s: NotNegative = 0.002  # p_0
    signal_per_s: NotNegative = 0.004  # p_m
    charger_per_s: NotNegative = 0.1  # p_c
    empty_v: Positive = 10.0
    full_v: Positive = 12.0
    sigma_v: NotNegative = 0.0

    READING: ClassVar = Battery
    COLUMNS: ClassVar = (("voltage", "v", 5),)
    SHOWN: ClassVar = ("voltage", "V", 1.0, 2)

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if self.empty_v < self.full_v:
            return None
        return "full_v", f" is {self.full_v:g}; expected more than empty_v, {self.empty_v:g} V"

    def reading(self, values: Sequence[float], age: float) -> Battery:
        """See `VehicleDevice`."""
        return Battery(values[0], age, True)
