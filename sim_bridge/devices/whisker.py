"""Whiskers: wires that close a switch, which bounces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boebot.devices.whisker import BentWire, TouchWhisker, WhiskerSwitch
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Model, Part, SensorKind, joined, modelled
from sim_bridge.robots.imperfections import AS_BUILT, Draw


def _length(values: Mapping[str, Any]) -> str:
    ends = [values[key] for key in ("root_x", "root_y", "tip_x", "tip_y")]
    return "tip is where root is; expected a whisker that has a length" if ends[:2] == ends[2:] else ""


TOUCH = SensorKind("touch", {}, _length, has_period=False)


@joined(WhiskerSwitch)
def part(device: WhiskerSwitch, at: At) -> Part:
    """Its switch."""
    return Part("whisker_kind", at.number, [device.pin], whisker_parameters(device, at.draw))


@modelled(TouchWhisker, WhiskerSwitch)
def touch(device: BentWire, name: str, model: Model) -> None:
    """A segment that touches."""
    (root_x, root_y), (tip_x, tip_y) = device.root_m, device.tip_m
    model.sensor("touch", name, root_x=root_x, root_y=root_y, tip_x=tip_x, tip_y=tip_y)


def whisker_parameters(whisker: WhiskerSwitch, draw: Draw = AS_BUILT) -> Any:
    """The whisker in C."""
    contacts = draw["whisker_height_m"], draw["whisker_bounce_s"]
    return ffi.new("whisker_parameters *", [*whisker.root_m, *whisker.tip_m, *contacts])
