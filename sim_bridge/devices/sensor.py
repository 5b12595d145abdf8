"""A kind of sensor of a robot without a board: what its parameters in C may be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sim_bridge.vehicles.checked_structs import Range


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
