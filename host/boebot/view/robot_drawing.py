"""Draws a robot from above with matplotlib: its body, wheels, whiskers, and the sensors that it has."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Circle, Patch, Polygon, Rectangle, Wedge
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from boebot.view import style
from boebot.view.sensors import Look, looks, whiskers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from boebot.description.robots import RobotDescription
    from boebot.floor_plan import FloorPlan

REACH_SHOWN_M = 0.35  # the Ping reaches 3 m; a cone is drawn this far at most
LIGHT_SHOWN_M = 0.04
RIM_M = 0.012  # width of a wheel
_SHADES = {"infrared": 0.22, "sonar": 0.10, "laser": 0.06}


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
    for sensor in looks(robot):
        _draw_look(axes, sensor, colour, place, turret, seen)
    on_axes = place + axes.transData
    for root, tip in whiskers(robot).values():
        axes.plot(*zip(root, tip, strict=True), color=style.INK, lw=1.1, transform=on_axes, zorder=11)
    wheel, track = robot.body.wheel_radius_m, robot.body.track_width_m
    for side in (-1, 1):
        corner = (-wheel, side * track / 2 - RIM_M / 2)
        axes.add_patch(Rectangle(corner, 2 * wheel, RIM_M, facecolor=style.INK, transform=on_axes, zorder=11))
    look = {"facecolor": style.BODY, "edgecolor": colour, "lw": 1.8, "zorder": 10}
    axes.add_patch(body_patch(robot.body.radius_m, robot.body.outline_m, transform=on_axes, **look))
    nose = np.array([(0.9, 0.0), (0.35, 0.32), (0.35, -0.32)]) * robot.body.front_m
    axes.add_patch(Polygon(nose, closed=True, facecolor=colour, edgecolor="none", transform=on_axes, zorder=12))


def body_patch(radius: float, outline: Sequence[Sequence[float]], **look: Any) -> Patch:
    """The body in its own frame (m): its outline, or a circle where it has none."""
    return Polygon(outline, closed=True, **look) if len(outline) else Circle((0, 0), radius, **look)


def _inside(plan: FloorPlan | None) -> Path | None:
    """All floors within outlines as one path; None: nothing is cut off."""
    if plan is None or not plan.outlines:
        return None
    return Path.make_compound_path(*(Path(np.vstack((o.points, o.points[:1])), closed=True) for o in plan.outlines))


def _draw_look(axes: Axes, look: Look, colour: str, place: Affine2D, turret: float, seen: Path | None) -> None:
    on_axes = place + axes.transData
    if look.axis is not None:
        on_axes = Affine2D().rotate_around(*look.axis, turret) + on_axes
    (x, y), angle = look.position, look.heading
    if look.beam == 0.0:
        far = min(look.reach, REACH_SHOWN_M) or LIGHT_SHOWN_M
        light = look.kind == "light"
        line = axes.plot(
            (x, x + far * math.cos(angle)), (y, y + far * math.sin(angle)), color=colour, transform=on_axes,
            lw=1.6 if light else 1.0, ls="-" if light else ":", zorder=13 if light else 1.5,
        )[0]  # fmt: skip
        if light:
            axes.plot(x, y, marker="o", ms=2.6, color=colour, transform=on_axes, zorder=13)
        elif seen is not None:
            line.set_clip_path(seen, axes.transData)
        return
    half = math.degrees(look.beam) / 2
    turn = math.degrees(angle)
    cone = Wedge(
        (x, y), min(look.reach, REACH_SHOWN_M), turn - half, turn + half, facecolor=colour, edgecolor="none",
        alpha=_SHADES[look.kind], transform=on_axes, zorder=1.5,
    )  # fmt: skip
    axes.add_patch(cone)
    if seen is not None:
        cone.set_clip_path(seen, axes.transData)
