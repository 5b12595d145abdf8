"""Wheel encoders. An edge that the sensor does not see takes its neighbour with it; an extra one is a short flicker."""

from __future__ import annotations

from typing import Any

from boebot.devices.encoder import QuadratureEncoder, SingleEncoder
from sim_bridge._core import ffi
from sim_bridge.devices.catalogue import Switch, joined
from sim_bridge.devices.part import At, Part
from sim_bridge.robots.imperfections import AS_BUILT, Draw

NO_PIN = 255

ENCODER_MISSED = 0.0005
ENCODER_EXTRA = 0.0005
ENCODER_FLICKER_S = 0.0002
ENCODER_BOUNCES = 0  # at most, at each edge; sensors with a Schmitt trigger have none (chosen)
ENCODER_BOUNCE_S = 0.00002  # from one of their edges to the next, on average (chosen)

SWITCHES = {
    "encoder_errors": Switch(
        "encoders see each edge once; odometers are exact",
        {
            "ENCODER_MISSED": 0.0,
            "ENCODER_EXTRA": 0.0,
            "ENCODER_BOUNCES": 0.0,
            "Odometer.sigma_step_m": 0.0,
            "Odometer.factor_left": 1.0,
            "Odometer.factor_right": 1.0,
        },
    ),
}


@joined(SingleEncoder)
def single(device: SingleEncoder, at: At) -> Part:
    """One channel."""
    return Part("encoder_kind", at.side, [device.pin, NO_PIN], encoder_parameters(device.edges_per_turn, at.draw))


@joined(QuadratureEncoder)
def quadrature(device: QuadratureEncoder, at: At) -> Part:
    """Two channels."""
    parameters = encoder_parameters(device.edges_per_turn, at.draw)
    return Part("encoder_kind", at.side, [device.pin_a, device.pin_b], parameters)


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
