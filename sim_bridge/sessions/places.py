"""Where the robots of one run start: at the places that are asked for, else at free ones near the arena's start."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from boebot.arenas import Arena
from boebot.boards import BoardRequest
from boebot.errors import ArenaError
from sim_bridge.sim import Pose

GAPS_M = (0.3, 0.1, 0.02)  # between robots, and to what is around, that places are looked for with, in this order
WALL_GAP_M = 0.1  # at most
CELL_M = 0.1
FAR_M = 15.0  # from the start that places are looked for, in a field without outline


@dataclass(frozen=True)
class _Disc:
    """The room that a robot takes up."""

    number: int  # as people count
    x: float
    y: float
    radius: float

    def gap(self, x: float, y: float, radius: float) -> float:
        """To another disc (m)."""
        return math.hypot(x - self.x, y - self.y) - radius - self.radius


def places_of(arena: Arena, requests: Sequence[BoardRequest]) -> list[Pose]:
    """Where each robot starts: where its request says; else at the arena's start, if it is free, or at a place near it.

    Raises:
        ArenaError: a place is not free, two robots overlap, or there is no place.
    """
    occupied: list[_Disc] = []
    for number, request in enumerate(requests, 1):
        if request.pose is not None:
            occupied.append(_given(arena, occupied, number, request.pose, request.robot.body.reach_m))
    _, _, heading = arena.start
    places: list[Pose] = []
    for number, request in enumerate(requests, 1):
        if request.pose is not None:
            places.append(request.pose)
            continue
        disc = _found(arena, occupied, number, request.robot.body.reach_m)
        occupied.append(disc)
        places.append((disc.x, disc.y, heading))
    return places


def _given(arena: Arena, occupied: Iterable[_Disc], number: int, pose: Pose, radius: float) -> _Disc:
    x, y, _ = pose
    if not all(map(math.isfinite, pose)):
        raise ArenaError(f"robot {number} cannot start at {x:g}, {y:g}; expected numbers in m, m, rad")
    where = f"x = {x:g} m, y = {y:g} m"
    if not arena.is_free(x, y, radius):
        raise ArenaError(f"arena {arena.name}: robot {number} cannot start at {where}: no free space")
    for other in occupied:
        if (gap := other.gap(x, y, radius)) < 0:
            raise ArenaError(
                f"robots {other.number} and {number} overlap at {where} by {-gap:.3f} m; "
                f"expected at least {radius + other.radius:.3f} m from centre to centre"
            )
    return _Disc(number, x, y, radius)


def _found(arena: Arena, occupied: Sequence[_Disc], number: int, radius: float) -> _Disc:
    """A free place: the arena's start, or one on a lattice about it, near ones first and roomy ones before."""
    x, y, _ = arena.start
    if arena.is_free(x, y, radius) and all(other.gap(x, y, radius) >= 0 for other in occupied):
        return _Disc(number, x, y, radius)
    reach = _reach(arena)
    for gap in GAPS_M:
        room = radius + min(gap, WALL_GAP_M)
        for dx, dy in _around(reach):
            place = x + dx, y + dy
            if all(other.gap(*place, radius) >= gap for other in occupied) and arena.is_free(*place, room):
                return _Disc(number, *place, radius)
    raise ArenaError(f"arena {arena.name} has no free place for robot {number}; expected fewer robots, or poses")


def _reach(arena: Arena) -> float:
    """How far from its start the arena goes (m)."""
    if not arena.description.outline:
        return FAR_M
    x, y, _ = arena.start
    return max(float(abs(value)) for outline in arena.outlines for corner in outline - (x, y) for value in corner)


def _around(reach: float) -> Iterator[tuple[float, float]]:
    """Steps to the points of a lattice, in square rings about the middle, near ones first in each."""
    for ring in range(1, math.ceil(reach / CELL_M) + 1):
        edge = range(-ring, ring + 1)
        sides = itertools.product((-ring, ring), edge)
        cells = {cell for i, j in sides for cell in ((i, j), (j, i))}
        for i, j in sorted(cells, key=lambda cell: (cell[0] ** 2 + cell[1] ** 2, cell)):
            yield i * CELL_M, j * CELL_M
