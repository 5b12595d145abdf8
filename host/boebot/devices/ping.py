"""Ping))): an ultrasonic range finder. The echo pulse lasts as long as sound takes to the obstacle and back.

distance = c · echo / 2,   c = 331.5 m/s + 0.6 m/(s K) · temperature

A robot without a board has the notes' sonar (section 1.6): a distance, or nothing heard.

Its signal is on pin 8, the timer's capture input.

    [device.ping]
    type = "ping"
    pin = 8
    position_m = [0.060, 0.0]
    heading_rad = 0.0
    beam_rad = 0.70
    range_min_m = 0.02
    range_max_m = 3.0
    period_ticks = 5

    if robot.ping.distance is not None and robot.ping.distance < 0.2: ...
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
    Run,
    Sensor,
    Wire,
)
from boebot.devices.drawing import Item, arc, cone
from boebot.devices.latest import NEVER, STALE_PERIODS
from boebot.link.messages import PingStatus, Telemetry

TEMPERATURE_C = 20.0
SPEED_OF_SOUND = 331.5 + 0.6 * TEMPERATURE_C  # m/s, in air
METRES_PER_US = SPEED_OF_SOUND / 2 * 1e-6
_SHADE, _ECHO = 0.10, 0.14


class RangeFinder:
    """What range finders have in common, beside `Device`."""

    __slots__ = ()

    position_m: Point
    heading_rad: float
    beam_rad: float
    range_min_m: float
    range_max_m: float

    SHOWN: ClassVar[tuple[str, str, float, int] | None] = ("distance", "m", 1.0, 2)

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if self.range_min_m < self.range_max_m:
            return None
        return "range_min_m", f" is {self.range_min_m:g}; expected less than range_max_m, {self.range_max_m:g}"

    def drawing(self, name: str) -> list[Item]:
        """Its beam; and as far as an echo comes from."""
        seen = cone(self.position_m, self.heading_rad, self.beam_rad, self.range_max_m, _SHADE)
        there = [self.position_m, *arc(self.position_m, self.heading_rad, self.beam_rad, 1.0)]
        return [seen, seen._replace(points=there, ink="robot", width=0.6, alpha=_ECHO, reach_by=name)]


class EchoPulse(RangeFinder):
    """And those at a board."""

    __slots__ = ()

    FAULTS: ClassVar[Mapping[str, FaultKind]] = {
        "missing": FaultKind("no echo pulse comes"),
        "late": FaultKind("the echo pulse begins later by this", "s", default=0.01, most=1.0, harmless=0.0),
        "doubled": FaultKind("so long after its end the echo pulse comes again", "s", 0.001, least=1e-6, most=1.0),
    }

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Where a program drives it: distance (NaN: nothing near) and age."""
        distance, age = run.values(place.name).T
        return [
            Column("distance", "m", np.where(distance >= 0, distance, np.nan), 4),
            Column("age", "s", np.where(age >= 0, age, np.nan), 3),
        ]


class Ping(NamedTuple):
    """The range finder's last measurement."""

    distance: float | None
    """Metres to the nearest thing ahead, or None if no echo came back from within its range."""
    age: float
    """Seconds since the measurement ended or was given up; infinite if nothing was measured yet."""
    valid: bool
    """The measurement is fresh, and its status is OK or NOTHING_NEAR. Valid and None means: nothing near ahead."""
    status: PingStatus
    """OK: there is a distance. NOTHING_NEAR: no echo from within its range. TOO_NEAR: something is so near that its
    distance cannot be measured. ABSENT: no sensor answers. OFF: switched off, or not yet measured."""

    @property
    def too_near(self) -> bool:
        """Something is ahead, nearer than can be measured."""
        return self.status == PingStatus.TOO_NEAR

    @property
    def absent(self) -> bool:
        """No sensor answers: it is missing, or its wire is broken."""
        return self.status == PingStatus.ABSENT


class PingSensor(EchoPulse, Device, tag="ping", frozen=True, kw_only=True):
    """Parallax Ping))): an ultrasonic range finder on one pin. It sits on the turret of a robot that has one."""

    pin: int | str
    position_m: Point
    heading_rad: float
    beam_rad: Positive  # full opening
    range_min_m: Positive
    range_max_m: Positive
    period_ticks: Annotated[int, msgspec.Meta(ge=4, le=250)]

    READING: ClassVar = Ping
    NAMES: ClassVar[tuple[str, ...]] = ("ping",)
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    WIRES: ClassVar[tuple[Wire, ...]] = (Wire("pin", "SIG"), Wire(FIVE_VOLTS, "5 V"), Wire(GROUND, "GND"))
    NEEDS: ClassVar[dict[str, str]] = {"Timer1 input capture": ""}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": (8,)}

    def _echo_range_us(self) -> tuple[float, float]:
        """The range's ends on the wire. A Ping that hears nothing ends its pulse after 18.5 ms, as if at 3.18 m."""
        return 0.9 * self.range_min_m / METRES_PER_US, 1.03 * self.range_max_m / METRES_PER_US

    def checkup(self, readings: Sequence[Ping]) -> Checkup:
        """See `Device`."""
        newest = readings[-1]
        expected = f"{self.range_min_m:g} to {self.range_max_m:g} m, or nothing near"
        reads = newest.status.name.lower().replace("_", " ") if newest.distance is None else f"{newest.distance:.3f} m"
        if newest.absent:
            return Checkup("no answer", expected, f"is it plugged in: 5 V, ground, its signal to {self.wired_to}?")
        if newest.too_near:
            return Checkup(reads, expected, "take away what is before it; if nothing is, it is dirty or broken")
        return Checkup(reads, expected)

    def reader(self, place: Place) -> Reader:
        """See `Device`. Echoes from outside its range count as nothing near or too near."""
        least_us, greatest_us = self._echo_range_us()
        fresh, tick_s = min(STALE_PERIODS * self.period_ticks, NEVER - 1), place.tick_s

        def read(sample: Telemetry, _: object) -> Ping:
            ticks, status = sample.ping_age, PingStatus(sample.ping_status)
            if ticks >= NEVER:
                return Ping(None, float("inf"), False, status)
            echo_us = sample.ping_echo
            if status == PingStatus.OK and echo_us > greatest_us:
                status = PingStatus.NOTHING_NEAR
            elif status == PingStatus.OK and echo_us < least_us:
                status = PingStatus.TOO_NEAR
            distance = echo_us * METRES_PER_US if status == PingStatus.OK else None
            known = status in (PingStatus.OK, PingStatus.NOTHING_NEAR)
            return Ping(distance, ticks * tick_s, known and ticks <= fresh, status)

        return read

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Distance (NaN: no echo), age and status; that only by the kit's firmware."""
        if "ping_echo" not in (run.raw.dtype.names or ()):
            return super().columns(place, run)
        least_us, greatest_us = self._echo_range_us()
        echo_us, age = run.raw["ping_echo"], run.raw["ping_age"]
        echoed = (least_us <= echo_us) & (echo_us <= greatest_us) & (age < NEVER)
        return [
            Column("distance", "m", np.where(echoed, echo_us * METRES_PER_US, np.nan), 4),
            Column("age", "s", np.where(age < NEVER, age * place.tick_s, np.nan), 3),
            Column("status", "", run.raw["ping_status"], None),
        ]

    def drawing(self, name: str) -> list[Item]:
        """Its beam, which turns with the turret; and as far as an echo comes from."""
        return [item._replace(turns=True) for item in super().drawing(name)]


class Sonar(RangeFinder, Sensor, tag="sonar", frozen=True, kw_only=True):
    """The notes' sonar (section 1.6): a distance, or nothing heard."""

    position_m: Point
    heading_rad: Angle
    beam_rad: Opening = 0.35
    rays: BeamRays = 3
    range_min_m: Positive = 0.02
    range_max_m: Positive = 3.0
    sigma: NotNegative = 0.01
    miss: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.02  # 1 - p
    height_m: NotNegative = 0.08

    READING: ClassVar = Ping

    def reading(self, values: Sequence[float], age: float) -> Ping:
        """See `VehicleDevice`."""
        if values[0] < self.range_max_m:
            return Ping(values[0], age, True, PingStatus.OK)
        return Ping(None, age, True, PingStatus.NOTHING_NEAR)

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Distance; NaN: nothing heard."""
        distance = run.values(place.name)[:, 0]
        return [Column("distance", "m", np.where(distance < self.range_max_m, distance, np.nan), 5)]

    def drawing(self, name: str) -> list[Item]:
        """Its beam."""
        return [cone(self.position_m, self.heading_rad, self.beam_rad, self.range_max_m, _SHADE)]
