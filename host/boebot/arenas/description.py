"""What an arena file says: its keys with their units and limits, and what a description has to keep beyond its types.

The JSON schema for editors and the tables in docs/reference/arenas.md are made from these types (tools/arena_pages.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from boebot.arenas.compiled import ffi, lib

Point = tuple[float, float]

EXTENT_M = 1000.0  # nothing lies farther from the origin
EDGES_MAXIMUM = 200_000  # of all shapes together

Position = Annotated[float, Meta(ge=-EXTENT_M, le=EXTENT_M)]
Length = Annotated[float, Meta(gt=0, le=EXTENT_M)]
Angle = Annotated[float, Meta(ge=-10_000, le=10_000)]
Height = Annotated[
    float,
    Meta(gt=0, description="top above the floor; sensors that sit higher do not see it (default: as high as any)"),
]
Infrared = Annotated[float, Meta(ge=0, le=1, description="share of infrared light thrown back; 1: a white wall")]
FloorReflectance = Annotated[float, Meta(ge=0, le=1, description="share of infrared light that the floor throws back")]
Sound = Annotated[float, Meta(ge=0, le=1, description="share of sound thrown back; 1: a hard wall, less: cloth")]
Name = Annotated[str, Meta(description="for people")]
ShapeName = Annotated[str, Meta(description="for people; no two shapes have the same")]
Corners = Annotated[
    list[tuple[Position, Position]], Meta(min_length=3, description="x, y of each corner; the last one joins the first")
]
Bends = Annotated[
    list[tuple[Position, Position]], Meta(min_length=2, description="x, y of its ends and of the bends between them")
]


class Start(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Where a robot starts."""

    x_m: Annotated[Position, Meta(description="to the right")] = 0.0
    y_m: Annotated[Position, Meta(description="up")] = 0.0
    heading_rad: Annotated[Angle, Meta(description="0: along x, counter-clockwise")] = 0.0


class Shape(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """What outlines, obstacles, walls, discs and moving shapes are made of; in code these keys are named."""

    height_m: Height | None = None
    infrared_reflectance: Infrared = 1.0
    sound_reflectance: Sound = 1.0


class Polygon(Shape, frozen=True):
    """A closed polygon: as an outline, the robot is inside it; as an obstacle, outside."""

    corners_m: Corners
    name: ShapeName = ""


class Wall(Shape, frozen=True):
    """A thin wall, seen and felt from both sides."""

    points_m: Bends
    name: ShapeName = ""


class Disc(Shape, frozen=True):
    """A round obstacle."""

    x_m: Annotated[Position, Meta(description="centre")]
    y_m: Annotated[Position, Meta(description="centre")]
    radius_m: Length
    name: ShapeName = ""


class Patch(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A part of the floor with another friction; later ones lie on top of earlier ones."""

    corners_m: Corners
    grip: Annotated[float, Meta(ge=0, le=10, description="friction coefficient between wheels and floor")]
    name: Name = ""


class Line(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A line that is painted or taped on the floor; later ones lie on top of earlier ones."""

    points_m: Bends
    width_m: Length = 0.019
    floor_reflectance: FloorReflectance = 0.05
    name: Name = ""


class Light(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A lamp. Shapes that are higher than the line from lamp to sensor shade it."""

    x_m: Position
    y_m: Position
    power_w: Annotated[float, Meta(ge=0, le=100_000, description="radiated, evenly in all directions")]
    height_m: Annotated[float, Meta(ge=0, le=EXTENT_M, description="above the floor")] = 0.1
    name: Name = ""


class Charger(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A charging station: a disc on the floor; a robot is charged while its centre is on it."""

    x_m: Annotated[Position, Meta(description="centre")]
    y_m: Annotated[Position, Meta(description="centre")]
    radius_m: Length


class Waypoint(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Where a moving shape is at a time; between waypoints it goes straight and evenly."""

    time_s: Annotated[float, Meta(ge=0, le=1e6, description="since the start; 0 for the first waypoint")]
    x_m: Position
    y_m: Position
    heading_rad: Annotated[Angle, Meta(description="not wrapped: from 0 to 12.566 is two turns")] = 0.0


class Moving(Shape, frozen=True):
    """A shape on its way: a polygon with corners in its own frame, or a disc."""

    path: Annotated[list[Waypoint], Meta(min_length=1)]
    corners_m: Corners | None = None
    radius_m: Length | None = None
    repeat: Annotated[
        Literal["loop", "back_and_forth", "once"],
        Meta(description="after the last waypoint: again from the first (which it has to equal), back, or stay"),
    ] = "back_and_forth"
    name: ShapeName = ""


class ArenaDescription(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """An arena. Lengths in m, angles in rad, x to the right, y up."""

    name: str
    title: Annotated[str, Meta(description="one line for people")] = ""
    start: Start = Start()
    outline: list[Polygon] = []
    obstacle: list[Polygon] = []
    wall: list[Wall] = []
    disc: list[Disc] = []
    patch: list[Patch] = []
    floor_reflectance: FloorReflectance = 0.8
    line: list[Line] = []
    light: list[Light] = []
    charger: Charger | None = None
    moving: list[Moving] = []


class DescriptionError(Exception):
    """Something that a description must not say.

    Attributes:
        place: of the key, such as "outline[0].corners_m[2]".
        what: the rest of the sentence.
    """

    def __init__(self, place: str, what: str) -> None:
        super().__init__(f"{place}{what}")
        self.place, self.what = place, what


def check(description: ArenaDescription) -> None:
    """Raises DescriptionError at the first thing beyond types: number of edges, simple polygons, time, names."""
    rows = list(_rows(description))
    edges = sum(len(points) for _, points, _ in rows)
    if edges > EDGES_MAXIMUM:
        largest = max(rows, key=lambda row: len(row[1]))[0]
        raise DescriptionError(largest, f": the arena has {edges:,} edges; expected at most {EDGES_MAXIMUM:,}")
    for place, points, closed in rows:
        _check_row(points, place, closed)
    for i, moving in enumerate(description.moving):
        _check_moving(moving, f"moving[{i}]")
    _check_names(description)


def _rows(description: ArenaDescription) -> Iterator[tuple[str, list[Point], bool]]:
    """All polygons and walls: their places, points, and whether they are closed."""
    for key, shapes in (("outline", description.outline), ("obstacle", description.obstacle)):
        yield from ((f"{key}[{i}].corners_m", shape.corners_m, True) for i, shape in enumerate(shapes))
    yield from ((f"patch[{i}].corners_m", patch.corners_m, True) for i, patch in enumerate(description.patch))
    yield from ((f"line[{i}].points_m", line.points_m, False) for i, line in enumerate(description.line))
    yield from ((f"wall[{i}].points_m", wall.points_m, False) for i, wall in enumerate(description.wall))
    for i, moving in enumerate(description.moving):
        if moving.corners_m is not None:
            yield f"moving[{i}].corners_m", moving.corners_m, True


def _check_row(points: list[Point], place: str, closed: bool) -> None:
    """Refuses neighbours that coincide, and what is closed and no simple polygon."""
    xy = ffi.from_buffer("double[]", np.array(points, dtype=np.float64))
    same = lib.arena_repeated(xy, len(points), closed)
    if same >= 0:
        raise DescriptionError(f"{place}[{same}]", " and the point after it are the same; expected an edge")
    if closed and (fault := crossing(points)):
        raise DescriptionError(place, fault)


def crossing(corners: Sequence[Point]) -> str:
    """Which edges of a closed polygon cross or touch, as the words behind its key; "": none."""
    xy = ffi.from_buffer("double[]", np.array(corners, dtype=np.float64))
    one, other = ffi.new("uint32_t *"), ffi.new("uint32_t *")
    found = lib.arena_crossing(xy, len(corners), one, other)
    if found < 0:
        raise MemoryError("polygon")
    return f": edges {one[0]} and {other[0]} cross or touch; expected a polygon whose edges do not" if found else ""


def _check_moving(moving: Moving, place: str) -> None:
    if (moving.corners_m is None) == (moving.radius_m is None):
        raise DescriptionError(place, ": expected either corners_m or radius_m")
    times = [point.time_s for point in moving.path]
    if times[0] != 0:
        raise DescriptionError(f"{place}.path[0].time_s", f" is {times[0]:g}; expected 0 for the first waypoint")
    for i in range(1, len(times)):
        if not times[i] - times[i - 1] >= lib.ARENA_WAYPOINTS_US * 1e-6:
            what = f" is {times[i]:g}; expected more than {times[i - 1]:g}, by a microsecond or more"
            raise DescriptionError(f"{place}.path[{i}].time_s", what)
    radius = moving.radius_m or max(math.hypot(*corner) for corner in moving.corners_m or [])
    path = [(point.time_s, point.x_m, point.y_m, point.heading_rad) for point in moving.path]
    speed = lib.arena_path_speed(ffi.new("path_waypoint[]", path), len(path), radius)
    if speed > lib.ARENA_FASTEST_M_S:
        what = f": some of it moves at {speed:.4g} m/s; expected at most {lib.ARENA_FASTEST_M_S} m/s"
        raise DescriptionError(f"{place}.path", what)
    first, last = moving.path[0], moving.path[-1]
    turns = (last.heading_rad - first.heading_rad) / (2 * math.pi)
    gap = math.dist((first.x_m, first.y_m), (last.x_m, last.y_m))
    if moving.repeat == "loop" and (gap > 1e-6 or abs(turns - round(turns)) > 1e-4):
        raise DescriptionError(
            f"{place}.path[{len(times) - 1}]", ": expected the first waypoint again, as the path is a loop"
        )


def _check_names(description: ArenaDescription) -> None:
    """Shapes that have a name have each their own."""
    owners: dict[str, str] = {}
    for key in ("outline", "obstacle", "wall", "disc", "moving"):
        for i, shape in enumerate(getattr(description, key)):
            place = f"{key}[{i}]"
            if shape.name and (owner := owners.setdefault(shape.name, place)) != place:
                raise DescriptionError(
                    f"{place}.name", f" is {shape.name!r}, as that of {owner}; expected another name, or none"
                )
