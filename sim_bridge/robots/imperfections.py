"""What a built robot is like: nominal values of its parts, their spreads, and one robot drawn from them by seed.

Sources are named beside the values: "data" is a manufacturer's or published measurement, "chosen" is ours and to be
measured. Without noise every part is nominal; what else can be switched off, and by which name, is in switches.py.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from boebot.description import robots
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.infrared import InfraredPair
from boebot.devices.light import LightSensor
from boebot.devices.ping import PingSensor
from boebot.devices.servo import ContinuousServo
from boebot.devices.turret import PositionServo
from boebot.devices.whisker import WhiskerSwitch
from sim_bridge._core import ffi, lib
from sim_bridge.robots import switches

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

SPIN_INERTIA_KG_M2 = 4e-4  # of a slipping wheel: the servo's rotor behind its gear of about 1:250 (chosen)
TYRE_SLIP = 1  # beyond that coefficient they slip; 0: wheels always roll
TYRE_GRIP = 0.7  # friction coefficient of a rubber tyre, along and across (chosen)

WHISKER_HEIGHT_M: float = lib.WHISKER_HEIGHT_M
WHISKER_BOUNCE_S = 0.0015  # mean; 0.5 to 10 ms with a long tail (chosen)

INFRARED_RAYS = 5
INFRARED_HEIGHT_M = 0.06
INFRARED_DIRECT_M = 2.0  # from where another robot's LED lights the receiver (chosen)
INFRARED_SPREAD = 0.03  # of the range from burst to burst (chosen)
INFRARED_FALSE_HIT = 0.001  # per burst (chosen)

PING_RAYS = 7
PING_HEIGHT_M = 0.08
PING_SPREAD = 0.005  # of a reading (chosen)
PING_MISS = 0.02  # (notes, p = 0.98)
PING_GRAZING_RAD = 0.785  # surfaces met flatter than this to their normal send nothing back (chosen)
TEMPERATURE_C = 20.0

# What board and servos draw from the pack; the pack itself is the description's.
BOARD_A = 0.08  # (chosen)
SERVO_IDLE_A = 0.015  # (data)
SERVO_RUN_A_S_M = 0.74  # free-running: 140 mA at top speed (data)
SERVO_A_PER_N_M = 3.7  # 1 A at stall (chosen)
BATTERY_NOISE_V = 0.005

# Encoder: an edge that the sensor does not see takes its neighbour with it; an extra one is a short flicker (chosen).
ENCODER_MISSED = 0.0005
ENCODER_EXTRA = 0.0005
ENCODER_FLICKER_S = 0.0002
ENCODER_BOUNCES = 0  # at most, at each edge; sensors with a Schmitt trigger have none (chosen)
ENCODER_BOUNCE_S = 0.00002  # from one of their edges to the next, on average (chosen)

SHARP_HEIGHT_M = 0.08
SHARP_REACH_M = 1.5  # 0.8 specified, beyond it less and less (chosen)
SHARP_SPREAD = 0.01  # of the voltage (chosen)
SHARP_GAIN_SPREAD = 0.03  # unit to unit (chosen)
SHARP_PERIOD_S = 0.0383  # (data)
SHARP_PERIOD_SPREAD_S = 0.0032  # 9.6 ms are three of them (data)
SHARP_LATE_S = 0.0076  # (data)

# Phototransistor and 10 nF: 1 to 2 ms in a room (data).
LIGHT_HEIGHT_M = 0.09
LIGHT_NEAR_M = 0.05  # d0 of the notes
LIGHT_AMBIENT = 1.0
LIGHT_DECAY_S = 0.0015
LIGHT_MAXIMUM_S = 0.2  # leakage (chosen)
LIGHT_CHARGE_S = 2.2e-6  # 220 ohm and 10 nF
LIGHT_THRESHOLD_V = 2.1  # falling, typical for the chip at 5 V (data)
LIGHT_SPREAD = 0.01  # from reading to reading (chosen)
LIGHT_GAIN_SPREAD = 0.1  # unit to unit (chosen)

COMPASS_HORIZONTAL_G = 0.19  # central Europe
COMPASS_DOWN_G = 0.45
COMPASS_SIGMA = 0.01  # 2 mG of noise (data)
COMPASS_BIAS_RAD = 0.05  # of the mounting (chosen)
COMPASS_IRON = 0.2  # (chosen)
COMPASS_PER_AMPERE = 0.05  # (chosen)

TURRET_CENTRE_SPREAD_US = 10.0  # (chosen)

_DRAW = 1000  # the draws that make a robot have device numbers of their own


class Draw:
    """Draws one robot's peculiarities: always the same ones for the same unit and device; of a robot that says no unit,
    for the same seed, robot and device. `draw["SERVO_LAG_S"]` is a parameter of this module as this robot has it."""

    def __init__(
        self, seed: int, noise: bool, robot: int = 0, unit: int | None = None, without: Iterable[str] = ()
    ) -> None:
        """`unit`: the robot's serial number, whose peculiarities no seed changes; 0: nominal throughout. `without`:
        names of switches.py.

        Raises:
            BoardError: there is no such name.
        """
        self._neutral = switches.neutral(without)
        self._seed, self.noise, self._robot, self._unit = seed & (2**64 - 1), noise, robot, unit

    def __call__(self, device: int, what: int) -> float:
        """Standard normal; 0 without noise."""
        if not self.noise:
            return 0.0
        if self._unit is not None:
            kept: float = lib.unit_normal(self._unit, _DRAW + device, what)
            return kept
        value: float = lib.noise_normal(self._seed, self._robot, _DRAW + device, what)
        return value

    def own(self, name: str, given: float | None) -> float:
        """The same, `given` by a robot itself unless that is None."""
        return self[name] if given is None or name in self._neutral else given

    def __getitem__(self, name: str) -> float:
        """A parameter of this module, or its neutral value if what it belongs to is switched off."""
        value: float = self._neutral.get(name, globals()[name])
        return value


AS_BUILT = Draw(0, noise=False)
"""Nothing is drawn, and nothing switched off."""


def body_parameters(body: robots.Body, draw: Draw = AS_BUILT, outline: Any = ffi.NULL) -> Any:
    """The body in C. `outline`: its collision outline in C, which must outlive what is made of it; NULL: a circle."""
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
            "outline": outline,
            "grip": draw.own("TYRE_GRIP", body.tyre_grip),
            "spin_inertia": SPIN_INERTIA_KG_M2,
            "slip": int(draw.own("TYRE_SLIP", body.tyre_slip)),
        },
    )


def servo_parameters(servo: ContinuousServo, body: robots.Body, side: int, draw: Draw) -> Any:
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


def whisker_parameters(whisker: WhiskerSwitch, draw: Draw = AS_BUILT) -> Any:
    """The whisker in C."""
    return ffi.new(
        "whisker_parameters *", [*whisker.root_m, *whisker.tip_m, WHISKER_HEIGHT_M, draw["WHISKER_BOUNCE_S"]]
    )


def infrared_parameters(pair: InfraredPair, draw: Draw = AS_BUILT) -> Any:
    """The IR pair in C."""
    return ffi.new(
        "infrared_pair_parameters *",
        {
            "beam": _beam(pair.position_m, pair.heading_rad, pair.beam_rad, INFRARED_HEIGHT_M, INFRARED_RAYS),
            "range": pair.range_m,
            "range_sigma": draw["INFRARED_SPREAD"],
            "false_hit": draw["INFRARED_FALSE_HIT"],
            "direct": draw["INFRARED_DIRECT_M"],
        },
    )


def ping_parameters(ping: PingSensor, draw: Draw = AS_BUILT) -> Any:
    """The Ping))) in C."""
    return ffi.new(
        "sonar_parameters *",
        {
            "beam": _beam(ping.position_m, ping.heading_rad, ping.beam_rad, PING_HEIGHT_M, PING_RAYS),
            "range_minimum": ping.range_min_m,
            "range_maximum": ping.range_max_m,
            "sigma": draw["PING_SPREAD"],
            "miss": draw["PING_MISS"],
            "grazing_cosine": math.cos(draw["PING_GRAZING_RAD"]),
            "temperature": TEMPERATURE_C,
            "absorption": 1,
        },
    )


def _beam(position: tuple[float, float], heading: float, opening: float, height: float, rays: int) -> dict[str, float]:
    """Where a sensor is on the body and what it sees (beam_parameters in C)."""
    x, y = position
    return {"x": x, "y": y, "heading": heading, "opening": opening, "height": height, "rays": rays}


def battery_parameters(supply: robots.Supply, ratio: float = 2.0, draw: Draw = AS_BUILT) -> Any:
    """The battery in C; `ratio`: the pack's voltage for each volt at the analog pin."""
    return ffi.new(
        "battery_parameters *",
        {
            "supply": {
                "full_v": supply.full_v,
                "empty_v": supply.empty_v,
                "capacity_as": supply.capacity_as,
                "resistance_ohm": supply.resistance_ohm,
                "drop_out_v": supply.drop_out_v,
                "board_a": draw["BOARD_A"],
                "servo_idle_a": draw["SERVO_IDLE_A"],
                "servo_run_a_s_m": draw["SERVO_RUN_A_S_M"],
                "servo_a_per_n_m": draw["SERVO_A_PER_N_M"],
                "charger_a": supply.charger_a,
                "unregulated": float(supply.servos == "pack"),
            },
            "divider": 1.0 / ratio,
            "noise_v": draw["BATTERY_NOISE_V"],
            "charge": supply.charge,
        },
    )


def encoder_parameters(edges_per_turn: int, draw: Draw = AS_BUILT) -> Any:
    """A wheel encoder in C."""
    return ffi.new(
        "encoder_parameters *",
        {
            "edges_per_turn": edges_per_turn,
            "missed": draw["ENCODER_MISSED"],
            "extra": draw["ENCODER_EXTRA"],
            "flicker_s": ENCODER_FLICKER_S,
            "bounces": draw["ENCODER_BOUNCES"],
            "bounce_s": ENCODER_BOUNCE_S,
        },
    )


def analog_infrared_parameters(sharp: SharpSensor, draw: Draw) -> Any:
    """The Sharp sensor in C."""
    return ffi.new(
        "sharp_infrared_parameters *",
        {
            "beam": _beam(sharp.position_m, sharp.heading_rad, 0.0, SHARP_HEIGHT_M, 1),
            "reach": SHARP_REACH_M,
            "sigma": draw["SHARP_SPREAD"] if draw.noise else 0.0,
            "gain": 1.0 + draw["SHARP_GAIN_SPREAD"] * draw(66, 0),
            "period": SHARP_PERIOD_S + SHARP_PERIOD_SPREAD_S * draw(66, 1),
            "late": draw["SHARP_LATE_S"],
        },
    )


def light_parameters(light: LightSensor, side: int, draw: Draw) -> Any:
    """The phototransistor of `side` (0 left, 1 right) in C."""
    x, y = light.position_m
    return ffi.new(
        "light_sensor_parameters *",
        {
            "light": {
                "x": x,
                "y": y,
                "heading": light.heading_rad,
                "height": LIGHT_HEIGHT_M,
                "near_distance": LIGHT_NEAR_M,
                "ambient": draw["LIGHT_AMBIENT"],
                "sigma": draw["LIGHT_SPREAD"] if draw.noise else 0.0,
                "gain": max(0.1, 1.0 + draw["LIGHT_GAIN_SPREAD"] * draw(71 + side, 0)),
            },
            "decay_s": LIGHT_DECAY_S,
            "maximum_s": LIGHT_MAXIMUM_S,
            "charge_s": LIGHT_CHARGE_S,
            "threshold_v": LIGHT_THRESHOLD_V,
        },
    )


def compass_parameters(draw: Draw) -> Any:
    """The HMC5883L in C; without noise it is not disturbed by iron and currents either."""
    on = float(draw.noise)
    return ffi.new(
        "hmc5883l_parameters *",
        {
            "field": {
                "sigma": draw["COMPASS_SIGMA"] * on,
                "bias": draw["COMPASS_BIAS_RAD"] * draw(61, 0),
                "iron_x": draw["COMPASS_IRON"] * draw(61, 1),
                "iron_y": draw["COMPASS_IRON"] * draw(61, 2),
                "current_x": draw["COMPASS_PER_AMPERE"] * draw(61, 3),
                "current_y": draw["COMPASS_PER_AMPERE"] * draw(61, 4),
            },
            "horizontal_gauss": COMPASS_HORIZONTAL_G,
            "down_gauss": COMPASS_DOWN_G,
        },
    )


def turret_parameters(turret: PositionServo, draw: Draw) -> Any:
    """The turret's servo in C: the notes' standard servo, with this unit's offset."""
    out = ffi.new("motor_position_parameters *")
    lib.motor_position_default(out)
    gain = turret.gain_us_per_rad
    out.mount = math.copysign(1.0, gain)
    out.us_per_rad = abs(gain)
    out.centre_us = turret.centre_us + draw["TURRET_CENTRE_SPREAD_US"] * draw(76, 0)
    return out
