"""Line sensors: Parallax QTI at a pin, 10 nF. Over white paper the decay takes 0.2 ms, over black tape some 3 ms."""

from __future__ import annotations

from typing import Any

from boebot.devices.line import LineModule, LineSensor, ReflectanceSensor
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Model, Part, SensorKind, joined, modelled
from sim_bridge.robots.imperfections import AS_BUILT, Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE

REFLECTANCE = SensorKind(
    "reflectance", dict.fromkeys(("radius", "dark", "sigma", "gain"), NOT_NEGATIVE), usual={"gain": 1.0}
)


@joined(LineSensor)
def part(device: LineSensor, at: At) -> Part:
    """The capacitor."""
    return Part("line_kind", at.number, [device.pin], line_parameters(device, at.number, at.draw))


@joined(LineModule)
def module(device: LineModule, at: At) -> Part:
    """The voltage at its phototransistor, or its comparator."""
    draw = at.draw
    parameters = ffi.new(
        "line_module_parameters *",
        {
            "floor": floor_parameters(device, 160 + at.number, draw),
            "slope": draw["line_module_slope"],
            "threshold": draw["line_module_threshold"],
            "hysteresis": draw["line_module_hysteresis"],
            "dark_level": device.dark == "high",
            "is_digital": device.output == "digital",
        },
    )
    return Part("line_module_kind", at.number, [device.pin], parameters)


@modelled(ReflectanceSensor)
def reflectance(device: ReflectanceSensor, name: str, model: Model) -> None:
    """The floor's reflectance."""
    x, y = device.position_m
    model.sensor(
        "reflectance",
        name,
        period=device.period_s,
        x=x,
        y=y,
        radius=device.spot_m,
        dark=AS_BUILT["line_dark"],
        sigma=device.sigma,
    )


def line_parameters(line: LineSensor, number: int, draw: Draw) -> Any:
    """The `number`-th QTI of the robot in C."""
    return ffi.new(
        "line_part_parameters *",
        {
            "floor": floor_parameters(line, 96 + number, draw),
            "capacitor": {"charge_s": draw["line_charge_s"], "threshold_v": draw["line_threshold_v"]},
            "decay_s": draw["line_decay_s"],
        },
    )


def floor_parameters(line: LineSensor | LineModule, unit: int, draw: Draw) -> dict[str, float]:
    """What it sees of the floor; `unit`: device number of its draws."""
    x, y = line.position_m
    return {
        "x": x,
        "y": y,
        "radius": draw["line_spot_m"],
        "dark": draw["line_dark"],
        "sigma": draw["line_spread"] if draw.noise else 0.0,
        "gain": max(0.1, 1.0 + draw["line_gain_spread"] * draw(unit, 0)),
    }
