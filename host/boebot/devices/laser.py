"""A laser range finder (section 1.7) of a robot without a board: distances from right to left.

[device.laser]
type = "laser_range_finder"
position_m = [0.0, 0.0]

robot.laser.distances
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, NamedTuple

import msgspec
import numpy as np

from boebot.devices.device import Angle, Column, NotNegative, Place, Point, Positive, Reader, Readout, Run, Sensor
from boebot.devices.drawing import Item, Sweeps, cone
from boebot.devices.readings import Readings

_SHADE = 0.06


class Scan(NamedTuple):
    """A laser range finder's last sweep, from right to left."""

    distances: tuple[float, ...]
    """m; -1: nothing within range"""
    angles: tuple[float, ...]
    """rad from straight ahead, counter-clockwise"""
    age: float
    """Seconds since it was sampled."""
    valid: bool
    """Whether the value may be trusted."""


class Laser(Sensor, tag="laser_range_finder", frozen=True, kw_only=True):
    """A laser range finder (section 1.7): distances from right to left. Defaults are the Hokuyo URG-04LX."""

    position_m: Point
    heading_rad: Angle = 0.0
    rays: Annotated[int, msgspec.Meta(ge=1, le=4096)] = 683
    step_rad: Positive = 2 * math.pi / 1024
    range_m: Positive = 4.0
    sigma: NotNegative = 0.01
    height_m: NotNegative = 0.10

    READING: ClassVar = Scan
    NAMES: ClassVar[tuple[str, ...]] = ("laser",)

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if self.step_rad * (self.rays - 1) < 2 * math.pi:
            return None
        return "step_rad", f" is {self.step_rad:g}; expected a fan of {self.rays} rays of less than a turn"

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        where, first = place.where, place.where.start
        angles = self._angles()
        return lambda sample, _: _scan(sample, where, first, angles)

    def columns(self, place: Place, run: Run) -> list[Column]:
        """One per ray."""
        return [Column(f"distance_{ray}", "m", values, 4) for ray, values in enumerate(run.values(place.name).T)]

    def readout(self, place: Place, run: Run, columns: Mapping[str, Column]) -> Readout | None:
        """The nearest distance."""
        values = run.values(place.name)
        nearest = np.where(values < 0, np.inf, values).min(axis=1, initial=np.inf)
        shown = np.where(np.isfinite(nearest), nearest, np.nan)
        return Readout(place.name, "m", 2, shown, run.ages(place.name))

    def drawing(self, name: str) -> list[Item]:
        """The fan of its rays."""
        return [cone(self.position_m, self.heading_rad, self.step_rad * (self.rays - 1), self.range_m, _SHADE)]

    def sweeps(self, place: Place, run: Run) -> Sweeps:
        """Each of its scans."""
        values, ages = run.values(place.name), run.ages(place.name)
        return Sweeps(self.position_m, self.heading_rad, np.array(self._angles()), values, self.range_m, ages)

    def _angles(self) -> tuple[float, ...]:
        """Of its rays, from right to left (rad)."""
        begin = -self.step_rad * (self.rays - 1) / 2
        return tuple(begin + self.step_rad * ray for ray in range(self.rays))


def _scan(sample: Readings, where: slice, first: int, angles: tuple[float, ...]) -> Scan:
    return Scan(sample.values[where], angles, sample.ages[first], True)
