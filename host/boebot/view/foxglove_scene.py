"""Arena and robot as entities of Foxglove's 3D panel: what stands there, with its edges and upright sides (m, rad)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from boebot.devices.drawing import Stroke
from boebot.showing import UNKNOWN
from boebot.view import scene, sketch_drawing, style

if TYPE_CHECKING:
    from boebot.arenas.arena import Floats
    from boebot.arenas.floor_plan import FloorPlan, Solid
    from boebot.description.robots import RobotDescription
    from boebot.showing import Sketch

HIGH_M = 0.2  # what has no height is drawn this high
BODY_M = 0.08  # height of a robot's body, as drawn: descriptions do not say it
PAINT_M = 0.001  # above the floor
LAMP_M = 0.04
RIM_M = 0.012  # width of a wheel
CROSS_M = 0.01  # half the arm of a cross at a point that a brain sketches
EDGE_PX = 2.0
CORNERS = 48  # of a circle's edge


def arena(plan: FloorPlan, frame: str) -> SceneEntity:
    """What stays in its place."""
    entity = SceneEntity(id="arena", frame_id=frame, frame_locked=True)
    for patch in plan.patches:
        _add_edge(entity, patch.corners, PAINT_M, style.ROUGH if patch.grip > plan.grip else style.SMOOTH)
    for line in plan.lines:
        colour = style.PAINT_DARK if line.is_dark else style.GRID
        _add_edge(entity, line.points, PAINT_M, colour, is_closed=False, width_m=line.width)
    if (charger := plan.charger) is not None:
        _add_edge(entity, _circle(np.array((charger.x_m, charger.y_m)), charger.radius_m), PAINT_M, style.CHARGER)
    for lamp in plan.lamps:
        place = pose(lamp.x_m, lamp.y_m, 0.0, height=lamp.height_m)
        entity.spheres.add(pose=place, size=Vector3(x=LAMP_M, y=LAMP_M, z=LAMP_M), color=_colour(style.LAMP))
    for solid in plan.solids:
        _add_solid(entity, solid, style.DULL if solid.is_dull else style.SOLID)
    return entity


def mover(solid: Solid, frame: str) -> SceneEntity:
    """A moving shape, in its own frame."""
    entity = SceneEntity(id=frame, frame_id=frame, frame_locked=True)
    _add_solid(entity, solid, style.MOVING)
    return entity


def robot(description: RobotDescription, frame: str, colour: str) -> SceneEntity:
    """Body, wheels, whiskers and where the front is, in the robot's frame."""
    body = description.body
    entity = SceneEntity(id=frame, frame_id=frame, frame_locked=True)
    outline = _outline(description)
    if body.outline_m:
        _add_sides(entity, outline, BODY_M, style.BODY, is_closed=True)
    else:
        size = Vector3(x=2 * body.radius_m, y=2 * body.radius_m, z=BODY_M)
        place = pose(0.0, 0.0, 0.0, height=BODY_M / 2)
        entity.cylinders.add(pose=place, size=size, bottom_scale=1.0, top_scale=1.0, color=_colour(style.BODY))
    _add_edge(entity, outline, BODY_M, colour)
    nose = np.array([(0.9, 0.0), (0.35, 0.32), (0.35, -0.32)]) * body.front_m
    entity.triangles.add(pose=pose(0.0, 0.0, 0.0), points=_points(nose, BODY_M + PAINT_M), color=_colour(colour))
    for side in (-1, 1):
        place = pose(0.0, side * body.track_width_m / 2, 0.0, height=body.wheel_radius_m)
        size = Vector3(x=2 * body.wheel_radius_m, y=RIM_M, z=2 * body.wheel_radius_m)
        entity.cubes.add(pose=place, size=size, color=_colour(style.INK))
    for _, shape in scene.shapes(description):
        if isinstance(shape, Stroke):
            _add_edge(entity, np.array((shape.begin, shape.end)), BODY_M / 2, style.INK, is_closed=False)
    return entity


def ghost(description: RobotDescription, frame: str) -> SceneEntity:
    """Where the odometry thinks that the robot is: its edge."""
    entity = SceneEntity(id=frame, frame_id=frame, frame_locked=True)
    _add_edge(entity, _outline(description), BODY_M / 2, style.ESTIMATE)
    return entity


def sketch(drawn: Sketch, entity_id: str, frame: str, colour: str) -> SceneEntity:
    """What a layer of a brain's sketches shows; cells of a grid as squares on the floor, free ones none."""
    entity = SceneEntity(id=entity_id, frame_id=frame, frame_locked=True)
    for line in drawn.lines:
        _add_edge(entity, sketch_drawing.pairs(line), PAINT_M, colour, is_closed=False)
    if drawn.points:
        points = sketch_drawing.pairs(drawn.points)
        arms = np.array(((-CROSS_M, 0.0), (CROSS_M, 0.0), (0.0, -CROSS_M), (0.0, CROSS_M)))
        crosses = (points[:, None] + arms).reshape(-1, 2)
        _add_edge(entity, crosses, PAINT_M, colour, kind=LinePrimitive.LINE_LIST)
    if (grid := drawn.grid) is not None:
        cells = np.frombuffer(grid.cells, dtype=np.uint8).reshape(grid.rows, grid.columns)
        row, column = np.nonzero((cells > 0) & (cells != UNKNOWN))
        corner = np.column_stack((column, row))
        squares = (corner[:, None] + np.array(((0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)))).reshape(-1, 2)
        opacity = np.repeat(sketch_drawing.rgba(grid, colour)[row, column, 3], 6)
        entity.triangles.add(
            pose=pose(grid.x, grid.y, 0.0),
            points=_points(squares * grid.cell, 0.0),
            colors=[_colour(colour, alpha) for alpha in opacity.tolist()],
        )
    return entity


def pose(x: float, y: float, heading: float, *, height: float = 0.0) -> Pose:
    """A pose on the floor, or so far above it."""
    return Pose(position=Vector3(x=x, y=y, z=height), orientation=rotation(heading))


def rotation(heading: float) -> Quaternion:
    """About the upright axis."""
    return Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))


def _outline(description: RobotDescription) -> Floats:
    body = description.body
    return np.array(body.outline_m) if body.outline_m else _circle(np.zeros(2), body.radius_m)


def _add_solid(entity: SceneEntity, solid: Solid, colour: str) -> None:
    height = solid.height if math.isfinite(solid.height) else HIGH_M
    if solid.kind == "disc":
        (x, y), size = solid.points[0].tolist(), Vector3(x=2 * solid.radius, y=2 * solid.radius, z=height)
        place = pose(x, y, 0.0, height=height / 2)
        entity.cylinders.add(pose=place, size=size, bottom_scale=1.0, top_scale=1.0, color=_colour(colour))
        return
    is_closed = solid.kind != "wall"
    _add_sides(entity, solid.points, height, colour, is_closed=is_closed)
    for level in (0.0, height):
        _add_edge(entity, solid.points, level, style.EDGE, is_closed=is_closed)


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
    is_closed: bool = True,
    width_m: float = 0.0,
    kind: Any = None,
) -> None:
    """A line of that width; 0: as thin everywhere on the screen. `kind`: one of LinePrimitive's; None: a line."""
    entity.lines.add(
        type=kind or (LinePrimitive.LINE_LOOP if is_closed else LinePrimitive.LINE_STRIP),
        pose=pose(0.0, 0.0, 0.0),
        thickness=width_m or EDGE_PX,
        scale_invariant=not width_m,
        points=_points(corners, height),
        color=_colour(colour),
    )


def _points(corners: Floats, height: float) -> list[Point3]:
    return [Point3(x=x, y=y, z=height) for x, y in corners.tolist()]


def _circle(centre: Floats, radius: float) -> Floats:
    angles = np.linspace(0, 2 * np.pi, CORNERS, endpoint=False)
    return np.asarray(centre + radius * np.column_stack((np.cos(angles), np.sin(angles))), dtype=np.float64)


def _colour(name: str, opacity: float = 1.0) -> Color:
    red, green, blue = (int(name[begin : begin + 2], 16) / 255 for begin in (1, 3, 5))
    return Color(r=red, g=green, b=blue, a=opacity)
