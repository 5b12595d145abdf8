"""Wheel encoders. An edge that the sensor does not see takes its neighbour with it; an extra one is a short flicker."""

from __future__ import annotations

from typing import Any

from boebot.devices.encoder import QuadratureEncoder, SingleEncoder, WheelEncoder
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Model, Part, SensorKind, joined, modelled
from sim_bridge.robots.imperfections import AS_BUILT, Draw
from sim_bridge.vehicles.checked_structs import SHARE, SWITCH, Range

NO_PIN = 255

WHEEL_ENCODER = SensorKind(
    "wheel_encoder",
    {"edges_per_turn": Range(2.0, 4096.0), "missed": SHARE, "right": SWITCH, "directed": SWITCH},
    has_period=False,
)


@joined(SingleEncoder)
def single(device: SingleEncoder, at: At) -> Part:
    """One channel."""
    return Part("encoder_kind", at.side, [device.pin, NO_PIN], encoder_parameters(device.edges_per_turn, at.draw))


@joined(QuadratureEncoder)
def quadrature(device: QuadratureEncoder, at: At) -> Part:
    """Two channels."""
    parameters = encoder_parameters(device.edges_per_turn, at.draw)
    return Part("encoder_kind", at.side, [device.pin_a, device.pin_b], parameters)


@modelled(SingleEncoder, QuadratureEncoder)
def wheel_encoder(device: WheelEncoder, name: str, model: Model) -> None:
    """Edges counted, and the time between the last two, as the firmware reports them; of two channels all are seen."""
    model.sensor(
        "wheel_encoder",
        name,
        edges_per_turn=device.edges_per_turn,
        missed=model.draw["encoder_missed"] if device.LINES == 1 else 0.0,
        right=int(name.endswith("right")),
        directed=int(device.LINES > 1),
    )


def encoder_parameters(edges_per_turn: int, draw: Draw = AS_BUILT) -> Any:
    """A wheel encoder in C."""
    return ffi.new(
        "encoder_parameters *",
        {
            "edges_per_turn": edges_per_turn,
            "missed": draw["encoder_missed"],
            "extra": draw["encoder_extra"],
            "flicker_s": draw["encoder_flicker_s"],
            "bounces": draw["encoder_bounces"],
            "bounce_s": draw["encoder_bounce_s"],
        },
    )
