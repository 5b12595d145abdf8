"""Light sensors: phototransistor and 10 nF at a pin, 1 to 2 ms in a room (data); the irradiance without a board."""

from __future__ import annotations

from typing import Any

from boebot.devices.light import LightSensor, Phototransistor
from sim_bridge._core import ffi
from sim_bridge.devices.catalogue import joined, modelled, off
from sim_bridge.devices.part import At, Part
from sim_bridge.devices.sensor import SensorKind
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import HEADING, NOT_NEGATIVE, POSITIVE
from sim_bridge.vehicles.model import VehicleModel

LIGHT_HEIGHT_M = 0.09
LIGHT_NEAR_M = 0.05  # d0 of the notes
LIGHT_AMBIENT = 1.0
LIGHT_DECAY_S = 0.0015
LIGHT_MAXIMUM_S = 0.2  # leakage (chosen)
LIGHT_CHARGE_S = 2.2e-6  # 220 ohm and 10 nF
LIGHT_THRESHOLD_V = 2.1  # falling, typical for the chip at 5 V (data)
LIGHT_SPREAD = 0.01  # from reading to reading (chosen)
LIGHT_GAIN_SPREAD = 0.1  # unit to unit (chosen)

SWITCHES = {
    "light_noise": off(
        "light sensors are exact and alike", "LIGHT_SPREAD", "LIGHT_GAIN_SPREAD", "Phototransistor.sigma"
    ),
    "ambient_light": off("lamps are the only light", "LIGHT_AMBIENT", "Phototransistor.ambient"),
}

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
def phototransistor(device: Phototransistor, name: str, model: VehicleModel) -> None:
    """The irradiance."""
    x, y = device.position_m
    model.sensor(
        "phototransistor",
        name,
        period=device.period_s,
        x=x,
        y=y,
        heading=device.heading_rad,
        height=device.height_m,
        near_distance=device.near_distance_m,
        ambient=device.ambient,
        sigma=device.sigma,
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
            "capacitor": {"charge_s": LIGHT_CHARGE_S, "threshold_v": LIGHT_THRESHOLD_V},
        },
    )
