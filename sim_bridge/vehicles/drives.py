"""Parameters of the drives of vehicles without boards: C structs of sim_bridge/world with a caller's changes."""

from __future__ import annotations

from typing import Any, Final

from boebot.devices.battery import Energy
from boebot.devices.motor import DcMotor, RegulatedMotor
from sim_bridge.devices import motor
from sim_bridge.devices.servo import RPM
from sim_bridge.robots.imperfections import AS_BUILT
from sim_bridge.vehicles.checked_structs import keys_of, known, struct

ENERGY: Final = {key: getattr(Energy(), key) for key in keys_of("energy_parameters")}
"""The notes' battery, by its rates in C."""


def dc_parameters(where: str, changes: Any) -> Any:
    """C struct of the notes' default DC motor with `changes`."""
    return struct("motor_dc_parameters", where, changes, motor.dc_parameters(DcMotor(full=True)))


def regulated_parameters(where: str, changes: Any) -> Any:
    """C struct of the default regulated motor with `changes`; it never coasts, so what says how is no key of it."""
    usual = motor.regulated_parameters(RegulatedMotor(), 0.3)
    return struct("motor_regulated_parameters", where, known(where, changes, usual), usual)


def servo_parameters(where: str, changes: Any, mount: int = 1, wheel_radius: float = 0.0331) -> Any:
    """C struct of the nominal servo with `changes`; magnitudes as in the table of imperfections."""
    top = AS_BUILT["servo_top_rpm"] * RPM
    usual = {
        "mount": mount,
        "wheel_radius": wheel_radius,
        "centre_us": 1500.0,
        "dead_band_us": AS_BUILT["servo_dead_band_us"],
        "top_ccw_rad_s": top,
        "scale_ccw_us": AS_BUILT["servo_scale_us"],
        "top_cw_rad_s": top,
        "scale_cw_us": AS_BUILT["servo_scale_us"],
        "lag_s": AS_BUILT["servo_lag_s"],
        "motor": {
            "gain_n_s": AS_BUILT["servo_gain_n_s"],
            "torque_maximum_n_m": AS_BUILT["servo_torque_n_m"],
            "coast_n_s": AS_BUILT["servo_coast_n_s"],
            "coast_maximum_n_m": AS_BUILT["servo_coast_n_m"],
        },
    }
    return struct("servo_motor_parameters", where, changes, usual)
