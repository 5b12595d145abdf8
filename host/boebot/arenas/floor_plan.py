"""A floor plan: an arena from above with what moves in it over a time, for pictures after a run and for planning.

Lengths in m, angles in rad, x to the right, y up; arrays of points have the shape (points, 2).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from boebot.arenas import description
from boebot.arenas.arena import Arena, Floats

JUMP_S = 1e-6  # before a moving shape is put elsewhere it is drawn where it was
SAMPLE_S = 0.05  # from one pose of a moving shape to the next
SAMPLES_MAXIMUM = 20_000  # of one moving shape; longer times have them farther apart
LOOKED_OVER_M = 0.10  # the highest sensor, a laser, sits here: lower things are not seen by all sensors


@dataclass(frozen=True, kw_only=True)
class Solid:
    """What keeps robots out, or, as an outline, in.

    Attributes:
        kind: "outline", "obstacle", "wall" or "disc"; a moving shape is an obstacle or a disc in its own frame.
        points: corners of a polygon, in which the last joins the first; ends and bends of a wall; a disc's centre.
        radius: of a disc.
        height: of its top above the floor.
        infrared_reflectance, sound_reflectance: shares that come back, 0 to 1.
    """

    kind: Literal["outline", "obstacle", "wall", "disc"]
    points: Floats
    radius: float = 0.0
    name: str = ""
    height: float = math.inf
    infrared_reflectance: float = 1.0
    sound_reflectance: float = 1.0

    @property
    def is_low(self) -> bool:
        """Some sensors look over it."""
        return self.height < LOOKED_OVER_M

    @property
    def is_dull(self) -> bool:
        """It throws back less than a white, hard wall."""
        return self.infrared_reflectance < 1.0 or self.sound_reflectance < 1.0

    @property
    def remarks(self) -> list[str]:
        """What of it cannot be seen from above, in words: a low height, reflectances."""
        said = [f"{self.height * 100:g} cm high"] if self.is_low else []
        if self.infrared_reflectance < 1.0:
            said.append(f"IR {self.infrared_reflectance:.0%}")
        if self.sound_reflectance < 1.0:
            said.append(f"sound {self.sound_reflectance:.0%}")
        return said

    def placed(self, x: float, y: float, heading: float) -> Solid:
        """The solid with its frame at a pose."""
        cosine, sine = math.cos(heading), math.sin(heading)
        turned = self.points @ np.array([[cosine, sine], [-sine, cosine]])
        return replace(self, points=turned + np.array((x, y)))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lower left and upper right corner."""
        return self.points.min(axis=0) - self.radius, self.points.max(axis=0) + self.radius


@dataclass(frozen=True, kw_only=True)
class Moving:
    """A solid on its way: its frame's pose at each time, straight and even between them."""

    solid: Solid
    time: Floats  # s, on the clock of the truth
    x: Floats
    y: Floats
    heading: Floats  # not wrapped

    def pose(self, time: float) -> tuple[float, float, float]:
        """x, y, heading at a time; before the first and after the last one it stands."""
        x, y, heading = (float(np.interp(time, self.time, row)) for row in (self.x, self.y, self.heading))
        return x, y, heading

    def at(self, time: float) -> Solid:
        """The solid where it is then."""
        return self.solid.placed(*self.pose(time))


@dataclass(frozen=True, kw_only=True)
class FloorPlan:
    """An arena from above: as it is described, what keeps robots out, and what moves.

    `grip`: of tyres on the floor outside of all patches.
    """

    described: description.ArenaDescription = field(default=description.ArenaDescription("arena"), repr=False)
    solids: Sequence[Solid] = field(default=(), repr=False)
    moving: Sequence[Moving] = field(default=(), repr=False)
    grip: float = 0.7

    @property
    def outlines(self) -> list[Solid]:
        """Within these the robots are; none in an open field."""
        return [solid for solid in self.solids if solid.kind == "outline"]

    @property
    def obstacles(self) -> list[Solid]:
        """What stands within."""
        return [solid for solid in self.solids if solid.kind != "outline"]


Surface = description.Polygon | description.Wall | description.Disc | description.Moving


@dataclass(frozen=True, kw_only=True)
class Lateness:
    """By how much the clock of a moving shape's path was behind the world's, for it had waited: even between rows."""

    time: Floats  # s, increasing
    waited: Floats  # s


class Shift(NamedTuple):
    """A moving shape was put elsewhere: from `time` (s) on it goes along its way this much off it (m, m, rad)."""

    time: float
    shape: int
    x: float
    y: float
    heading: float


def floor_plan(
    arena: Arena, begin: float, end: float, late: Sequence[Lateness] = (), shifts: Sequence[Shift] = ()
) -> FloorPlan:
    """The arena with its moving shapes from `begin` to `end` (s).

    Args:
        late: of each of them; one that has no rows, or is not there, never waited.
        shifts: all of them, by time.
    """
    never = Lateness(time=np.array([begin, end]), waited=np.zeros(2))
    shapes = range(len(arena.description.moving))
    late = [late[k] if k < len(late) and len(late[k].time) else never for k in shapes]
    time = _times(arena, begin, end, late, shifts)
    poses = _poses(arena, time, late)
    for shape, pose in enumerate(poses):
        _shift(pose, time, [shift for shift in shifts if shift.shape == shape])
    return plan_of_poses(arena, time, poses)


def plan_of_poses(arena: Arena, time: Floats, poses: Floats) -> FloorPlan:
    """The arena with its moving shapes at these times (s).

    Args:
        poses: x, y (m), cosine and sine of the heading of each shape: shape (shapes, 4, times).
    """
    return FloorPlan(
        described=arena.description,
        solids=list(_solids(arena)),
        moving=[
            Moving(solid=solid, time=time, x=x, y=y, heading=np.unwrap(np.arctan2(sine, cosine)))
            for solid, (x, y, cosine, sine) in zip(moving_solids(arena), poses, strict=True)
        ],
    )


def poses_of(movers: Any) -> Floats:
    """x, y (m), cosine and sine of the heading of each of the C core's movers: shape (movers, 4)."""
    return np.array([(m.x, m.y, m.cosine, m.sine) for m in movers], dtype=np.float64).reshape(-1, 4)


def path_end(arena: Arena) -> float:
    """When the last moving shape has gone its path once (s); 0 without one."""
    return max((moving.path[-1].time_s for moving in arena.description.moving), default=0.0)


def _solids(arena: Arena) -> Iterator[Solid]:
    """Those that stay in place."""
    described = arena.description
    now = iter(arena.outlines)
    for outline in described.outline:
        yield Solid(kind="outline", points=next(now), **_surface(outline))
    for obstacle in described.obstacle:
        yield Solid(kind="obstacle", points=next(now), **_surface(obstacle))
    for wall in described.wall:
        yield Solid(kind="wall", points=next(now)[: len(wall.points_m)], **_surface(wall))
    for disc in described.disc:
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


def _times(arena: Arena, begin: float, end: float, late: Sequence[Lateness], shifts: Sequence[Shift]) -> Floats:
    """Times of the poses: evenly, and wherever a shape begins or ends to wait, is put elsewhere or passes a waypoint,
    between which it goes straight (paths.h)."""
    bends = [row.time for row in late]
    bends += [np.array((shift.time - JUMP_S, shift.time)) for shift in shifts]
    for k, moving in enumerate(arena.description.moving):
        bends.append(_waypoint_times(moving, begin, end, late[k]))
    kept = np.unique(np.concatenate([np.empty(0), *bends]))
    kept = kept[(kept > begin) & (kept < end)]
    kept = kept[:: math.ceil(2 * len(kept) / SAMPLES_MAXIMUM) or 1]
    count = max(2, min(SAMPLES_MAXIMUM - len(kept), math.ceil((end - begin) / SAMPLE_S) + 1))
    return np.unique(np.concatenate((np.linspace(begin, end, count), kept))) if end > begin else np.full(2, begin)


def _waypoint_times(moving: description.Moving, begin: float, end: float, clock: Lateness) -> Floats:
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
    if (last - first + 1) * len(way) > SAMPLES_MAXIMUM:  # too many to show
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
    return np.array([poses_of(arena.movers(moment, clocks)) for moment, clocks in rows]).transpose(1, 2, 0)


def _shift(pose: Floats, time: Floats, shifts: Sequence[Shift]) -> None:
    """Puts one shape as far off its way as it was at each time: x, y, cosine and sine of its heading change."""
    if not shifts:
        return
    newest = np.searchsorted([shift.time for shift in shifts], time, side="right")
    x, y, turn = np.array([(0.0, 0.0, 0.0), *((shift.x, shift.y, shift.heading) for shift in shifts)])[newest].T
    cosine, sine = pose[2].copy(), pose[3].copy()
    pose[0] += x
    pose[1] += y
    pose[2] = cosine * np.cos(turn) - sine * np.sin(turn)
    pose[3] = sine * np.cos(turn) + cosine * np.sin(turn)
