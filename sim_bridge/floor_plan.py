"""An arena as the host's floor plan (boebot.floor_plan): what a session tells of it for pictures after a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from boebot.floor_plan import Charger, FloorPlan, Lamp, Moving, Patch, Solid
from sim_bridge import arena_description
from sim_bridge.arena import Arena, Floats
from sim_bridge.imperfections import TYRE_GRIP

SAMPLE_S = 0.05  # from one pose of a moving shape to the next
SAMPLES_MAXIMUM = 20_000  # of one moving shape; longer times have them farther apart

Surface = arena_description.Polygon | arena_description.Wall | arena_description.Disc | arena_description.Moving


def floor_plan(arena: Arena, begin: float, end: float) -> FloorPlan:
    """The arena with its moving shapes from `begin` to `end` (s)."""
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
        moving=list(_moving(arena, begin, end)),
        grip=TYRE_GRIP,
    )


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


def _moving(arena: Arena, begin: float, end: float) -> Iterator[Moving]:
    shapes = arena.description.moving
    if not shapes:
        return
    count = max(2, min(SAMPLES_MAXIMUM, math.ceil((end - begin) / SAMPLE_S) + 1))
    time = np.linspace(begin, end, count)
    poses = _poses(arena, time, len(shapes))
    for moving, (x, y, cosine, sine) in zip(shapes, poses, strict=True):
        if moving.corners_m is None:
            solid = Solid(kind="disc", points=np.zeros((1, 2)), radius=moving.radius_m or 0.0, **_surface(moving))
        else:
            solid = Solid(kind="obstacle", points=np.array(moving.corners_m), **_surface(moving))
        yield Moving(solid=solid, time=time, x=x, y=y, heading=np.unwrap(np.arctan2(sine, cosine)))


def _poses(arena: Arena, time: Floats, count: int) -> Floats:
    """x, y, cosine and sine of the heading of each moving shape at each time: shape (shapes, 4, times)."""
    poses = np.empty((count, 4, len(time)))
    for k, moment in enumerate(time.tolist()):
        movers = arena._movers(moment)
        for i in range(count):
            mover = movers[i]
            poses[i, :, k] = mover.x, mover.y, mover.cosine, mover.sine
    return poses
