"""The Sharp analog infra-red distance sensor: its voltage, and how late it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boebot.devices.analog_infrared import SharpSensor
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, SensorKind, beam_of, joined
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE


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
            "beam": beam_of(sharp, draw["sharp_height_m"], 1, opening=0.0),
            "reach": draw["sharp_reach_m"],
            "sigma": draw["sharp_spread"] if draw.noise else 0.0,
            "gain": 1.0 + draw["sharp_gain_spread"] * draw(66, 0),
            "period": draw["sharp_period_s"] + draw["sharp_period_spread_s"] * draw(66, 1),
            "late": draw["sharp_late_s"],
        },
    )
