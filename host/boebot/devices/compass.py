"""Compass HMC5883L: the magnetic field along three axes, x forward, y left, z up.

With the sensor level the field's horizontal part points to magnetic north, so the robot's heading from there, counted
counter-clockwise, is   heading = atan2(-(y - y0), x - x0)   with (x0, y0) the field of the robot itself (hard iron).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from boebot.devices.freshness import MESSAGE_TICKS, fresh_ticks
from boebot.devices.infrared import NEVER
from boebot.link.messages import CompassStatus, DevicesTelemetry

TESLA_PER_COUNT = 1e-4 / 1090  # 1090 counts per gauss (data sheet, gain setting 1)
OVERFLOW = -4096
READ_TICKS = 4


class Compass(NamedTuple):
    """The compass's last reading."""

    heading: float | None
    """Radians counter-clockwise from magnetic north, -pi..pi, or None if it is not known."""
    field: tuple[float, float, float] | None
    """Tesla along x, y, z, or None."""
    status: CompassStatus
    """How the last exchange with it ended."""
    age: float
    """Seconds since it was read; infinite if never."""
    valid: bool
    """The reading is fresh."""


class CompassReader:
    """Reads the compass; `offset`: the robot's own field along x and y, in counts; `told_ticks`: from one message to
    the next."""

    def __init__(
        self, tick_s: float, offset: tuple[float, float] = (0.0, 0.0), told_ticks: int = MESSAGE_TICKS
    ) -> None:
        self._fresh = fresh_ticks(READ_TICKS, told_ticks)
        self._tick_s = tick_s
        self._offset = offset

    def __call__(self, devices: DevicesTelemetry, since: float = 0) -> Compass:
        """The last reading, `since` ticks after that message."""
        told, status = devices.compass_age, CompassStatus(devices.compass_status)
        ticks = told + since
        counts = (devices.compass_x, devices.compass_y, devices.compass_z)
        age = ticks * self._tick_s if told < NEVER else float("inf")
        if told >= NEVER or OVERFLOW in counts:
            return Compass(None, None, status, age, False)
        x, y, z = (count * TESLA_PER_COUNT for count in counts)
        ahead, aside = counts[0] - self._offset[0], counts[1] - self._offset[1]
        heading = math.atan2(-aside, ahead) if ahead or aside else None
        fresh = status == CompassStatus.OK and ticks <= self._fresh
        return Compass(heading, (x, y, z), status, age, fresh and heading is not None)
