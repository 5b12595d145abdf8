"""Devices of robots without a board: what a simulated vehicle is driven by and senses with, in the notes' terms.

They have no pins; brains meet their readings by the same names as those of a robot with a board. Models and symbols are
those of the lecture notes (sections 1.2.2, 1.2.3, 3.2.3 and 3.2.4); every key carries its unit in its name.
"""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from boebot.devices.device import Device

LARGEST = 1e12  # of any number: products of some of them stay finite
Positive = Annotated[float, msgspec.Meta(gt=0, le=LARGEST)]
NotNegative = Annotated[float, msgspec.Meta(ge=0, le=LARGEST)]
Finite = Annotated[float, msgspec.Meta(ge=-LARGEST, le=LARGEST)]
Heading = Annotated[float, msgspec.Meta(ge=-1e4, le=1e4)]
Turn = Annotated[float, msgspec.Meta(ge=-2 * math.pi, le=2 * math.pi)]
Opening = Annotated[float, msgspec.Meta(ge=0, le=math.pi)]
BeamRays = Annotated[int, msgspec.Meta(ge=1, le=32)]
Share = Annotated[float, msgspec.Meta(gt=0, le=1)]
Point = tuple[Finite, Finite]


class VehicleDevice(Device, frozen=True, kw_only=True):
    """What every device of a vehicle has: no pins. `on = false` leaves it out."""

    def fault(self) -> tuple[str, str] | None:
        """A key that does not fit the others, and the rest of the sentence about it; None: all fit."""
        return None


class Motor(VehicleDevice, frozen=True, kw_only=True):
    """What drives a wheel by motor signals; both of a robot's are of one type."""


class DcMotor(Motor, tag="dc_motor", frozen=True, kw_only=True):
    """A DC motor with a gear, (1.1) to (1.10). Defaults are the notes' motor."""

    torque_constant_n_m_a: Positive = 0.0333  # c_t
    emf_constant_v_s: Positive = 0.0333  # c_e
    resistance_ohm: Positive = 0.62  # R
    inductance_h: NotNegative = 0.0002  # L
    coulomb_friction_n_m: NotNegative = 0.008  # c_C
    viscous_friction_n_m_s: NotNegative = 0.02  # c_v
    gear: Positive = 2.0  # G
    efficiency: Share = 1.0
    torque_maximum_n_m: Positive = 1.0
    voltage_maximum_v: Positive = 12.0  # at motor signal 1
    full: bool = False  # the current is a state, with the inductance, (1.6); otherwise it follows at once, (1.8)


class RegulatedMotor(Motor, tag="regulated_motor", frozen=True, kw_only=True):
    """The velocity-regulated motor (3.15); its reference at motor signal 1 is the body's `wheel_speed_maximum_m_s`."""

    gain_n_s: Positive = 10.0  # K
    torque_maximum_n_m: Positive = 1.0


class Sensor(VehicleDevice, frozen=True, kw_only=True):
    """What every sensor has: between two samples the last one stands, with its age (rule S4 of section 1.3)."""

    period_s: NotNegative = 0.0  # 0: every step
    reading_s: NotNegative = 0.0
    """what a reading takes the robot's hardware; sensors without a `period_s` are read one after another in each step,
    and with the brain's step they have to fit into it (section 3.2); 0: no time is said"""


class InfraredProximity(Sensor, tag="infrared_proximity", frozen=True, kw_only=True):
    """The notes' IR proximity sensor (3.9) to (3.14): a reading from 0 to 1."""

    position_m: Point
    heading_rad: Heading
    beam_rad: Opening = 0.5  # full opening
    rays: BeamRays = 3
    range_m: Positive = 1.0  # D
    c1_m2: NotNegative = 0.03
    c2: NotNegative = 0.1
    sigma: NotNegative = 0.01  # relative, of (3.1)
    height_m: NotNegative = 0.06
    threshold: Share = 0.3  # a reading from here on is a thing detected


class Sonar(Sensor, tag="sonar", frozen=True, kw_only=True):
    """The notes' sonar (section 1.6): a distance, or nothing heard."""

    position_m: Point
    heading_rad: Heading
    beam_rad: Opening = 0.35
    rays: BeamRays = 3
    range_min_m: Positive = 0.02
    range_max_m: Positive = 3.0
    sigma: NotNegative = 0.01
    miss: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.02  # 1 - p
    height_m: NotNegative = 0.08

    def fault(self) -> tuple[str, str] | None:
        """See `VehicleDevice`."""
        if self.range_min_m < self.range_max_m:
            return None
        return "range_min_m", f" is {self.range_min_m:g}; expected less than range_max_m, {self.range_max_m:g}"


class Laser(Sensor, tag="laser_range_finder", frozen=True, kw_only=True):
    """A laser range finder (section 1.7): distances from right to left. Defaults are the Hokuyo URG-04LX."""

    position_m: Point
    heading_rad: Heading = 0.0
    rays: Annotated[int, msgspec.Meta(ge=1, le=4096)] = 683
    step_rad: Positive = 2 * math.pi / 1024
    range_m: Positive = 4.0
    sigma: NotNegative = 0.01
    height_m: NotNegative = 0.10

    def fault(self) -> tuple[str, str] | None:
        """See `VehicleDevice`."""
        if self.step_rad * (self.rays - 1) < 2 * math.pi:
            return None
        return "step_rad", f" is {self.step_rad:g}; expected a fan of {self.rays} rays of less than a turn"


class Odometer(Sensor, tag="odometer", frozen=True, kw_only=True):
    """The notes' odometer (sections 1.4, 2.2): a pose, calibrated once at the start."""

    sigma_step_m: NotNegative = 0.0  # per wheel in 10 ms
    factor_left: Positive = 1.0  # k_w: what it takes the left wheel to travel for each metre
    factor_right: Positive = 1.0


class HeadingCompass(Sensor, tag="heading_compass", frozen=True, kw_only=True):
    """The notes' compass (section 1.8): a heading."""

    sigma_rad: NotNegative = 0.05
    bias_rad: Turn = 0.0


class Accelerometer(Sensor, tag="accelerometer", frozen=True, kw_only=True):
    """A proof mass on a spring along the heading (Fig. 1.10)."""

    proof_mass_kg: Positive = 1e-3
    stiffness_n_m: Positive = 40.0
    damping_n_s_m: Positive = 0.4  # critical
    range_m_s2: Positive = 20.0
    sigma_m_s2: NotNegative = 0.02
    bias_m_s2: Finite = 0.0


class Phototransistor(Sensor, tag="phototransistor", frozen=True, kw_only=True):
    """A light sensor (section 1.9): L = sum of P max(0, cos theta) / (d0^2 + d^2)."""

    position_m: Point
    heading_rad: Heading
    near_distance_m: Positive = 0.05  # d0
    ambient: NotNegative = 0.0
    sigma: NotNegative = 0.01
    height_m: NotNegative = 0.09


class TouchWhisker(VehicleDevice, tag="touch_whisker", frozen=True, kw_only=True):
    """A whisker without a switch: a segment that touches something or not."""

    root_m: Point
    tip_m: Point

    def fault(self) -> tuple[str, str] | None:
        """See `VehicleDevice`."""
        return (
            ("tip_m", " is where root_m is; expected a whisker that has a length")
            if self.tip_m == self.root_m
            else None
        )


class Energy(VehicleDevice, tag="energy", frozen=True, kw_only=True):
    """The notes' battery (section 1.9): its energy E in [0, 1] is read as a voltage."""

    idle_per_s: NotNegative = 0.002  # p_0
    signal_per_s: NotNegative = 0.004  # p_m
    charger_per_s: NotNegative = 0.1  # p_c
    empty_v: Positive = 10.0
    full_v: Positive = 12.0
    sigma_v: NotNegative = 0.0

    def fault(self) -> tuple[str, str] | None:
        """See `VehicleDevice`."""
        if self.empty_v < self.full_v:
            return None
        return "full_v", f" is {self.full_v:g}; expected more than empty_v, {self.empty_v:g} V"


AnyVehicleDevice = (
    DcMotor
    | RegulatedMotor
    | InfraredProximity
    | Sonar
    | Laser
    | Odometer
    | HeadingCompass
    | Accelerometer
    | Phototransistor
    | TouchWhisker
    | Energy
)
