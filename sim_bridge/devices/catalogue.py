"""All simulated devices, each in the file of this folder that is named as its kind's file in boebot/devices.

A file has `SensorKind`s in capitals, and functions marked by `joined` and `modelled` with the kinds of the robot's
description that they are for. Nothing is listed by hand.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, Protocol, TypeVar

from boebot.description.robots import Body, RobotDescription
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import POSITIVE, Range

Function = TypeVar("Function", bound=Callable[..., Any])

_JOINED: dict[type, Callable[[Any, Any], Any]] = {}
_MODELLED: dict[type, Callable[[Any, str, Any], None]] = {}


class At(NamedTuple):
    """Where a device is on its robot."""

    side: int
    """0 left, 1 right, by its name"""
    number: int
    """of the robot's devices of this kind that come before it"""
    body: Body
    draw: Draw


class Part(NamedTuple):
    """What stands for a device at its board's pins (robot_add_part in loop.h)."""

    kind: str
    """name of its part_kind"""
    number: int
    """among those of its kind; of what has a side that"""
    pins: Sequence[int | str]
    parameters: Any
    """in C, as the kind says"""


@dataclass(frozen=True)
class SensorKind:
    """Found where it stands, as a constant of a device's file.

    Attributes:
        name: of the kind in C, whose struct is NAME_parameters (sim_bridge/world/sensors).
        ranges: what the struct's keys may be; others may be any finite number.
        wrong: what is wrong with its keys together; "": nothing.
        usual: the struct's keys that need not be given.
        of_body: keys that are as those of the body, if they are not given.
        reach: the key that says how far its beam looks (m); "": it has no beam.
        nothing: what it reads by a table of readings where nothing is in reach; None: the reach.
        has_period: it can be read less often than in every step, by no period of its struct.
    """

    name: str
    ranges: Mapping[str, Range]
    wrong: Callable[[Mapping[str, Any]], str] = lambda _: ""
    usual: Mapping[str, Any] = field(default_factory=dict)
    of_body: tuple[str, ...] = ()
    reach: str = ""
    nothing: float | None = 0.0
    has_period: bool = True


TABLE = SensorKind("table", {"reach": POSITIVE}, reach="reach")
"""Sensors known by their table of readings (reading_table.py)."""


class Model(Protocol):
    """What a device is added to: `VehicleModel`."""

    robot: RobotDescription | None
    draw: Draw
    """magnitudes of its imperfections, nominal"""

    def sensor(self, kind: str, name: str, /, **parameters: Any) -> None:
        """Adds a sensor."""

    def battery(self, name: str, **parameters: Any) -> None:
        """Adds the notes' battery."""


def place_of(device: Any, height: float) -> dict[str, float]:
    """Where a device sits, how high, and which way it looks: keys of its struct in C (m, rad)."""
    x, y = device.position_m
    return {"x": x, "y": y, "heading": device.heading_rad, "height": height}


def beam_of(device: Any, height: float, rays: int, opening: float | None = None) -> dict[str, float]:
    """beam_parameters in C; `opening`: in place of the device's own (rad)."""
    return place_of(device, height) | {"opening": device.beam_rad if opening is None else opening, "rays": rays}


def joined(*kinds: type) -> Callable[[Function], Function]:
    """Marks what makes the part of such a device: `function(device, at) -> Part`."""

    def mark(function: Function) -> Function:
        _JOINED.update(dict.fromkeys(kinds, function))
        return function

    return mark


def modelled(*kinds: type) -> Callable[[Function], Function]:
    """Marks what adds such a device to a robot in a world without boards: `function(device, name, model)`."""

    def mark(function: Function) -> Function:
        _MODELLED.update(dict.fromkeys(kinds, function))
        return function

    return mark


@cache
def _module(name: str) -> ModuleType | None:
    """The file of that name, if there is one."""
    there = (Path(__file__).parent / f"{name}.py").is_file()
    return importlib.import_module(f"{__package__}.{name}") if there else None


def _function(marked: Mapping[type, Any], device: object) -> Any:
    _module(type(device).__module__.rpartition(".")[2])
    return marked.get(type(device))


def part_of(device: object, at: At) -> Part | None:
    """The device's part there, or None: it has none in the world."""
    function = _function(_JOINED, device)
    part: Part | None = None if function is None else function(device, at)
    return part


def has_part(device: object) -> bool:
    """Whether such a device has a part at a board."""
    return _function(_JOINED, device) is not None


def add_to(model: Model, name: str, device: object) -> bool:
    """Adds the device to the model of a robot in a world without boards; False: there is none for it."""
    function = _function(_MODELLED, device)
    if function is not None:
        function(device, name, model)
    return function is not None


@cache
def sensor_kinds() -> Mapping[str, SensorKind]:
    """All kinds of sensors of robots without boards, by their name in C."""
    modules = [_module(module.name) for module in pkgutil.iter_modules([str(Path(__file__).parent)])]
    found = [value for module in modules for value in vars(module).values() if isinstance(value, SensorKind)]
    return {kind.name: kind for kind in sorted(found, key=lambda kind: kind.name)}
