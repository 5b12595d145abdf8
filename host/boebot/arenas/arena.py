"""Arenas: where things are and where a robot starts, read from a file, and what can be asked of them.

Lengths in m, angles in rad. A wrong file gets one sentence that names file, line, key and what was expected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot import arguments
from boebot.arenas.compiled import ffi, lib
from boebot.arenas.description import (
    ArenaDescription,
    DescriptionError,
    Disc,
    Moving,
    Point,
    Polygon,
    Start,
    Wall,
    check,
)
from boebot.description import toml_files
from boebot.errors import ArenaError

__all__ = ["Arena", "ArenaDescription", "Floats", "Point", "Polygon", "Start", "arena_names", "load_arena"]

Floats = NDArray[np.float64]
REPEATS = {"loop": lib.PATH_LOOP, "back_and_forth": lib.PATH_BACK_AND_FORTH, "once": lib.PATH_ONCE}
DISC_CORNERS = 48  # of a disc as it is drawn
START_TRIES = 10_000  # places that are tried for a start by chance
REACH_MAXIMUM_M = 1e7  # that may be asked for


class Arena:
    """An arena that rays and robots can meet. Shapes are numbered outlines, obstacles, walls, discs, in this order.

    It does not change, and any number of simulations may share it.

    Attributes:
        handle: the `arena *` of geometry/arena.h.
    """

    def __init__(self, description: ArenaDescription | toml_files.Table, file: str = "arena") -> None:
        """From a description made in Python, which may hold numpy's arrays, or from a file's table; both are checked
        alike. `file`: its name, for errors.

        Raises:
            ArenaError: a key, type or value that the description's types do not allow, a polygon that is none, a path
                that goes back in time, two shapes of the same name.
        """
        table = description if isinstance(description, toml_files.Table) else _table_of(description)
        self.description = toml_files.convert(table, ArenaDescription, file, ArenaError)
        try:
            check(self.description)
        except DescriptionError as error:
            raise ArenaError(f"{toml_files.where(table, file, error.place)}: {error}") from None
        self.name = self.description.name
        self._polygons: list[Floats] = []
        self.handle = ffi.gc(lib.arena_new(), lib.arena_destroy)
        for outline in self.description.outline:
            self._polygons.append(self._add_edges(outline.corners_m, lib.ARENA_OUTLINE, outline))
        for obstacle in self.description.obstacle:
            self._polygons.append(self._add_edges(obstacle.corners_m, lib.ARENA_OBSTACLE, obstacle))
        for wall in self.description.wall:
            points = self._add_edges(wall.points_m, lib.ARENA_WALL, wall)
            self._polygons.append(np.vstack((points, points[-2:0:-1])))  # there and back
        for disc in self.description.disc:
            self._added(lib.arena_add_disc(self.handle, disc.x_m, disc.y_m, disc.radius_m, _surface(disc)))
            self._polygons.append(_ring(disc.radius_m) + np.array((disc.x_m, disc.y_m)))
        self._add_floor()
        for moving in self.description.moving:
            self._add_moving(moving)
        lib.arena_build(self.handle)

    def __reduce__(self) -> tuple[type[Arena], tuple[ArenaDescription]]:
        """To copy and pickle it: made anew of its description."""
        return Arena, (self.description,)

    def _add_edges(self, points: Sequence[Point], kind: int, shape: Polygon | Wall) -> Floats:
        xy = np.array(points, dtype=np.float64)
        self._added(lib.arena_add_edges(self.handle, _doubles(xy), len(xy), kind, _surface(shape)))
        return xy

    def _add_floor(self) -> None:
        """What rays do not meet."""
        for patch in self.description.patch:
            corners = np.array(patch.corners_m, dtype=np.float64)
            self._added(lib.arena_add_patch(self.handle, _doubles(corners), len(corners), patch.grip))
        lib.arena_set_floor(self.handle, self.description.floor_reflectance)
        for line in self.description.line:
            points = np.array(line.points_m, dtype=np.float64)
            look = (line.width_m, line.floor_reflectance)
            self._added(lib.arena_add_line(self.handle, _doubles(points), len(points), *look))
        for light in self.description.light:
            self._added(lib.arena_add_light(self.handle, light.x_m, light.y_m, light.height_m, light.power_w))
        if (charger := self.description.charger) is not None:
            lib.arena_set_charger(self.handle, charger.x_m, charger.y_m, charger.radius_m)

    def _add_moving(self, moving: Moving) -> None:
        corners = None if moving.corners_m is None else np.array(moving.corners_m, dtype=np.float64)
        shape = (ffi.NULL, 0) if corners is None else (_doubles(corners), len(corners))
        points = [(point.time_s, point.x_m, point.y_m, point.heading_rad) for point in moving.path]
        path = (ffi.new("path_waypoint[]", points), len(points), REPEATS[moving.repeat])
        radius = moving.radius_m or 0.0
        self._added(lib.arena_add_moving(self.handle, *shape, radius, _surface(moving), *path))

    def _added(self, number: int) -> None:
        if number < 0:  # what is wrong in itself was refused before
            raise MemoryError(f"arena {self.name}")

    @property
    def outlines(self) -> list[Floats]:
        """All shapes that stay in place as closed polygons: arrays of shape (corners, 2) in m.

        A wall goes there and back, a disc has 48 corners.
        """
        return [polygon.copy() for polygon in self._polygons]

    def movers(self, time: float, waited: Sequence[float] = ()) -> Any:
        """The moving shapes at a time (s), as C has them (geometry/scene.h).

        `waited`: how far the clock of each one's path is behind (s); none is while none has waited for a robot.
        """
        movers = ffi.new("mover[]", len(self.description.moving))
        for mover, late in zip(movers, waited, strict=False):
            mover.waited = late
        lib.scene_moving(self.handle, time, 1.0, 1, movers)
        return movers

    @property
    def start(self) -> tuple[float, float, float]:
        """Where a robot starts: x (m), y (m), heading (rad)."""
        start = self.description.start
        return start.x_m, start.y_m, start.heading_rad

    def ray(self, x: float, y: float, angle: float, reach: float) -> float | None:
        """Distance (m) from (x, y) to the nearest thing in direction `angle` (rad), None beyond `reach` (m).

        Raises:
            ArenaError: a number is not finite or too large.
        """
        x, y = _position(x, y)
        angle = arguments.number("arena: angle", angle, ArenaError)
        reach = arguments.number("arena: reach", reach, ArenaError, least=0.0, most=REACH_MAXIMUM_M)
        distance: float = lib.arena_ray(self.handle, x, y, math.cos(angle), math.sin(angle), reach, 0.0, ffi.NULL)
        return None if distance < 0 else distance

    def is_free(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc of `radius` (m) at (x, y) lies in free space, also of what moves, at the start.

        Raises:
            ArenaError: a number is not finite, negative or too large.
        """
        x, y = _position(x, y)
        radius = arguments.number("arena: radius", radius, ArenaError, least=0.0, most=REACH_MAXIMUM_M)
        movers = self.movers(0.0)
        scene = ffi.new("scene *", {"arena": self.handle, "movers": movers, "movers_count": len(movers)})
        return bool(lib.scene_is_free(scene, x, y, radius, 0))

    def free_start(self, radius: float, seed: int) -> tuple[float, float, float]:
        """A free place by chance, and any heading: x (m), y (m), heading (rad); the same for the same seed.

        Equally likely anywhere within the outlines or, in an open field, up to 1 m beside what stands there. That a way
        leads there is not looked at.

        Args:
            radius: of a disc in which the robot fits (m).

        Raises:
            ArenaError: no free place is found, or a number is not finite, negative or too large.
        """
        key = arguments.whole("arena: seed", seed, ArenaError, least=-(2**63), most=2**64 - 1) % 2**64
        chance = np.random.default_rng((key, 1))  # 1: not what others draw by this seed
        if not self._polygons:
            raise ArenaError(f"arena {self.name} has no shape that stays; expected one beside which a place can be")
        points = np.vstack(self._polygons[: len(self.description.outline) or None])
        edge = 0.0 if self.description.outline else 1.0
        for _ in range(START_TRIES):
            x, y = chance.uniform(points.min(axis=0) - edge, points.max(axis=0) + edge).tolist()
            if self.is_free(x, y, radius):
                return x, y, float(chance.uniform(-math.pi, math.pi))
        raise ArenaError(
            f"arena {self.name}: of {START_TRIES:,} places none is free for a robot of {radius:g} m of radius; "
            "expected a smaller robot or more room"
        )


def arena_names() -> list[str]:
    """The bundled arenas."""
    return toml_files.bundled_names("arenas")


def load_arena(arena: str | Path | None) -> Arena:
    """The arena of that bundled name, or described by that file; None: the default, `room`.

    Raises:
        ArenaError: unknown arena, unreadable file, wrong key or value, no polygon, or a start in no free space.
    """
    path = toml_files.find("arenas", "room" if arena is None else arena, ArenaError)
    table = toml_files.read(path, ArenaError)
    loaded = Arena(table, path.name)
    x, y, _ = loaded.start
    if not loaded.is_free(x, y, 0.0):
        place = toml_files.where(table, path.name, "start")
        raise ArenaError(f"{place}: start: x_m = {x:g}, y_m = {y:g} is in or behind something; expected free space")
    return loaded


def _table_of(description: Any) -> dict[str, Any]:
    """A description made in Python as a file would say it."""
    try:
        return cast("dict[str, Any]", msgspec.to_builtins(description, enc_hook=arguments.plain))
    except RecursionError:
        raise ArenaError("arena: the description holds itself; expected an ArenaDescription") from None


def _position(x: float, y: float) -> tuple[float, ...]:
    limit = float(lib.ARENA_FARTHEST_M)
    return arguments.point("arena: the position", (x, y), ArenaError, "x, y (m)", (limit, limit))


def _doubles(values: Floats) -> Any:
    return ffi.from_buffer("double[]", values)


def _surface(shape: Polygon | Wall | Disc | Moving) -> Any:
    height = math.inf if shape.height_m is None else shape.height_m
    return ffi.new("arena_surface *", [height, shape.infrared_reflectance, shape.sound_reflectance])


def _ring(radius: float) -> Floats:
    """A disc as a polygon."""
    turn = np.arange(DISC_CORNERS) * (2 * math.pi / DISC_CORNERS)
    return radius * np.column_stack((np.cos(turn), np.sin(turn)))
