"""Whiskers: wires that close a switch, which bounces."""

from __future__ import annotations

from typing import Any

from boebot.devices.whisker import TouchWhisker, WhiskerSwitch
from sim_bridge._core import ffi, lib
from sim_bridge.devices.catalogue import joined, modelled, off
from sim_bridge.devices.part import At, Part
from sim_bridge.robots.imperfections import AS_BUILT, Draw
from sim_bridge.vehicles.model import VehicleModel

WHISKER_HEIGHT_M: float = lib.WHISKER_HEIGHT_M
WHISKER_BOUNCE_S = 0.0015  # mean; 0.5 to 10 ms with a long tail (chosen)

SWITCHES = {
    "bounce": off("whiskers close and open once", "WHISKER_BOUNCE_S"),
}


@joined(WhiskerSwitch)
def part(device: WhiskerSwitch, at: At) -> Part:
    """Its switch."""
    return Part("whisker_kind", at.number, [device.pin], whisker_parameters(device, at.draw))


@modelled(TouchWhisker)
def touch(device: TouchWhisker, name: str, model: VehicleModel) -> None:
    """A segment that touches."""
    model.whisker(name, device.root_m, device.tip_m)


def whisker_parameters(whisker: WhiskerSwitch, draw: Draw = AS_BUILT) -> Any:
    """The whisker in C."""
    return ffi.new(
        "whisker_parameters *", [*whisker.root_m, *whisker.tip_m, WHISKER_HEIGHT_M, draw["WHISKER_BOUNCE_S"]]
    )
