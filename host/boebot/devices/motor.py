"""What drives a wheel of a robot without a board: the notes' motors. Each gets the brain's motor signals, and there is
nothing to read from them.

    [device.motor_left]
    type = "regulated_motor"
"""

from __future__ import annotations

from boebot.devices.device import NotNegative, Positive, Share, VehicleDevice


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
