"""Continuous-rotation servos that turn the wheels: rpm = top * tanh((pulse - centre) / scale).

Sources: "data" is a manufacturer's or published measurement, "chosen" is ours and to be measured.
"""

from __future__ import annotations

import math
from typing import Any

from boebot.description.robots import Body
from boebot.devices.servo import ContinuousServo
from sim_bridge._core import ffi
from sim_bridge.devices.catalogue import joined, off
from sim_bridge.devices.part import At, Part
from sim_bridge.robots.imperfections import Draw

RPM = 2.0 * math.pi / 60.0  # rad/s


SERVO_TOP_RPM = 51.25
SERVO_SCALE_US = 78.5
SERVO_TOP_SPREAD = 0.025  # relative, unit to unit: 0.692 against 0.654 rpm/us (data)
SERVO_ASYMMETRY = 0.03  # relative, one direction against the other; one unit showed 0.17 (data)
SERVO_CENTRE_SPREAD_US = 4.0  # after the calibration that the handbook asks for (chosen)
SERVO_DEAD_BAND_US = 9.0  # 9 to 20 (data)
SERVO_LAG_S = 0.055  # with the regulator's own 10 ms within the 50 to 80 ms that are seen (chosen)
SERVO_GAIN_N_S = 1.2  # K of (3.15): the loop settles in 10 ms (chosen)
SERVO_TORQUE_N_M = 0.268  # stall (data)
SERVO_COAST_N_S = 0.3  # unpowered gear train (chosen)
SERVO_COAST_N_M = 0.05  # (chosen)

SWITCHES = {
    "servo_spread": off("all servos are equally fast", "SERVO_TOP_SPREAD"),
    "servo_asymmetry": off("servos turn equally fast in both directions", "SERVO_ASYMMETRY"),
    "servo_centre": off("servos stand still at their centre pulse", "SERVO_CENTRE_SPREAD_US"),
    "dead_band": off("servos answer the smallest pulse offset", "SERVO_DEAD_BAND_US"),
    "lag": off("servos have their speed at once", "SERVO_LAG_S"),
    "coast_drag": off("servos without pulses turn freely", "SERVO_COAST_N_S", "SERVO_COAST_N_M"),
}


@joined(ContinuousServo)
def part(device: ContinuousServo, at: At) -> Part:
    """Its pulses."""
    return Part("servo_kind", at.side, [device.pin], servo_parameters(device, at.body, at.side, at.draw))


def servo_parameters(servo: ContinuousServo, body: Body, side: int, draw: Draw) -> Any:
    """The servo of `side` (0 left, 1 right) in C."""
    unit = 1.0 + draw["SERVO_TOP_SPREAD"] * draw(1 + side, 0)
    lean = 0.5 * draw["SERVO_ASYMMETRY"] * draw(1 + side, 1)
    offset = draw["SERVO_CENTRE_SPREAD_US"] * draw(1 + side, 2)
    return ffi.new(
        "servo_motor_parameters *",
        {
            "mount": math.copysign(1.0, servo.gain_us),
            "wheel_radius": body.wheel_radius_m,
            "centre_us": servo.centre_us + offset,
            "dead_band_us": draw["SERVO_DEAD_BAND_US"],
            "top_ccw_rad_s": SERVO_TOP_RPM * RPM * unit * (1.0 + lean),
            "scale_ccw_us": SERVO_SCALE_US,
            "top_cw_rad_s": SERVO_TOP_RPM * RPM * unit * (1.0 - lean),
            "scale_cw_us": SERVO_SCALE_US,
            "lag_s": draw["SERVO_LAG_S"],
            "motor": {
                "gain_n_s": SERVO_GAIN_N_S,
                "torque_maximum_n_m": SERVO_TORQUE_N_M,
                "coast_n_s": draw["SERVO_COAST_N_S"],
                "coast_maximum_n_m": draw["SERVO_COAST_N_M"],
            },
        },
    )
