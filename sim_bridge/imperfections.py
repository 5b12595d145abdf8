"""What a built robot is like: nominal values of its parts, their spreads, and one robot drawn from them by seed.

Sources are named beside the values: "data" is a manufacturer's or published measurement, "chosen" is ours and to be
measured. Without noise every part is nominal.
"""

from __future__ import annotations

import math
from typing import Any

from boebot import robots
from sim_bridge._core import ffi, lib

RPM = 2.0 * math.pi / 60.0  # rad/s

# Continuous-rotation servo: rpm = top * tanh((pulse - centre) / scale), unit A of the published curves (data).
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

TYRE_GRIP = 0.7  # friction coefficient of a rubber tyre, along and across (chosen)

WHISKER_BOUNCE_S = 0.0015  # mean; 0.5 to 10 ms with a long tail (chosen)

INFRARED_RAYS = 5
INFRARED_SPREAD = 0.03  # of the range from burst to burst (chosen)
INFRARED_FALSE_HIT = 0.001  # per burst (chosen)

PING_RAYS = 7
PING_SPREAD = 0.005  # of a reading (chosen)
PING_MISS = 0.02  # (notes, p = 0.98)
PING_GRAZING_RAD = 0.785  # surfaces met flatter than this to their normal send nothing back (chosen)
TEMPERATURE_C = 20.0

# Five alkaline AA cells (data: 1.5 V, about 2,000 mA h at this load; the rest chosen).
BATTERY_FULL_V = 7.75
BATTERY_EMPTY_V = 5.0
BATTERY_CAPACITY_AS = 7200.0
BATTERY_RESISTANCE_OHM = 0.6
BATTERY_DROP_OUT_V = 0.5
BOARD_A = 0.08
SERVO_IDLE_A = 0.015  # (data)
SERVO_RUN_A_S_M = 0.74  # free-running: 140 mA at top speed (data)
SERVO_A_PER_N_M = 3.7  # 1 A at stall (chosen)
BATTERY_DIVIDER = 0.5
BATTERY_NOISE_V = 0.005

_DRAW = 1000  # the draws that make a robot have device numbers of their own


class Draw:
    """Draws one robot's peculiarities: always the same ones for the same seed, robot and device."""

    def __init__(self, seed: int, noise: bool, robot: int = 0) -> None:
        self._seed, self._noise, self._robot = seed & (2**64 - 1), noise, robot

    def __call__(self, device: int, what: int) -> float:
        """Standard normal; 0 without noise."""
        if not self._noise:
            return 0.0
        value: float = lib.noise_normal(self._seed, self._robot, _DRAW + device, what)
        return value


def body_parameters(body: robots.Body) -> Any:
    """The body in C."""
    return ffi.new(
        "body_parameters *",
        {
            "mass": body.mass_kg,
            "inertia": body.inertia_kg_m2,
            "radius": body.radius_m,
            "half_track": body.track_width_m / 2,
            "wheel_radius": body.wheel_radius_m,
            "wheel_mass": body.wheel_mass_kg,
            "wheel_inertia": body.wheel_inertia_kg_m2,
            "linear_damping": body.linear_damping_n_s_m,
            "angular_damping": body.angular_damping_n_m_s,
            "grip": TYRE_GRIP,
            "slip": 1,
        },
    )


def servo_parameters(servo: robots.ContinuousServo, body: robots.Body, side: int, draw: Draw) -> Any:
    """The servo of `side` (0 left, 1 right) in C."""
    unit = 1.0 + SERVO_TOP_SPREAD * draw(1 + side, 0)
    lean = 0.5 * SERVO_ASYMMETRY * draw(1 + side, 1)
    offset = SERVO_CENTRE_SPREAD_US * draw(1 + side, 2)
    return ffi.new(
        "servo_motor_parameters *",
        {
            "mount": math.copysign(1.0, servo.gain_us),
            "wheel_radius": body.wheel_radius_m,
            "centre_us": servo.centre_us + offset,
            "dead_band_us": SERVO_DEAD_BAND_US,
            "top_ccw_rad_s": SERVO_TOP_RPM * RPM * unit * (1.0 + lean),
            "scale_ccw_us": SERVO_SCALE_US,
            "top_cw_rad_s": SERVO_TOP_RPM * RPM * unit * (1.0 - lean),
            "scale_cw_us": SERVO_SCALE_US,
            "lag_s": SERVO_LAG_S,
            "motor": {
                "gain_n_s": SERVO_GAIN_N_S,
                "torque_maximum_n_m": SERVO_TORQUE_N_M,
                "coast_n_s": SERVO_COAST_N_S,
                "coast_maximum_n_m": SERVO_COAST_N_M,
            },
        },
    )


def whisker_parameters(whisker: robots.Whisker) -> Any:
    """The whisker in C."""
    return ffi.new("whisker_parameters *", [*whisker.root_m, *whisker.tip_m, WHISKER_BOUNCE_S])


def infrared_parameters(pair: robots.InfraredPair) -> Any:
    """The IR pair in C."""
    return ffi.new(
        "infrared_parameters *",
        {
            "x": pair.position_m[0],
            "y": pair.position_m[1],
            "heading": pair.heading_rad,
            "beam": pair.beam_rad,
            "range_m": pair.range_m,
            "range_sigma": INFRARED_SPREAD,
            "false_hit": INFRARED_FALSE_HIT,
            "rays": INFRARED_RAYS,
        },
    )


def ping_parameters(ping: robots.Ping) -> Any:
    """The Ping))) in C."""
    return ffi.new(
        "ping_parameters *",
        {
            "x": ping.position_m[0],
            "y": ping.position_m[1],
            "heading": ping.heading_rad,
            "beam": ping.beam_rad,
            "range_minimum_m": ping.range_min_m,
            "range_maximum_m": ping.range_max_m,
            "temperature_c": TEMPERATURE_C,
            "sigma": PING_SPREAD,
            "miss": PING_MISS,
            "grazing_cosine": math.cos(PING_GRAZING_RAD),
            "rays": PING_RAYS,
        },
    )


def battery_parameters() -> Any:
    """The battery in C."""
    return ffi.new(
        "battery_parameters *",
        {
            "supply": {
                "full_v": BATTERY_FULL_V,
                "empty_v": BATTERY_EMPTY_V,
                "capacity_as": BATTERY_CAPACITY_AS,
                "resistance_ohm": BATTERY_RESISTANCE_OHM,
                "drop_out_v": BATTERY_DROP_OUT_V,
                "board_a": BOARD_A,
                "servo_idle_a": SERVO_IDLE_A,
                "servo_run_a_s_m": SERVO_RUN_A_S_M,
                "servo_a_per_n_m": SERVO_A_PER_N_M,
            },
            "divider": BATTERY_DIVIDER,
            "noise_v": BATTERY_NOISE_V,
        },
    )
