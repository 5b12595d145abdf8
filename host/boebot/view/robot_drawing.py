"""Draws a robot from above with matplotlib: its body, wheels, whiskers, and the sensors that it has."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Circle, Patch, Polygon, Rectangle, Wedge
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from boebot.devices.drawing import Axis, Cone, Ray, Shape, Spot, Stroke
from boebot.view import scene, style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform

    from boebot.arenas.floor_plan import FloorPlan
    from boebot.description.robots import RobotDescription
    from boebot.view.scene import Swept

REACH_SHOWN_M = 0.35  # the Ping reaches 3 m; a cone is drawn this far at most
SPOT_SHOWN_M = 0.04
SWEPT_SHADE, SWEPT_EDGE = 0.10, 0.45  # opacity of the area of a sweep, and of its outline
RIM_M = 0.012  # width of a wheel


def draw_robot(
    axes: Axes,
    robot: RobotDescription,
    pose: tuple[float, float, float],
    colour: str,
    *,
    plan: FloorPlan | None = None,
    turret: float = 0.0,
) -> None:
    """The robot at a pose (m, m, rad), its turret at an angle (rad); the plan's outline cuts off what its sensors see,
    and obstacles cover it."""
    x, y, heading = pose
    place = Affine2D().rotate(heading).translate(x, y)
    seen = _inside(plan)
    shapes = [shape for _, shape in scene.shapes(robot)]
    turning = Affine2D()
    for shape in shapes:
        if isinstance(shape, Axis):
            turning = Affine2D().rotate_around(*shape.position, turret)
    on_axes = place + axes.transData
    for shape in shapes:
        turns = isinstance(shape, Cone) and shape.turns
        _draw_shape(axes, shape, colour, turning + on_axes if turns else on_axes, seen)
    wheel, track = robot.body.wheel_radius_m, robot.body.track_width_m
    for side in (-1, 1):
        corner = (-wheel, side * track / 2 - RIM_M / 2)
        axes.add_patch(Rectangle(corner, 2 * wheel, RIM_M, facecolor=style.INK, transform=on_axes, zorder=11))
    look = {"facecolor": style.BODY, "edgecolor": colour, "lw": 1.8, "zorder": 10}
    axes.add_patch(body_patch(robot.body.radius_m, robot.body.outline_m, transform=on_axes, **look))
    nose = np.array([(0.9, 0.0), (0.35, 0.32), (0.35, -0.32)]) * robot.body.front_m
    axes.add_patch(Polygon(nose, closed=True, facecolor=colour, edgecolor="none", transform=on_axes, zorder=12))


def draw_swept(axes: Axes, swept: Sequence[Swept], index: int, colour: str) -> None:
    """The area that the sweep of that index covers, of each such sensor of a robot."""
    for one in swept:
        if len(one.time):
            area = one.area(index)
            axes.add_patch(Polygon(area, facecolor=colour, edgecolor="none", alpha=SWEPT_SHADE, zorder=1.4))
            axes.add_patch(Polygon(area, facecolor="none", edgecolor=colour, alpha=SWEPT_EDGE, lw=0.7, zorder=1.6))


def body_patch(radius: float, outline: Sequence[Sequence[float]], **look: Any) -> Patch:
    """The body in its own frame (m): its outline, or a circle where it has none."""
    return Polygon(outline, closed=True, **look) if len(outline) else Circle((0, 0), radius, **look)


def _inside(plan: FloorPlan | None) -> Path | None:
    """All floors within outlines as one path; None: nothing is cut off."""
    if plan is None or not plan.outlines:
        return None
    return Path.make_compound_path(*(Path(np.vstack((o.points, o.points[:1])), closed=True) for o in plan.outlines))


def _draw_shape(axes: Axes, shape: Shape, colour: str, on_axes: Transform, seen: Path | None) -> None:
    sight: Artist | None = None
    match shape:
        case Cone():
            middle, half = math.degrees(shape.heading), math.degrees(shape.opening) / 2
            sight = axes.add_patch(
                Wedge(
                    shape.position, min(shape.reach, REACH_SHOWN_M), middle - half, middle + half, facecolor=colour,
                    edgecolor="none", alpha=shape.shade, transform=on_axes, zorder=1.5,
                )
            )  # fmt: skip
        case Ray():
            line = _from(shape.position, shape.heading, min(shape.reach, REACH_SHOWN_M))
            sight = axes.plot(*line, color=colour, transform=on_axes, lw=1.0, ls=":", zorder=1.5)[0]
        case Spot():
            axes.plot(*shape.position, marker="o", ms=2.6, color=colour, transform=on_axes, zorder=13)
            if shape.heading is not None:
                line = _from(shape.position, shape.heading, SPOT_SHOWN_M)
                axes.plot(*line, color=colour, transform=on_axes, lw=1.6, zorder=13)
        case Stroke():
            line = tuple(zip(shape.begin, shape.end, strict=True))
            axes.plot(*line, color=style.INK, lw=1.1, transform=on_axes, zorder=11)
    if sight is not None and seen is not None:
        sight.set_clip_path(seen, axes.transData)


def _from(start: tuple[float, float], heading: float, length: float) -> tuple[tuple[float, ...], ...]:
    """A line from there in that direction: both x, both y."""
    (x, y), far = start, length
    return (x, x + far * math.cos(heading)), (y, y + far * math.sin(heading))
