"""Infra-red sensors that look for objects near by.

On a board an LED flashes at 38 kHz, and a receiver says whether something reflects it. The firmware reads the pairs
every few ticks; between two readings the last one stands, with its age. With `sweep = true` it flashes at 38, 39, 40,
41 and 42 kHz in turn, at which the receiver is less and less sensitive: the nearer the object, the more of the five
show it (zones of a few centimetres: Parallax, "Robotics with the Board of Education Shield for Arduino", chapter 8).
A robot without a board has the notes' IR proximity sensor, (3.9) to (3.14): a number from 0 to 1.

    [device.infrared_left]
    type = "infrared_pair"
    led_pin = 9
    receiver_pin = 10
    position_m = [0.050, 0.040]
    heading_rad = 0.45
    beam_rad = 0.40
    range_m = 0.20

    if robot.infrared_left.detected: ...
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, NamedTuple

import msgspec
import numpy as np

from boebot.devices.device import (
    FIVE_VOLTS,
    GROUND,
    Angle,
    BeamRays,
    Checkup,
    Column,
    Device,
    FaultKind,
    NotNegative,
    Opening,
    Place,
    Point,
    Positive,
    Reader,
    Readout,
    Run,
    Sensor,
    Share,
    Wire,
)
from boebot.devices.drawing import Item, cone
from boebot.devices.latest import NEVER, STALE_PERIODS, Latest
from boebot.link.messages import DevicesTelemetry, Telemetry
from boebot.link.messages import Infrared as Bits

SWEEP_TICKS = 5  # of a whole sweep: one frequency in each
_PERIOD_TICKS = 5  # where no schedule is given
_SHADE, _LIT = 0.22, 0.5


class Infrared(NamedTuple):
    """One infra-red sensor."""

    detected: bool
    """Something reflected the last flash; without a board: the reading is at the sensor's threshold or above."""
    age: float
    """Seconds since the last flash; infinite if there was none."""
    valid: bool
    """The reading is fresh."""
    zone: int | None = None
    """At how many of a sweep's five frequencies something reflected the flash: 0 nothing, 5 nearest. None: there is no
    sweep, or none is fresh."""
    reading: float | None = None
    """Without a board: 0 (nothing within range) to 1 (close by)."""


class InfraredBeam:
    """What both kinds have in common, beside `Device`."""

    __slots__ = ()

    position_m: Point
    heading_rad: float
    beam_rad: float
    range_m: float

    READING: ClassVar[type | None] = Infrared
    GROUP: ClassVar[str] = "infrared"
    SIGN: ClassVar[tuple[str, str] | None] = ("detected", "charger")

    def drawing(self, name: str) -> list[Item]:
        """Its beam: faint, and in its colour while something is detected."""
        seen = cone(self.position_m, self.heading_rad, self.beam_rad, self.range_m, _SHADE)
        return [seen, seen._replace(fill="charger", alpha=_LIT, when=name)]


class InfraredPair(InfraredBeam, Device, tag="infrared_pair", frozen=True, kw_only=True):
    """An infra-red LED and a 38 kHz receiver that looks the same way."""

    led_pin: int | str
    receiver_pin: int | str
    position_m: Point
    heading_rad: float
    beam_rad: Positive  # full opening
    range_m: Positive  # at 38 kHz, light surfaces

    NAMES: ClassVar[tuple[str, ...]] = ("infrared_left", "infrared_right")
    PINS: ClassVar[dict[str, str]] = {"led_pin": "led", "receiver_pin": "receiver"}
    HEARS: ClassVar[frozenset[str]] = frozenset({"led_pin"})
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("led_pin", "LED +", part="2 kΩ"),  # less: it reaches farther
        Wire(GROUND, "LED -"),
        Wire("receiver_pin", "receiver output", part="220 Ω"),
        Wire(FIVE_VOLTS, "receiver supply"),
        Wire(GROUND, "receiver ground"),
    )
    NEEDS: ClassVar[dict[str, str]] = {"Timer2": "infra-red carrier"}
    FAULTS: ClassVar = {"blinded": FaultKind("light of its carrier shines into the receiver throughout")}

    def checkup(self, readings: Sequence[Infrared]) -> Checkup:
        """See `Device`."""
        expected = f"nothing; something while a hand is {100 * self.range_m / 2:.0f} cm ahead of it"
        if sum(reading.detected for reading in readings) <= len(readings) / 2:
            return Checkup("nothing", expected)
        hint = "if nothing is ahead: does the LED, the sun or a lamp shine into the receiver? has it power?"
        return Checkup("something", expected, f"{hint} ({self.wired_to})")

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        schedule, bit, tick_s = schedule_of(place.devices), _bit(place), place.tick_s
        fresh = min(STALE_PERIODS * schedule.period_ticks, NEVER - 1)

        def read(sample: Telemetry, _: Latest) -> Infrared:
            ticks = sample.infrared_age
            age = ticks * tick_s if ticks < NEVER else float("inf")
            return Infrared(sample.infrared & bit != 0, age, ticks <= fresh)

        if not schedule.sweep:
            return read
        zone_fresh = STALE_PERIODS * max(schedule.period_ticks, SWEEP_TICKS, place.message_ticks)
        field = _zone_field(place)

        def read_zone(sample: Telemetry, slow: Latest) -> Infrared:
            message, since = slow.of(DevicesTelemetry)
            age = message.infrared_zone_age
            known = age < NEVER and age + since <= zone_fresh
            return read(sample, slow)._replace(zone=message[field] if known else None)

        return read_zone

    def has_messages(self, devices: Mapping[str, Device]) -> bool:
        """The zones."""
        return schedule_of(devices).sweep

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Detected or not, the age, and the zone of a robot that sweeps."""
        age = run.raw["infrared_age"]
        found = [
            Column("detected", "", (run.raw["infrared"] & _bit(place)) != 0, None),
            Column("age", "s", np.where(age < NEVER, age * place.tick_s, np.nan), 3),
        ]
        if schedule_of(place.devices).sweep:
            messages, newest, _ = run.held(DevicesTelemetry)
            field = _zone_field(place)
            zones = [message[field] if message.infrared_zone_age < NEVER else np.nan for message in messages]
            found.append(Column("zone", "", np.array([*zones, np.nan])[newest], 0))
        return found

    def readout(self, place: Place, run: Run, columns: Mapping[str, Column]) -> Readout | None:
        """The zone of a robot that sweeps."""
        if "zone" not in columns:
            return None
        return Readout(place.name, "of 5", 0, columns["zone"].values, columns["age"].values)


class InfraredSchedule(Device, tag="infrared_schedule", frozen=True, kw_only=True):
    """How often the IR pairs are read."""

    period_ticks: Annotated[int, msgspec.Meta(ge=2, le=250)] = _PERIOD_TICKS
    sweep: bool = False  # flash at five frequencies in turn: zones of distance

    NAMES: ClassVar[tuple[str, ...]] = ("infrared",)


def schedule_of(devices: Mapping[str, Device]) -> InfraredSchedule:
    """How often the pairs among these devices are read."""
    found = devices.get("infrared")
    return found if isinstance(found, InfraredSchedule) and found.on else InfraredSchedule()


def _bit(place: Place) -> int:
    return int(Bits[place.name.removeprefix("infrared_").upper()])


def _zone_field(place: Place) -> int:
    return DevicesTelemetry._fields.index(place.name.replace("infrared_", "infrared_zone_"))


class InfraredProximity(InfraredBeam, Sensor, tag="infrared_proximity", frozen=True, kw_only=True):
    """The notes' IR proximity sensor (3.9) to (3.14): a reading from 0 to 1."""

    position_m: Point
    heading_rad: Angle
    beam_rad: Opening = 0.5  # full opening
    rays: BeamRays = 3
    range_m: Positive = 1.0  # D
    c1_m2: NotNegative = 0.03
    c2: NotNegative = 0.1
    sigma: NotNegative = 0.01  # relative, of (3.1)
    height_m: NotNegative = 0.06
    threshold: Share = 0.3  # a reading from here on is a thing detected

    SHOWN: ClassVar = ("reading", "", 1.0, 2)

    def reading(self, values: Sequence[float], age: float) -> Infrared:
        """See `VehicleDevice`."""
        return Infrared(values[0] >= self.threshold, age, True, None, values[0])

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Detected or not, and the reading."""
        values = run.values(place.name)[:, 0]
        return [Column("detected", "", values >= self.threshold, None), Column("reading", "", values, 5)]
