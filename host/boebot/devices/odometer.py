"""The notes' odometer (sections 1.4, 2.2) of a robot without a board: a pose, calibrated once at the start.

[device.odometer]
type = "odometer"

robot.odometer.x
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, NamedTuple

from boebot.devices.device import NotNegative, Positive, Sensor


class OdometerPose(NamedTuple):
    """Where the odometer believes the robot to be; it got the true pose once, at the start."""

    x: float
    """m"""
    y: float
    """m"""
    heading: float
    """rad, counter-clockwise from the x axis"""
    age: float
    """Seconds since it was sampled."""
    valid: bool
    """Whether the value may be trusted."""


class Odometer(Sensor, tag="odometer", frozen=True, kw_only=True):
    """The notes' odometer (sections 1.4, 2.2): a pose, calibrated once at the start."""

    sigma_step_m: NotNegative = 0.0  # per wheel in 10 ms
    factor_left: Positive = 1.0  # k_w: what it takes the left wheel to travel for each metre
    factor_right: Positive = 1.0

    READING: ClassVar = OdometerPose
    NAMES: ClassVar[tuple[str, ...]] = ("odometer",)
    COLUMNS: ClassVar = (("x", "m", 5), ("y", "m", 5), ("heading", "rad", 5))

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if not self.period_s:
            return None
        return "period_s", f" is {self.period_s:g}; expected none, as an odometer adds up the way of every step"

    def reading(self, values: Sequence[float], age: float) -> OdometerPose:
        """See `VehicleDevice`."""
        x, y, heading = values
        return OdometerPose(x, y, heading, age, True)
