"""Which imperfections of a simulated robot can be switched off, by name, and what each switch sets.

The one table behind `boebot run --without`, `BoardRequest.without` and docs/reference/imperfections.md. A parameter in
capitals is one of imperfections.py, `supply.key` stands in the robot's file, `Type.key` is a key of a device of
boebot.devices.vehicle_devices. Its value here is the neutral one: with it the model is the ideal closed form.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from boebot.description import robots
from boebot.devices.device import VehicleDevice
from boebot.errors import BoardError


@dataclass(frozen=True)
class Switch:
    """An imperfection that can be switched off."""

    what: str
    """what then is as ideal, in one line"""
    neutral: Mapping[str, float]
    """parameter -> neutral value"""


def _off(what: str, *parameters: str, **others: float) -> Switch:
    """Of `parameters` the neutral value is 0."""
    return Switch(what, dict.fromkeys(parameters, 0.0) | others)


SWITCHES: Mapping[str, Switch] = {
    "servo_spread": _off("all servos are equally fast", "SERVO_TOP_SPREAD"),
    "servo_asymmetry": _off("servos turn equally fast in both directions", "SERVO_ASYMMETRY"),
    "servo_centre": _off("servos stand still at their centre pulse", "SERVO_CENTRE_SPREAD_US"),
    "dead_band": _off("servos answer the smallest pulse offset", "SERVO_DEAD_BAND_US"),
    "lag": _off("servos have their speed at once", "SERVO_LAG_S"),
    "coast_drag": _off("servos without pulses turn freely", "SERVO_COAST_N_S", "SERVO_COAST_N_M"),
    "motor_friction": Switch(
        "DC motors have no friction, their gear no losses",
        {"DcMotor.coulomb_friction_n_m": 0.0, "DcMotor.viscous_friction_n_m_s": 0.0, "DcMotor.efficiency": 1.0},
    ),
    "slip": _off("wheels roll, whatever the floor", "TYRE_SLIP", TYRE_GRIP=10.0),
    "encoder_errors": Switch(
        "encoders see each edge once; odometers are exact",
        {
            "ENCODER_MISSED": 0.0,
            "ENCODER_EXTRA": 0.0,
            "ENCODER_BOUNCES": 0.0,
            "Odometer.sigma_step_m": 0.0,
            "Odometer.factor_left": 1.0,
            "Odometer.factor_right": 1.0,
        },
    ),
    "bounce": _off("whiskers close and open once", "WHISKER_BOUNCE_S"),
    "infrared_noise": _off(
        "infra-red sensors tell the same each time, and never falsely",
        "INFRARED_SPREAD",
        "INFRARED_FALSE_HIT",
        "InfraredProximity.sigma",
    ),
    "cross_talk": _off("an infra-red receiver sees its own LED only", "INFRARED_DIRECT_M"),
    "ping_noise": _off("the distance of an echo is exact", "PING_SPREAD", "Sonar.sigma"),
    "ping_misses": _off("every echo is heard", "PING_MISS", "Sonar.miss"),
    "specular": _off("surfaces send sound back at any angle", PING_GRAZING_RAD=1.57),
    "laser_noise": _off("laser distances are exact", "Laser.sigma"),
    "battery_sag": _off(
        "the pack keeps its voltage under load, the regulator drops none", "supply.resistance_ohm", "supply.drop_out_v"
    ),
    "battery_load": _off(
        "nothing draws current: the pack stays full",
        "BOARD_A",
        "SERVO_IDLE_A",
        "SERVO_RUN_A_S_M",
        "SERVO_A_PER_N_M",
    ),
    "battery_noise": _off("the measured battery voltage is exact", "BATTERY_NOISE_V", "Energy.sigma_v"),
    "sharp_noise": _off("the Sharp's voltage is that of its curve", "SHARP_SPREAD", "SHARP_GAIN_SPREAD"),
    "sharp_delay": _off("the Sharp's value is not late", "SHARP_LATE_S"),
    "light_noise": _off(
        "light sensors are exact and alike", "LIGHT_SPREAD", "LIGHT_GAIN_SPREAD", "Phototransistor.sigma"
    ),
    "ambient_light": _off("lamps are the only light", "LIGHT_AMBIENT", "Phototransistor.ambient"),
    "compass_noise": _off("the compass tells the same each time", "COMPASS_SIGMA", "HeadingCompass.sigma_rad"),
    "compass_bias": _off(
        "no turned mounting, iron or motor current deflects the compass",
        "COMPASS_BIAS_RAD",
        "COMPASS_IRON",
        "COMPASS_PER_AMPERE",
        "HeadingCompass.bias_rad",
    ),
    "accelerometer_errors": _off(
        "the accelerometer has no noise and no bias", "Accelerometer.sigma_m_s2", "Accelerometer.bias_m_s2"
    ),
    "turret_centre": _off("the turret looks straight ahead at its centre pulse", "TURRET_CENTRE_SPREAD_US"),
    "sampling": _off("sensors of a robot without a board tell at every step", "Sensor.period_s"),
}


def neutral(without: Iterable[str]) -> dict[str, float]:
    """Parameters that these switches set, with their neutral values.

    Raises:
        BoardError: there is no such switch.
    """
    values: dict[str, float] = {}
    for name in without:
        if name not in SWITCHES:
            raise BoardError(f"there is no imperfection {name!r} to switch off; expected some of {', '.join(SWITCHES)}")
        values |= SWITCHES[name].neutral
    return values


def idealised(description: robots.RobotDescription, without: Iterable[str]) -> robots.RobotDescription:
    """The robot with neutral values in what its own file says: supply, and devices without a board.

    Raises:
        BoardError: there is no such switch.
    """
    values = neutral(without)
    supply = description.supply
    if supply is not None:
        supply = msgspec.structs.replace(supply, **_keys(values, "supply"))
    devices = {name: _device(device, values) for name, device in description.device.items()}
    return msgspec.structs.replace(description, supply=supply, device=devices)


def _keys(values: Mapping[str, float], owner: str) -> dict[str, float]:
    """Those of one owner, without its name."""
    return {name.removeprefix(f"{owner}."): value for name, value in values.items() if name.startswith(f"{owner}.")}


def _device(device: Any, values: Mapping[str, float]) -> Any:
    if not isinstance(device, VehicleDevice):
        return device
    changes: dict[str, float] = {}
    for kind in type(device).__mro__:
        changes |= _keys(values, kind.__name__)
    return msgspec.structs.replace(device, **changes)
