"""All simulated devices, found in the files of this folder: nothing is listed by hand.

A file has constants in capitals (parameters with their sources, `SWITCHES`, `SensorKind`s), and functions marked by
`joined` and `modelled` with the kinds of the robot's description that they are for.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any, TypeVar

from sim_bridge.devices.sensor import SensorKind

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Switch:
    """An imperfection that can be switched off."""

    what: str
    """what then is as ideal, in one line"""
    neutral: Mapping[str, float]
    """parameter -> neutral value"""


def off(what: str, *parameters: str, **others: float) -> Switch:
    """Of `parameters` the neutral value is 0."""
    return Switch(what, dict.fromkeys(parameters, 0.0) | others)


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


def parameters() -> dict[str, float | tuple[float, ...]]:
    """All constants of the devices, by name."""
    return {
        name: value
        for module in modules()
        for name, value in vars(module).items()
        if name.isupper() and not name.startswith("_") and type(value) in (float, int, tuple)
    }


@cache
def sensor_kinds() -> Mapping[str, SensorKind]:
    """All kinds of sensors of robots without boards, by their name in C."""
    found = [value for module in modules() for value in vars(module).values() if isinstance(value, SensorKind)]
    return {kind.name: kind for kind in sorted(found, key=lambda kind: kind.name)}


@cache
def switches() -> Mapping[str, Switch]:
    """All imperfections that can be switched off, by name."""
    return {name: switch for module in modules() for name, switch in getattr(module, "SWITCHES", {}).items()}
