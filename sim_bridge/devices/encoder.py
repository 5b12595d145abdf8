"""Wheel encoders. An edge that the sensor does not see takes its neighbour with it; an extra one is a short flicker."""

from __future__ import annotations

from typing import Any

from boebot.devices.encoder import QuadratureEncoder, SingleEncoder
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined
from sim_bridge.robots.imperfections import AS_BUILT, Draw

NO_PIN = 255


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
            "missed": draw["encoder_missed"],
            "extra": draw["encoder_extra"],
            "flicker_s": draw["encoder_flicker_s"],
            "bounces": draw["encoder_bounces"],
            "bounce_s": draw["encoder_bounce_s"],
        },
    )
