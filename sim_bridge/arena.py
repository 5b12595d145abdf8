"""Arenas: where walls and obstacles are and where a robot starts, read from `arenas/*.toml`.

Lengths in m, angles in rad. A wrong file gets one sentence that names the file, the key and what was expected.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot import toml_files
from boebot.errors import ArenaError
from sim_bridge._core import ffi, lib

Point = tuple[float, float]
Floats = NDArray[np.float64]

EXTENT_M = 1000.0  # nothing lies farther from the origin


class Start(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Where a robot starts."""

    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0


class Polygon(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A closed polygon; its last corner joins the first."""

    corners_m: list[Point]
    name: str = ""


class ArenaDescription(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """What an arena file says."""

    name: str
    title: str = ""
    start: Start = Start()
    outline: list[Polygon] = msgspec.field(default_factory=list)
    obstacle: list[Polygon] = msgspec.field(default_factory=list)


class Arena:
    """An arena that rays and robots can meet. Polygons are numbered outlines first, then obstacles."""

    def __init__(self, description: ArenaDescription, file: str = "arena") -> None:
        """Raises ArenaError where a polygon is none."""
        self.description = description
        self.name = description.name
        self._polygons: list[Floats] = []
        self._numbers: dict[str, int] = {}
        self.handle = ffi.gc(lib.arena_new(), lib.arena_destroy)
        for kind, key, polygons in (
            (lib.ARENA_OUTLINE, "outline", description.outline),
            (lib.ARENA_OBSTACLE, "obstacle", description.obstacle),
        ):
            for index, polygon in enumerate(polygons):
                _check_polygon(polygon.corners_m, f"{file}: {key}[{index}].corners_m")
                self._add(polygon, kind)
        lib.arena_build(self.handle)

    def _add(self, polygon: Polygon, kind: int) -> None:
        corners = np.array(polygon.corners_m, dtype=np.float64)
        number = lib.arena_add_polygon(self.handle, ffi.from_buffer("double[]", corners), len(corners), kind, ffi.NULL)
        if number < 0:
            raise MemoryError("arena")
        self._polygons.append(corners)
        if polygon.name:
            self._numbers[polygon.name] = number

    @property
    def outlines(self) -> list[Floats]:
        """All polygons where they are now: arrays of shape (corners, 2) in m."""
        return [polygon.copy() for polygon in self._polygons]

    @property
    def start(self) -> tuple[float, float, float]:
        """Where a robot starts: x (m), y (m), heading (rad)."""
        start = self.description.start
        return start.x_m, start.y_m, start.heading_rad

    def ray(self, x: float, y: float, angle: float, reach: float) -> float | None:
        """Distance (m) from (x, y) to the nearest edge in direction `angle` (rad), None beyond `reach` (m)."""
        distance: float = lib.arena_ray(self.handle, x, y, math.cos(angle), math.sin(angle), reach, 0.0, ffi.NULL)
        return None if distance < 0 else distance

    def clearance(self, x: float, y: float, limit: float = 10.0) -> float:
        """Distance (m) from (x, y) to the nearest edge, at most `limit`."""
        distance: float = lib.arena_clearance(self.handle, x, y, limit)
        return distance

    def is_free(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc of `radius` (m) at (x, y) lies in free space."""
        return bool(lib.arena_is_free(self.handle, x, y, radius))

    def move(self, polygon: int | str, dx: float, dy: float) -> None:
        """Moves a polygon, by number or name, by (dx, dy) m.

        Raises:
            ArenaError: there is no such polygon.
        """
        number = self._numbers.get(polygon, -1) if isinstance(polygon, str) else polygon
        if not math.isfinite(dx + dy) or lib.arena_move_polygon(self.handle, number, dx, dy) != 0:
            raise ArenaError(f"arena {self.name}: there is no polygon {polygon!r} to move")
        self._polygons[number] += (dx, dy)

    def free_cells(self, size: float, radius: float) -> Floats:
        """Centres of the square cells of side `size` (m) in which a robot of `radius` (m) can stand: shape (n, 2).

        Cells lie on a lattice through the origin. A field without outline has none.
        """
        if not self.description.outline:
            return np.empty((0, 2))
        corners = np.concatenate(self._polygons)
        low = np.floor(corners.min(axis=0) / size).astype(int)
        high = np.ceil(corners.max(axis=0) / size).astype(int)
        return np.array(list(self._free_centres(low, high, size, radius))).reshape(-1, 2)

    def _free_centres(self, low: Any, high: Any, size: float, radius: float) -> Iterator[Point]:
        for column in range(low[0], high[0]):
            for row in range(low[1], high[1]):
                x, y = (column + 0.5) * size, (row + 0.5) * size
                if self.is_free(x, y, radius):
                    yield x, y


def arena_names() -> list[str]:
    """The bundled arenas."""
    return toml_files.bundled_names("arenas")


def load_arena(arena: str | Path | None) -> Arena:
    """The arena of that bundled name, or described by that file; None: the default, `room`.

    Raises:
        ArenaError: unknown arena, unreadable file, wrong key or value, or no polygon.
    """
    path = toml_files.find("arenas", "room" if arena is None else arena, ArenaError)
    table = toml_files.read(path, ArenaError)
    return Arena(toml_files.convert(table, ArenaDescription, path.name, ArenaError), path.name)


def _check_polygon(corners: list[Point], where: str) -> None:
    """Refuses what is no simple polygon of finite size."""
    if len(corners) < 3:
        raise ArenaError(f"{where} has {len(corners)} corners; expected at least 3")
    for index, corner in enumerate(corners):
        if not all(math.isfinite(value) and abs(value) <= EXTENT_M for value in corner):
            raise ArenaError(f"{where}[{index}] is {list(corner)}; expected numbers within ±{EXTENT_M:g} m")
    following = [*corners[1:], corners[0]]
    for index, (a, b) in enumerate(zip(corners, following, strict=True)):
        if math.dist(a, b) < 1e-9:
            raise ArenaError(f"{where}[{index}] and the corner after it are the same point; expected an edge")
    crossing = _crossing(np.array(corners), np.array(following))
    if crossing is not None:
        raise ArenaError(f"{where}: edges {crossing[0]} and {crossing[1]} cross; expected a polygon that does not")


def _crossing(starts: Floats, ends: Floats) -> tuple[int, int] | None:
    """Two edges of a closed polygon that meet although they are no neighbours, or neighbours that fold back."""

    def side(p: Floats, q: Floats, r: Floats) -> Floats:
        cross: Floats = (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (
            r[..., 0] - p[..., 0]
        )
        return cross

    count = len(starts)
    for i in range(count):
        rest = np.arange(i + 1, count)
        if rest.size == 0:
            continue
        a, b, c, d = starts[i], ends[i], starts[rest], ends[rest]
        apart = (np.maximum(a, b) < np.minimum(c, d)) | (np.maximum(c, d) < np.minimum(a, b))
        meet = (side(a, b, c) * side(a, b, d) <= 0) & (side(c, d, a) * side(c, d, b) <= 0) & ~apart.any(axis=1)
        neighbour = (rest == i + 1) | ((i == 0) & (rest == count - 1))
        along = (b - a) @ (d - c).T
        fold = neighbour & (along < 0) & (np.abs((b - a)[0] * (d - c)[:, 1] - (b - a)[1] * (d - c)[:, 0]) < 1e-15)
        wrong = np.flatnonzero((meet & ~neighbour) | fold)
        if wrong.size:
            return i, int(rest[wrong[0]])
    return None
