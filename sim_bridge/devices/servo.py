"""Continuous-rotation servos that turn the wheels: rpm = top * tanh((pulse - centre) / scale).

Sources: "data" is a manufacturer's or published measurement, "chosen" is ours and to be measured.
"""

from __future__ import annotations

import math
from typing import Any

from boebot.description.robots import Body
from boebot.devices.servo import ContinuousServo
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined
from sim_bridge.robots.imperfections import Draw

RPM = 2.0 * math.pi / 60.0  # rad/s


@joined(ContinuousServo)
def part(device: ContinuousServo, at: At) -> Part:
    """Its pulses."""
    return Part("servo_kind", at.side, [device.pin], servo_parameters(device, at.body, at.side, at.draw))


def servo_parameters(servo: ContinuousServo, body: Body, side: int, draw: Draw) -> Any:
    """The servo of `side` (0 left, 1 right) in C."""
    unit = 1.0 + draw["servo_top_spread"] * draw(1 + side, 0)
    lean = 0.5 * draw["servo_asymmetry"] * draw(1 + side, 1)
    offset = draw["servo_centre_spread_us"] * draw(1 + side, 2)
    return ffi.new(
        "servo_motor_parameters *",
        {
            "mount": math.copysign(1.0, servo.gain_us),
            "wheel_radius": body.wheel_radius_m,
            "centre_us": servo.centre_us + offset,
            "dead_band_us": draw["servo_dead_band_us"],
            "top_ccw_rad_s": draw["servo_top_rpm"] * RPM * unit * (1.0 + lean),
            "scale_ccw_us": draw["servo_scale_us"],
            "top_cw_rad_s": draw["servo_top_rpm"] * RPM * unit * (1.0 - lean),
            "scale_cw_us": draw["servo_scale_us"],
            "lag_s": draw["servo_lag_s"],
            "motor": {
                "gain_n_s": draw["servo_gain_n_s"],
                "torque_maximum_n_m": draw["servo_torque_n_m"],
                "coast_n_s": draw["servo_coast_n_s"],
                "coast_maximum_n_m": draw["servo_coast_n_m"],
            },
        },
    )
