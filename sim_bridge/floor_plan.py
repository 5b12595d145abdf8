"""An arena as the host's floor plan (boebot.floor_plan): what a session tells of it for pictures after a run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boebot.floor_plan import Charger, FloorPlan, Lamp, Moving, Patch, Solid
from sim_bridge import arena_description
from sim_bridge.arena import Arena, Floats
from sim_bridge.imperfections import TYRE_GRIP

SAMPLE_S = 0.05  # from one pose of a moving shape to the next
SAMPLES_MAXIMUM = 20_000  # of one moving shape; longer times have them farther apart

Surface = arena_description.Polygon | arena_description.Wall | arena_description.Disc | arena_description.Moving


@dataclass(frozen=True, kw_only=True)
class Lateness:
    """By how much the clock of a moving shape's path was behind the world's, for it had waited: even between rows."""

    time: Floats  # s, increasing
    waited: Floats  # s


def floor_plan(arena: Arena, begin: float, end: float, late: Sequence[Lateness] = ()) -> FloorPlan:
    """The arena with its moving shapes from `begin` to `end` (s); `late`: of each of them, unless none ever waited."""
    time = _times(arena, begin, end, late)
    return plan_of_poses(arena, time, _poses(arena, time, late))


def plan_of_poses(arena: Arena, time: Floats, poses: Floats) -> FloorPlan:
    """The arena with its moving shapes at these times (s).

    Args:
        poses: x, y (m), cosine and sine of the heading of each shape: shape (shapes, 4, times).
    """
    said = arena.description
    charger = said.charger
    return FloorPlan(
        name=arena.name,
        title=said.title,
        solids=list(_solids(arena)),
        patches=[Patch(corners=np.array(patch.corners_m), grip=patch.grip, name=patch.name) for patch in said.patch],
        lamps=[
            Lamp(x=light.x_m, y=light.y_m, height=light.height_m, power=light.power_w, name=light.name)
            for light in said.light
        ],
        charger=None if charger is None else Charger(x=charger.x_m, y=charger.y_m, radius=charger.radius_m),
        moving=[
            Moving(solid=solid, time=time, x=x, y=y, heading=np.unwrap(np.arctan2(sine, cosine)))
            for solid, (x, y, cosine, sine) in zip(moving_solids(arena), poses, strict=True)
        ],
        grip=TYRE_GRIP,
    )


def poses_of(movers: Any) -> Floats:
    """x, y (m), cosine and sine of the heading of each of the C core's movers: shape (movers, 4)."""
    return np.array([(m.x, m.y, m.cosine, m.sine) for m in movers], dtype=np.float64).reshape(-1, 4)


def path_end(arena: Arena) -> float:
    """When the last moving shape has gone its path once (s); 0 without one."""
    return max((moving.path[-1].time_s for moving in arena.description.moving), default=0.0)


def _solids(arena: Arena) -> Iterator[Solid]:
    """Those that stay in place."""
    said = arena.description
    now = iter(arena.outlines)
    for outline in said.outline:
        yield Solid(kind="outline", points=next(now), **_surface(outline))
    for obstacle in said.obstacle:
        yield Solid(kind="obstacle", points=next(now), **_surface(obstacle))
    for wall in said.wall:
        yield Solid(kind="wall", points=next(now)[: len(wall.points_m)], **_surface(wall))
    for disc in said.disc:
        yield Solid(kind="disc", points=np.array([(disc.x_m, disc.y_m)]), radius=disc.radius_m, **_surface(disc))


def _surface(shape: Surface) -> dict[str, Any]:
    return {
        "name": shape.name,
        "height": math.inf if shape.height_m is None else shape.height_m,
        "infrared_reflectance": shape.infrared_reflectance,
        "sound_reflectance": shape.sound_reflectance,
    }


def moving_solids(arena: Arena) -> list[Solid]:
    """The shapes that move, in their own frames."""
    return [
        Solid(kind="disc", points=np.zeros((1, 2)), radius=moving.radius_m or 0.0, **_surface(moving))
        if moving.corners_m is None
        else Solid(kind="obstacle", points=np.array(moving.corners_m), **_surface(moving))
        for moving in arena.description.moving
    ]


def _times(arena: Arena, begin: float, end: float, late: Sequence[Lateness]) -> Floats:
    """When poses are taken: evenly, and wherever a shape begins or ends to wait or passes a waypoint, between which it
    goes straight (paths.h)."""
    bends = [row.time for row in late]
    for k, moving in enumerate(arena.description.moving):
        clock = late[k] if late else Lateness(time=np.array([begin, end]), waited=np.zeros(2))
        bends.append(_waypoint_times(moving, begin, end, clock))
    kept = np.unique(np.concatenate([np.empty(0), *bends]))
    kept = kept[(kept > begin) & (kept < end)]
    kept = kept[:: math.ceil(2 * len(kept) / SAMPLES_MAXIMUM) or 1]
    count = max(2, min(SAMPLES_MAXIMUM - len(kept), math.ceil((end - begin) / SAMPLE_S) + 1))
    return np.unique(np.concatenate((np.linspace(begin, end, count), kept))) if end > begin else np.full(2, begin)


def _waypoint_times(moving: arena_description.Moving, begin: float, end: float, clock: Lateness) -> Floats:
    """When the shape passes waypoints from `begin` to `end`, on the world's clock (s)."""
    way = np.array([point.time_s for point in moving.path])
    period = float(way[-1])
    if period <= 0.0:
        return np.empty(0)
    own = np.concatenate(([begin], clock.time, [end]))
    own.sort()
    past = own - np.interp(own, clock.time, clock.waited)  # on the path's clock
    first = 0 if moving.repeat == "once" else math.floor(past[0] / period)
    last = 0 if moving.repeat == "once" else math.floor(past[-1] / period)
    if (last - first + 1) * len(way) > SAMPLES_MAXIMUM:  # too many to be told
        return np.empty(0)
    back = moving.repeat == "back_and_forth"
    turns = [n * period + (period - way if back and n % 2 else way) for n in range(first, last + 1)]
    return np.interp(np.sort(np.concatenate(turns)), past, own)


def _poses(arena: Arena, time: Floats, late: Sequence[Lateness]) -> Floats:
    """Of each moving shape at each time, as `plan_of_poses` takes them."""
    shapes = len(arena.description.moving)
    if not shapes:
        return np.empty((0, 4, len(time)))
    waited = np.array([np.interp(time, row.time, row.waited) for row in late]).reshape(len(late), len(time)).T
    rows = zip(time.tolist(), waited.tolist(), strict=True)
    return np.array([poses_of(arena._movers(moment, clocks)) for moment, clocks in rows]).transpose(1, 2, 0)
