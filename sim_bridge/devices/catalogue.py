"""All simulated devices, found in the files of this folder: nothing is listed by hand.

A file has `SensorKind`s in capitals, and functions marked by `joined` and `modelled` with the kinds of the robot's
description that they are for.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from functools import cache
from types import ModuleType
from typing import Any, TypeVar

from sim_bridge.devices.sensor import SensorKind

Function = TypeVar("Function", bound=Callable[..., Any])


_JOINED: dict[type, Callable[[Any, Any], Any]] = {}
_MODELLED: dict[type, Callable[[Any, str, Any], None]] = {}


def joined(*kinds: type) -> Callable[[Function], Function]:
    """Marks what makes the part of such a device: `function(device, at) -> Part`."""

    def mark(function: Function) -> Function:
        _JOINED.update(dict.fromkeys(kinds, function))
        return function

    return mark


def modelled(*kinds: type) -> Callable[[Function], Function]:
    """Marks what adds such a device to a robot without a board: `function(device, name, model)`."""

    def mark(function: Function) -> Function:
        _MODELLED.update(dict.fromkeys(kinds, function))
        return function

    return mark


@cache
def modules() -> tuple[ModuleType, ...]:
    """The devices' files."""
    package = importlib.import_module(__package__)
    names = [module.name for module in pkgutil.iter_modules(package.__path__)]
    return tuple(importlib.import_module(f"{__package__}.{name}") for name in names)


def part_of(device: object, at: Any) -> Any:
    """The device's `Part` at that `At` (part.py), or None: it has none in the world."""
    modules()
    function = _JOINED.get(type(device))
    return None if function is None else function(device, at)


def add_to(model: Any, name: str, device: object) -> bool:
    """Adds the device to the model of a robot without a board; False: there is none for it."""
    modules()
    function = _MODELLED.get(type(device))
    if function is not None:
        function(device, name, model)
    return function is not None


@cache
def sensor_kinds() -> Mapping[str, SensorKind]:
    """All kinds of sensors of robots without boards, by their name in C."""
    found = [value for module in modules() for value in vars(module).values() if isinstance(value, SensorKind)]
    return {kind.name: kind for kind in sorted(found, key=lambda kind: kind.name)}
