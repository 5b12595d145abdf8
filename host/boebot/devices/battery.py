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

from collections.abc import Sequence
from typing import Annotated, ClassVar, NamedTuple

import msgspec

from boebot.devices.analog import READ_TICKS, voltage
from boebot.devices.device import (
    ANALOG_PINS,
    Checkup,
    NotNegative,
    Place,
    Positive,
    Reader,
    SlowDevice,
    VehicleDevice,
)
from boebot.devices.latest import NEVER, Latest, fresh_ticks
from boebot.devices.readings import Readings
from boebot.devices.wiring import GROUND, PACK, Wire
from boebot.link.messages import DevicesTelemetry

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
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": ANALOG_PINS}
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

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        ratio, fresh, tick_s = self.ratio, fresh_ticks(READ_TICKS, place.message_ticks), place.tick_s

        def read(_: object, slow: Latest) -> Battery:
            message, since = slow.of(DevicesTelemetry)
            at_pin = voltage(message.battery, message.supply)
            if message.battery_age >= NEVER or at_pin is None:
                return Battery(None, float("inf"), False)
            ticks = message.battery_age + since
            return Battery(at_pin * ratio, ticks * tick_s, ticks <= fresh)

        return read


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

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        first = place.where.start
        return lambda sample, _: _of_readings(sample, first)


def _of_readings(sample: Readings, first: int) -> Battery:
    return Battery(sample.values[first], sample.ages[first], True)
