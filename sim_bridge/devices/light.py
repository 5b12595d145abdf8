"""Light sensors: phototransistor and 10 nF at a pin, 1 to 2 ms in a room (data); the irradiance without a board."""

from __future__ import annotations

from typing import Any

from boebot.devices.light import LightSensor, Phototransistor
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Model, Part, SensorKind, joined, modelled, place_of
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import HEADING, NOT_NEGATIVE, POSITIVE

PHOTOTRANSISTOR = SensorKind(
    "phototransistor",
    {"heading": HEADING, "near_distance": POSITIVE} | dict.fromkeys(("ambient", "sigma", "gain"), NOT_NEGATIVE),
    usual={"gain": 1.0},
)


@joined(LightSensor)
def part(device: LightSensor, at: At) -> Part:
    """The capacitor."""
    return Part("light_kind", at.number, [device.pin], light_parameters(device, at.side, at.draw))


@modelled(Phototransistor)
def phototransistor(device: Phototransistor, name: str, model: Model) -> None:
    """The irradiance."""
    model.sensor(
        "phototransistor",
        name,
        period=device.period_s,
        **place_of(device, device.height_m),
        near_distance=device.near_distance_m,
        ambient=device.ambient,
        sigma=device.sigma,
    )


def light_parameters(light: LightSensor, side: int, draw: Draw) -> Any:
    """The phototransistor of `side` (0 left, 1 right) in C."""
    return ffi.new(
        "light_sensor_parameters *",
        {
            "light": place_of(light, draw["light_height_m"])
            | {
                "near_distance": draw["light_near_m"],
                "ambient": draw["light_ambient"],
                "sigma": draw["light_spread"] if draw.noise else 0.0,
                "gain": max(0.1, 1.0 + draw["light_gain_spread"] * draw(71 + side, 0)),
            },
            "decay_s": draw["light_decay_s"],
            "maximum_s": draw["light_maximum_s"],
            "capacitor": {"charge_s": draw["light_charge_s"], "threshold_v": draw["light_threshold_v"]},
        },
    )
