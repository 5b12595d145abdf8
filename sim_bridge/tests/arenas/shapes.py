"""Arenas built shape by shape, for tests of the C core, and random ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from hypothesis import strategies as st

from boebot.arenas.arena import Floats
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import square

INDEXES = (lib.ARENA_INDEX_NONE, lib.ARENA_INDEX_GRID, lib.ARENA_INDEX_LISTS)

coordinates = st.floats(-3, 3).map(lambda v: round(v, 3))
angles = st.floats(-math.pi, math.pi)


class Shapes:
    """An arena built up shape by shape."""

    def __init__(self) -> None:
        self.handle = ffi.gc(lib.arena_new(), lib.arena_destroy)
        self.rings: list[shapely.Geometry] = []

    def polygon(self, corners: Any, height: float | None = None) -> Shapes:
        return self._add(shapely.LinearRing, corners, lib.ARENA_OBSTACLE, height)

    def wall(self, corners: Any, height: float | None = None) -> Shapes:
        return self._add(shapely.LineString, corners, lib.ARENA_WALL, height)

    def disc(self, x: float, y: float, radius: float, height: float | None = None) -> Shapes:
        assert lib.arena_add_disc(self.handle, x, y, radius, surface_of(height)) >= 0
        return self

    def _add(self, ring: Any, corners: Any, kind: int, height: float | None) -> Shapes:
        xy = np.array(corners, dtype=np.float64)
        added = lib.arena_add_edges(self.handle, ffi.from_buffer("double[]", xy), len(xy), kind, surface_of(height))
        assert added >= 0
        self.rings.append(ring(corners))
        return self

    def build(self, index: int = lib.ARENA_INDEX_LISTS) -> Shapes:
        lib.arena_use_index(self.handle, index)
        return self

    def ray(self, x: float, y: float, angle: float, reach: float = 1e3, height: float = 0.0) -> tuple[float, int]:
        """Distance and item; -1, -1 if nothing is met."""
        item = ffi.new("uint32_t *", 0)
        distance = lib.arena_ray(self.handle, x, y, math.cos(angle), math.sin(angle), reach, height, item)
        return (distance, item[0]) if distance >= 0 else (-1.0, -1)

    def fan(self, x: float, y: float, looks: Sequence[float], reach: float = 1e3, height: float = 0.0) -> list[float]:
        """Distances of rays that are asked together."""
        fan = ffi.new("ray_fan *")
        lib.ray_fan_set(fan, [math.cos(look) for look in looks], [math.sin(look) for look in looks], len(looks))
        distances = ffi.new("double[]", len(looks) + 3)
        question = ffi.new("fan_question *", (self.handle, fan, x, y, 1.0, 0.0, reach, height, distances))
        lib.arena_fan(question)
        return list(distances)[: len(looks)]


def surface_of(height: float | None) -> Any:
    return ffi.NULL if height is None else ffi.new("arena_surface *", [height, 1.0, 1.0])


def ring_of(x: float, y: float, radius: float, corners: int) -> Floats:
    turn = np.arange(corners) * 2 * math.pi / corners
    return np.column_stack((x + radius * np.cos(turn), y + radius * np.sin(turn)))


@st.composite
def scenes(draw: st.DrawFn) -> Shapes:
    """Some of everything; finely cut rings as well, whose corners lie close together."""
    shapes = Shapes()
    for _ in range(draw(st.integers(1, 6))):
        x, y = draw(coordinates), draw(coordinates)
        size = draw(st.sampled_from([0.02, 0.1, 0.5, 1.7]))
        height = draw(st.sampled_from([None, 0.05]))
        kind = draw(st.sampled_from(["ring", "square", "wall", "disc"]))
        if kind == "ring":
            shapes.polygon(ring_of(x, y, size, draw(st.sampled_from([3, 5, 40, 200]))), height)
        elif kind == "square":
            shapes.polygon(square(x, y, size), height)
        elif kind == "wall":
            shapes.wall([(x, y), (x + size, y), (x + size, y - 2 * size)][: draw(st.integers(2, 3))], height)
        else:
            shapes.disc(x, y, size, height)
    return shapes
