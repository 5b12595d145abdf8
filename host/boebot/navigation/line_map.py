"""A map of lines: what a robot's author tells it of an arena, and what a range finder would see there.

A brain has a map only if its author gives it one. It is made from an arena's file or from lines, and holds what stands
there; what moves, and where robots are, is not in it.
"""

from __future__ import annotations

import math
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boebot.arenas.arena import Arena, load_arena
from boebot.arenas.compiled import ffi, lib
from boebot.arenas.description import ArenaDescription, Start, Wall
from boebot.errors import ArenaError, BrainError

Floats = NDArray[np.float64]
MOST_RAYS = 1_000_000  # of a scan


class LineMap:
    """Lines in the arena's frame, with the side of closed shapes that is solid.

    Attributes:
        name: of the arena.
        outlines: closed shapes inside which the robot lives, each an array (corners, 2) in m.
        obstacles: closed shapes that are solid, each an array (corners, 2) in m; walls go there and back.
    """

    def __init__(self, arena: Arena) -> None:
        """Of an arena as it stands, without what moves."""
        fixed = arena.description
        if fixed.moving:
            fixed = ArenaDescription(**{key: getattr(fixed, key) for key in fixed.__struct_fields__} | {"moving": ()})
            arena = Arena(fixed)
        self._arena = arena
        self.name = arena.name
        shapes, count = arena.outlines, len(fixed.outline)
        self.outlines, self.obstacles = shapes[:count], shapes[count:]
        self._scene = ffi.new("scene *", {"arena": arena.handle, "movers": ffi.NULL, "movers_count": 0})
        self._fans: dict[tuple[float, float, int], object] = {}

    @classmethod
    def of(cls, arena: str | Path | Arena) -> LineMap:
        """Of a bundled arena by its name, or of a TOML file.

        Raises:
            ArenaError: there is none, or it is wrong.
        """
        return cls(arena if isinstance(arena, Arena) else load_arena(arena))

    @classmethod
    def from_lines(cls, lines: ArrayLike, name: str = "lines") -> LineMap:
        """Of segments, shape (n, 2, 2): x and y (m) of both ends.

        Raises:
            BrainError: they are none.
        """
        try:
            ends = np.asarray(lines, dtype=np.float64).reshape(-1, 2, 2)
            walls = [Wall(points_m=[(x0, y0), (x1, y1)]) for (x0, y0), (x1, y1) in ends.tolist()]
            if not walls:
                raise ValueError("there are none")
            low = ends.reshape(-1, 2).min(axis=0)
            return cls(
                Arena(ArenaDescription(name=name, start=Start(float(low[0]) - 1.0, float(low[1]) - 1.0), wall=walls))
            )
        except (TypeError, ValueError, ArenaError) as error:
            raise BrainError(f"a map of lines expects segments, shape (n, 2, 2), in m: {error}") from None

    def __reduce__(self) -> tuple[type[LineMap], tuple[Arena]]:
        """To copy and pickle it: made anew of its arena."""
        return LineMap, (self._arena,)

    def __repr__(self) -> str:
        """How much there is."""
        return f"<LineMap of {self.name}: {len(self.segments)} lines>"

    @cached_property
    def segments(self) -> Floats:
        """All lines, each once, shape (n, 2, 2): both ends, in m."""
        found: dict[frozenset[tuple[float, ...]], tuple[tuple[float, ...], ...]] = {}
        for shape in (*self.outlines, *self.obstacles):
            corners = [tuple(point) for point in shape.tolist()]
            for begin, end in zip(corners, [*corners[1:], corners[0]], strict=True):
                found.setdefault(frozenset((begin, end)), (begin, end))
        return np.array([line for ends, line in found.items() if len(ends) == 2]).reshape(-1, 2, 2)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower left and upper right corner of the box about all lines (m).

        Raises:
            BrainError: there are no lines.
        """
        points = self.segments.reshape(-1, 2)
        if not len(points):
            raise BrainError(f"the map of {self.name} has no lines")
        return points.min(axis=0), points.max(axis=0)

    def scans(self, poses: ArrayLike, bearings: tuple[float, float], count: int, reach: float) -> Floats:
        """What a range finder would see.

        Args:
            poses: of the range finder: x (m), y (m), heading (rad), shape (n, 3).
            bearings: of the first and the last ray, counter-clockwise from the heading (rad).
            count: of rays, at least 2, equally spaced.
            reach: of each ray (m).

        Returns:
            Distances (m), shape (n, count); -1 where nothing is within reach.

        Raises:
            BrainError: poses or bearings are none, or count is not that of 2 rays or more.
        """
        at = np.asarray(poses, dtype=np.float64)
        if at.size % 3 or not np.isfinite(at).all():
            raise BrainError(f"poses of shape {at.shape}; expected finite numbers, shape (n, 3): m, m, rad")
        at = at.reshape(-1, 3)
        fan = self._fan(*bearings, count)
        ranges = np.empty((len(at), count))
        rows = ffi.from_buffer("double[]", ranges)
        for index, (x, y, heading) in enumerate(at.tolist()):
            cosine, sine = math.cos(heading), math.sin(heading)
            lib.scan_look(fan, self._scene, x, y, cosine, sine, reach, 0.0, 0, rows + index * count)
        return ranges

    def _fan(self, first: float, last: float, count: int) -> object:
        key = first, last, count
        if key not in self._fans:
            fan = lib.scan_fan_new(first, last, count) if 2 <= count <= MOST_RAYS else ffi.NULL
            if fan == ffi.NULL:
                raise BrainError(
                    f"{count} rays from {first:g} to {last:g} rad; expected 2 to {MOST_RAYS:,}, within one turn"
                )
            self._fans[key] = ffi.gc(fan, lib.scan_fan_destroy)
        return self._fans[key]

    def distance(self, points: ArrayLike) -> Floats:
        """From each point (m), shape (n, 2), to the nearest line (m), shape (n,)."""
        at = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        nearest = np.full(len(at), np.inf)
        for (ax, ay), (bx, by) in self.segments:
            dx, dy = bx - ax, by - ay
            length = dx * dx + dy * dy
            along = np.clip(((at[:, 0] - ax) * dx + (at[:, 1] - ay) * dy) / length, 0.0, 1.0) if length else 0.0
            np.minimum(nearest, np.hypot(at[:, 0] - ax - along * dx, at[:, 1] - ay - along * dy), out=nearest)
        return nearest

    def is_solid(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point (m), shape (n, 2), lies inside an obstacle or outside of all outlines, shape (n,)."""
        at = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        solid = np.zeros(len(at), dtype=np.bool_)
        for shape in self.obstacles:
            solid |= inside(at, shape)
        if self.outlines:
            within = np.zeros(len(at), dtype=np.bool_)
            for shape in self.outlines:
                within |= inside(at, shape)
            solid |= ~within
        return solid


def inside(points: Floats, polygon: Floats) -> NDArray[np.bool_]:
    """Whether each point lies inside a closed polygon: a ray to the right crosses its edges an odd number of times."""
    x, y = points[:, 0], points[:, 1]
    odd = np.zeros(len(points), dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if ay != by:
            crosses = (ay > y) != (by > y)
            odd ^= crosses & (x < ax + (bx - ax) * (y - ay) / (by - ay))
    return odd
