"""The Sharp analog infra-red distance sensor: its voltage, and how late it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boebot.devices.analog_infrared import SharpSensor
from sim_bridge._core import ffi
from sim_bridge.devices.beam import beam_of
from sim_bridge.devices.catalogue import joined, off
from sim_bridge.devices.part import At, Part
from sim_bridge.devices.sensor import SensorKind
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE

SHARP_HEIGHT_M = 0.08
SHARP_REACH_M = 1.5  # 0.8 specified, beyond it less and less (chosen)
SHARP_SPREAD = 0.01  # of the voltage (chosen)
SHARP_GAIN_SPREAD = 0.03  # unit to unit (chosen)
SHARP_PERIOD_S = 0.0383  # (data)
SHARP_PERIOD_SPREAD_S = 0.0032  # 9.6 ms are three of them (data)
SHARP_LATE_S = 0.0076  # (data)

SWITCHES = {
    "sharp_noise": off("the Sharp's voltage is that of its curve", "SHARP_SPREAD", "SHARP_GAIN_SPREAD"),
    "sharp_delay": off("the Sharp's value is not late", "SHARP_LATE_S"),
}


def _lateness(values: Mapping[str, Any]) -> str:
    late, period = values["late"], values["period"]
    return "" if period == 0.0 or late <= period else f"late is {late:g}; expected at most the period, {period:g}"


SHARP_INFRARED = SensorKind(
    "sharp_infrared",
    {"reach": POSITIVE} | dict.fromkeys(("sigma", "gain", "period", "late"), NOT_NEGATIVE),
    _lateness,
    usual={"gain": 1.0},
    reach="reach",
    has_period=False,
)


@joined(SharpSensor)
def part(device: SharpSensor, at: At) -> Part:
    """Its voltage."""
    return Part("analog_infrared_kind", at.number, [device.pin], analog_infrared_parameters(device, at.draw))


def analog_infrared_parameters(sharp: SharpSensor, draw: Draw) -> Any:
    """The Sharp sensor in C."""
    return ffi.new(
        "sharp_infrared_parameters *",
        {
            "beam": beam_of(sharp.position_m, sharp.heading_rad, 0.0, SHARP_HEIGHT_M, 1),
            "reach": SHARP_REACH_M,
            "sigma": draw["SHARP_SPREAD"] if draw.noise else 0.0,
            "gain": 1.0 + draw["SHARP_GAIN_SPREAD"] * draw(66, 0),
            "period": SHARP_PERIOD_S + SHARP_PERIOD_SPREAD_S * draw(66, 1),
            "late": draw["SHARP_LATE_S"],
        },
    )
