"""What makes the part of a device at its board's pins: where the device is, and what the part is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from boebot.description.robots import Body
from sim_bridge.robots.imperfections import Draw


class At(NamedTuple):
    """Where a device is on its robot."""

    side: int
    """0 left, 1 right, by its name"""
    number: int
    """of the robot's devices of this kind that come before it"""
    body: Body
    draw: Draw


class Part(NamedTuple):
    """What stands for a device at its board's pins (sim_add_part in loop.h)."""

    kind: str
    """name of its part_kind"""
    number: int
    """among those of its kind; of what has a side that"""
    pins: Sequence[int | str]
    parameters: Any
    """in C, as the kind says"""
