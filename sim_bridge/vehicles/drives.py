"""Parameters of the drives of vehicles without boards: C structs of sim_bridge/world with a caller's changes."""

from __future__ import annotations

from typing import Any

from sim_bridge._core import ffi, lib
from sim_bridge.devices.servo import RPM
from sim_bridge.robots.imperfections import AS_BUILT
from sim_bridge.vehicles.checked_structs import keys_of, known, struct

REGULATED_KEYS = ("gain_n_s", "torque_maximum_n_m", "speed_maximum_m_s")


def defaults(kind: str) -> dict[str, float]:
    """What `NAME_default` of a C struct `NAME_parameters` gives."""
    pointer = ffi.new(f"{kind}_parameters *")
    getattr(lib, f"{kind}_default")(pointer)
    return {key: getattr(pointer, key) for key in keys_of(f"{kind}_parameters")}


def dc_parameters(where: str, changes: Any) -> Any:
    """C struct of the notes' default DC motor with `changes`."""
    return struct("motor_dc_parameters", where, changes, defaults("motor_dc"))


def regulated_parameters(where: str, changes: Any) -> Any:
    """C struct of the default regulated motor with `changes`; it never coasts, so what says how is no key of it."""
    usual = defaults("motor_regulated")
    return struct("motor_regulated_parameters", where, known(where, changes, REGULATED_KEYS), usual)


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
