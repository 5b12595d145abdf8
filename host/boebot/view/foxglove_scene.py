"""Paints display lists as entities of Foxglove's 3D panel, with edges and upright sides (m, rad)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from boebot.devices.drawing import SIGHTS
from boebot.view import style

if TYPE_CHECKING:
    from collections.abc import Iterable

    from boebot.arenas.arena import Floats
    from boebot.devices.drawing import Item

PAINT_M = 0.001  # above the floor
EDGE_PX = 2.0


def items(display_list: Iterable[Item], name: str, frame: str, robot: str = style.END) -> SceneEntity:
    """A display list in its frame, without signs and measurements; `robot`: colour of that. What has a height gets
    upright sides; what sensors see and texts are left out."""
    entity = SceneEntity(id=name, frame_id=frame, frame_locked=True)
    for item in display_list:
        if item.when or item.text or item.layer == SIGHTS:
            continue
        corners = np.array(item.points)
        if item.height:
            colour = style.paint(item.fill or "solid", robot)
            _add_sides(entity, corners, item.height, colour, is_closed=item.closed)
        ink = style.paint(item.ink or item.fill, robot)
        for level in (0.0, item.height) if item.height else (PAINT_M,):
            _add_edge(entity, corners, level, ink, is_closed=item.closed, width_m=item.wide_m)
    return entity


def pose(x: float, y: float, heading: float, *, height: float = 0.0) -> Pose:
    """A pose on the floor, or so far above it."""
    return Pose(position=Vector3(x=x, y=y, z=height), orientation=rotation(heading))


def rotation(heading: float) -> Quaternion:
    """About the upright axis."""
    return Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))


def _add_sides(entity: SceneEntity, corners: Floats, height: float, colour: str, *, is_closed: bool) -> None:
    """Upright sides over a line of corners: two triangles for each."""
    count = len(corners)
    sides = [(a, (a + 1) % count) for a in range(count if is_closed else count - 1)]
    # corners on the floor first, then those above them
    indices = [index for a, b in sides for index in (a, b, b + count, a, b + count, a + count)]
    points = [*_points(corners, 0.0), *_points(corners, height)]
    entity.triangles.add(pose=pose(0.0, 0.0, 0.0), points=points, indices=indices, color=_colour(colour, 0.6))


def _add_edge(
    entity: SceneEntity,
    corners: Floats,
    height: float,
    colour: str,
    *,
    is_closed: bool,
    width_m: float,
) -> None:
    """A line of that width; 0: as thin everywhere on the screen."""
    entity.lines.add(
        type=LinePrimitive.LINE_LOOP if is_closed else LinePrimitive.LINE_STRIP,
        pose=pose(0.0, 0.0, 0.0),
        thickness=width_m or EDGE_PX,
        scale_invariant=not width_m,
        points=_points(corners, height),
        color=_colour(colour),
    )


def _points(corners: Floats, height: float) -> list[Point3]:
    return [Point3(x=x, y=y, z=height) for x, y in corners.tolist()]


def _colour(name: str, opacity: float = 1.0) -> Color:
    red, green, blue = (int(name[begin : begin + 2], 16) / 255 for begin in (1, 3, 5))
    return Color(r=red, g=green, b=blue, a=opacity)
