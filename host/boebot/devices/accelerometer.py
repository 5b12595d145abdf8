"""An accelerometer of a robot without a board: a proof mass on a spring along the heading (Fig. 1.10).

[device.accelerometer]
type = "accelerometer"

robot.accelerometer.value
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, NamedTuple

from boebot.devices.device import Finite, NotNegative, Positive, Sensor


class Acceleration(NamedTuple):
    """An acceleration along the heading."""

    value: float
    """m/s^2, forward positive"""
    age: float
    """Seconds since it was sampled."""
    valid: bool
    """Whether the value may be trusted."""


class Accelerometer(Sensor, tag="accelerometer", frozen=True, kw_only=True):
    """A proof mass on a spring along the heading (Fig. 1.10)."""

    proof_mass_kg: Positive = 1e-3
    stiffness_n_m: Positive = 40.0
    damping_n_s_m: Positive = 0.4  # critical
    range_m_s2: Positive = 20.0
    sigma_m_s2: NotNegative = 0.02
    bias_m_s2: Finite = 0.0

    READING: ClassVar = Acceleration
    NAMES: ClassVar[tuple[str, ...]] = ("accelerometer",)
    COLUMNS: ClassVar = (("value", "m_s2", 5),)
    SHOWN: ClassVar = ("value", "m/s²", 1.0, 2)

    def reading(self, values: Sequence[float], age: float) -> Acceleration:
        """See `VehicleDevice`."""
        return Acceleration(values[0], age, True)
