"""A body's collision outline from Python: a simple polygon becomes a body_outline (world/outline.h)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from boebot.description.outlines import polygon_fault
from boebot.errors import RobotError
from sim_bridge._core import ffi, lib

CORNERS_MAXIMUM: Final[int] = lib.BODY_CORNERS_MAXIMUM


def collision_outline(where: str, corners: Sequence[Sequence[float]]) -> Any:
    """The outline in C of `corners`, (x, y) in m in the body's frame, around the axle's middle; it must outlive bodies.

    Raises:
        RobotError: it is no such polygon; `where` says whose.
    """
    try:
        points = [(float(x), float(y)) for x, y in corners]
    except (TypeError, ValueError, OverflowError):
        raise RobotError(f"{where}: expected a list of corners [x, y] in m") from None
    fault = polygon_fault(points, CORNERS_MAXIMUM)
    if fault:
        raise RobotError(f"{where}{fault}")
    outline = ffi.new("body_outline *")
    if lib.body_outline_make(outline, [value for point in points for value in point], len(points)) != lib.OUTLINE_OK:
        raise RobotError(f"{where}: a place of it is narrower than 0.4 mm; expected room for a core")
    return outline
