"""Which imperfections of a simulated robot can be switched off, by name, and what each switch sets.

What `boebot run --without`, `BoardRequest.without` and docs/reference/imperfections.md name; most are in the devices'
files (sim_bridge/devices). A parameter in capitals is one of these files or of imperfections.py, `supply.key` is in
the robot's file, `Type.key` is a key of a device of a robot without a board. Its value here is the neutral one: with it
the model is the ideal closed form.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

import msgspec

from boebot.description import robots
from boebot.devices.device import VehicleDevice
from boebot.errors import BoardError, did_you_mean
from sim_bridge.devices import catalogue
from sim_bridge.devices.catalogue import Switch, off

_BODY = {
    "slip": off("wheels roll, whatever the floor", "TYRE_SLIP", TYRE_GRIP=10.0),
    "sampling": off("sensors of a robot without a board read at every step", "Sensor.period_s"),
}


@cache
def switches() -> Mapping[str, Switch]:
    """All switches by name: of the devices, of tyres, and of when sensors of a robot without a board are read."""
    return dict(catalogue.switches()) | _BODY


def neutral(without: Iterable[str]) -> dict[str, float]:
    """Parameters that these switches set, with their neutral values.

    Raises:
        BoardError: there is no such switch.
    """
    values: dict[str, float] = {}
    for name in without:
        if name not in switches():
            raise BoardError(
                f"there is no imperfection {name!r} to switch off; expected some of {', '.join(switches())}"
                + did_you_mean(name, switches())
            )
        values |= switches()[name].neutral
    return values


def idealised(description: robots.RobotDescription, without: Iterable[str]) -> robots.RobotDescription:
    """The robot with neutral values in what its own file says: supply, and devices without a board.

    Raises:
        BoardError: there is no such switch.
    """
    values = neutral(without)
    supply = description.supply
    if supply is not None:
        supply = msgspec.structs.replace(supply, **_keys(values, "supply"))
    devices = {name: _device(device, values) for name, device in description.device.items()}
    return msgspec.structs.replace(description, supply=supply, device=devices)


def _keys(values: Mapping[str, float], owner: str) -> dict[str, float]:
    """Those of one owner, without its name."""
    return {name.removeprefix(f"{owner}."): value for name, value in values.items() if name.startswith(f"{owner}.")}


def _device(device: Any, values: Mapping[str, float]) -> Any:
    if not isinstance(device, VehicleDevice):
        return device
    changes: dict[str, float] = {}
    for kind in type(device).__mro__:
        changes |= _keys(values, kind.__name__)
    return msgspec.structs.replace(device, **changes)
