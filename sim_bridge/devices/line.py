"""Line sensors: Parallax QTI at a pin, 10 nF. Over white paper the decay takes 0.2 ms, over black tape some 3 ms."""

from __future__ import annotations

from typing import Any

from boebot.devices.line import LineSensor, ReflectanceSensor
from sim_bridge._core import ffi
from sim_bridge.devices.catalogue import joined, modelled, off
from sim_bridge.devices.part import At, Part
from sim_bridge.devices.sensor import SensorKind
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE
from sim_bridge.vehicles.model import VehicleModel

LINE_DECAY_S = 0.0002  # over a floor that throws all light back (chosen)
LINE_DARK = 0.01  # leakage and stray light (chosen)
LINE_SPOT_M = 0.004  # radius, a few millimetres below the sensor (chosen)
LINE_CHARGE_S = 2.2e-6  # 220 ohm and 10 nF
LINE_THRESHOLD_V = 2.1  # falling, typical for the chip at 5 V (data)
LINE_SPREAD = 0.02  # from reading to reading (chosen)
LINE_GAIN_SPREAD = 0.15  # unit to unit (chosen)

SWITCHES = {
    "line_noise": off("line sensors are exact and alike", "LINE_SPREAD", "LINE_GAIN_SPREAD", "ReflectanceSensor.sigma")
}

REFLECTANCE = SensorKind(
    "reflectance", dict.fromkeys(("radius", "dark", "sigma", "gain"), NOT_NEGATIVE), usual={"gain": 1.0}
)


@joined(LineSensor)
def part(device: LineSensor, at: At) -> Part:
    """The capacitor."""
    return Part("line_kind", at.number, [device.pin], line_parameters(device, at.number, at.draw))


@modelled(ReflectanceSensor)
def reflectance(device: ReflectanceSensor, name: str, model: VehicleModel) -> None:
    """The floor's reflectance."""
    x, y = device.position_m
    model.sensor(
        "reflectance", name, period=device.period_s, x=x, y=y, radius=device.spot_m, dark=LINE_DARK, sigma=device.sigma
    )


def line_parameters(line: LineSensor, number: int, draw: Draw) -> Any:
    """The `number`-th QTI of the robot in C."""
    x, y = line.position_m
    return ffi.new(
        "line_part_parameters *",
        {
            "floor": {
                "x": x,
                "y": y,
                "radius": LINE_SPOT_M,
                "dark": LINE_DARK,
                "sigma": draw["LINE_SPREAD"] if draw.noise else 0.0,
                "gain": max(0.1, 1.0 + draw["LINE_GAIN_SPREAD"] * draw(96 + number, 0)),
            },
            "capacitor": {"charge_s": LINE_CHARGE_S, "threshold_v": LINE_THRESHOLD_V},
            "decay_s": LINE_DECAY_S,
        },
    )
