"""Worlds in C (vehicles/vehicle.h) as `Vehicle` and `Batch` have them: made and placed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from boebot import arguments
from boebot.arenas import Arena
from boebot.errors import ArenaError, RobotError
from sim_bridge.compiled import ffi, lib

if TYPE_CHECKING:
    from sim_bridge.vehicles.model import VehicleModel

STATE_BYTES: Final = 64  # of a compiled brain's memory, unless wished otherwise
STATE_BYTES_MAXIMUM: Final = 2**24
STEPS_MAXIMUM: Final = 2**52  # that a world counts


def check_arena(who: str, arena: Any) -> None:
    """Raises RobotError where it is of another type."""
    if not isinstance(arena, Arena):
        raise RobotError(f"{who}: the arena is {arguments.shown(arena)}; expected an Arena, such as load_arena gives")


def make_worlds(who: str, model: VehicleModel, count: int, state_bytes: int) -> Any:
    """`count` worlds of the model, not yet placed.

    Raises:
        RobotError: it is no model, or no room for that much of a brain's memory.
        MemoryError: there is too little.
    """
    if not isinstance(getattr(model, "handle", None), ffi.CData):
        raise RobotError(f"{who}: the model is {arguments.shown(model)}; expected a VehicleModel")
    size = arguments.whole(f"{who}: state_bytes", state_bytes, RobotError, least=0, most=STATE_BYTES_MAXIMUM)
    handle = lib.vehicles_new(model.handle, count, size)
    if handle == ffi.NULL:
        raise MemoryError(f"{who}: no memory for {count:,} worlds")
    model.in_use = True
    return ffi.gc(handle, lambda handle, model=model: lib.vehicles_destroy(handle))  # the model outlives them


def kept(pointer: Any, handle: Any) -> Any:
    """A pointer into the worlds that keeps them."""
    return ffi.gc(pointer, lambda _, handle=handle: None)


def place(
    who: str, handle: Any, index: int, model: VehicleModel, arena: Arena, seed: Any, robot: Any, pose: Any
) -> None:
    """Puts the vehicle of world `index` at a pose (x, y, heading).

    Raises:
        ArenaError: that is no free space.
        RobotError: what is given is no pose, seed or number of a robot, or the model has no drive or too long a step.
    """
    limit = float(lib.ARENA_FARTHEST_M)
    x, y, heading = arguments.point(
        f"{who}: the pose", pose, RobotError, "x, y (m), heading (rad)", (limit, limit, float(lib.BODY_HEADING_LIMIT))
    )
    number = arguments.whole(f"{who}: robot", robot, RobotError, least=1, most=2**31 - 1)
    key = arguments.whole(f"{who}: the seed", seed, RobotError, least=-(2**63), most=2**64 - 1) % 2**64
    model.check_drive(who)
    status = lib.vehicles_place(handle, index, arena.handle, key, number, x, y, heading)
    if status == lib.VEHICLE_NOT_FREE:
        raise ArenaError(
            f"{who}: in arena {arena.name} the robot cannot start at x = {x:g} m, y = {y:g} m: no free space"
        )
    if status == lib.VEHICLE_NO_MEMORY:
        raise MemoryError(f"{who}: no memory for the world's moving shapes or laser")
    if not status and model.unit is not None:
        lib.vehicles_set_servos(handle, index, *model.unit(key))
    if status:
        raise RobotError(f"{who}: cannot start at {pose}; expected a pose near the arena")
