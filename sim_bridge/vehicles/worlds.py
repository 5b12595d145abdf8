"""Worlds in C (vehicles/vehicle.h) as `Vehicle` and `Batch` have them: made, placed, saved and restored."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from boebot import arguments
from boebot.arenas import Arena
from boebot.errors import ArenaError, RobotError
from sim_bridge import saved
from sim_bridge._core import ffi, lib
from sim_bridge.saved import SavedStateError

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
    status = lib.vehicles_place(handle, index, arena.handle, key, number, x, y, heading)
    if status == lib.VEHICLE_NOT_FREE:
        raise ArenaError(
            f"{who}: in arena {arena.name} the robot cannot start at x = {x:g} m, y = {y:g} m: no free space"
        )
    if status == lib.VEHICLE_NOT_PLACED:
        raise RobotError(f"{who}: the model has no drive; expected dc_motors, regulated_motors or servos")
    if status == lib.VEHICLE_BAD_STEP:
        raise RobotError(
            f"{who}: the model's dt = {model.dt:g} s; expected less than {model.euler_limit:.4g} s, the Euler limit"
        )
    if status == lib.VEHICLE_NO_MEMORY:
        raise MemoryError(f"{who}: no memory for the world's moving shapes or laser")
    if status:
        raise RobotError(f"{who}: cannot start at {pose}; expected a pose near the arena")


def save(handle: Any, index: int, model: VehicleModel, arena: Arena, state_bytes: int) -> bytes:
    """The state of one world."""
    room = ffi.new("unsigned char[]", lib.vehicles_snapshot_size(handle, index))
    lib.vehicles_save(handle, index, room)
    return saved.encode(_heading(model, arena, state_bytes), bytes(ffi.buffer(room)))


def restore(who: str, handle: Any, index: int, model: VehicleModel, arena: Arena, state_bytes: int, state: Any) -> None:
    """World `index` goes on from a saved state; what is refused changes nothing.

    Raises:
        SavedStateError: it is of another model, format, arena, size of the brain's memory, or damaged.
    """
    heading, numbers = saved.decode(state)
    here = _heading(model, arena, state_bytes)
    if heading.model != here.model:
        raise SavedStateError(
            f"{who}: the state was saved by another model; expected one whose body, drive and sensors are the same"
        )
    if heading.arena_fingerprint != here.arena_fingerprint:
        raise SavedStateError(
            f"{who}: the state was saved in another arena; expected one saved in this arena, {arena.name}"
        )
    if heading.state_bytes != here.state_bytes:
        raise SavedStateError(f"{who}: the state has another size of a brain's memory; expected the same state_bytes")
    if lib.vehicles_restore(handle, index, numbers, len(numbers)) != lib.VEHICLE_OK:
        raise SavedStateError(f"{who}: the saved state has a number that no world comes to; expected what save() gave")


def _heading(model: VehicleModel, arena: Arena, state_bytes: int) -> saved.World:
    return saved.World(saved.FORMAT, model.fingerprint, arena.name, arena.fingerprint, state_bytes)
