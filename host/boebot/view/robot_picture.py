"""Draws a robot from above, with the names of its sensors, and how its devices are wired: PNG or SVG."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from boebot.description.wiring import connections
from boebot.devices.drawing import Axis, Cone, Ray, Shape, Spot, Stroke
from boebot.errors import printable
from boebot.view import figure_file, scene, style, wiring_drawing
from boebot.view.arena_drawing import frame
from boebot.view.robot_drawing import REACH_SHOWN_M, draw_robot

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from boebot.arenas.arena import Floats
    from boebot.description.robots import RobotDescription

LEFT_IN, BELOW_IN, ABOVE_IN = 0.72, 0.55, 0.6  # around the field
FIELD_IN, TALLEST_IN = 5.2, 4.2  # of the field: across, and at most upwards
NAME_IN, NAME_ROW_IN = 0.35, 0.22  # from the field to the names beside it; from name to name
WHEEL_M = 0.012  # beyond the middle of a wheel
TITLE_COLUMNS = 62
MARGIN = 0.04  # of the greater side


def write(robot: RobotDescription, path: Path) -> Path:
    """Draws the robot's devices that are on: x forward, y left, in m; and the wiring of a robot with a board.

    Raises:
        BoebotError: the file's ending names no format of pictures, or it cannot be written.
    """
    figure_file.check(path)
    wires = [wire for wire in connections(robot) if wire.on]
    low, high = _bounds(robot)
    scale = min(FIELD_IN / (high - low)[0], TALLEST_IN / (high - low)[1])
    across, upwards = ((high - low) * scale).tolist()
    room = max(upwards, NAME_ROW_IN * len({name for name, _ in scene.shapes(robot)}))  # for the field and the names
    wiring = wiring_drawing.height(wires) if wires else 0.0
    tall = ABOVE_IN + room + BELOW_IN + wiring
    figure = Figure(figsize=(style.WIDTH_IN, tall), dpi=style.DPI, facecolor=style.PAPER)
    title = printable(f"{robot.name}: {robot.title}")
    shown = textwrap.shorten(title, TITLE_COLUMNS, placeholder="…")
    with rc_context({"text.parse_math": False, "font.family": "DejaVu Sans"}):
        figure.text(
            0.18 / style.WIDTH_IN, 1 - 0.3 / tall, shown, fontsize=14, weight="bold", color=style.INK, va="center"
        )
        place = (LEFT_IN / style.WIDTH_IN, (wiring + BELOW_IN + (room - upwards) / 2) / tall)
        axes = figure.add_axes((*place, across / style.WIDTH_IN, upwards / tall))
        axes.set_facecolor(style.FLOOR)
        frame(axes, low, high)
        axes.set_xlabel("x, forward (m)", color=style.INK, fontsize=9)
        axes.set_ylabel("y, left (m)", color=style.INK, fontsize=9)
        draw_robot(axes, robot, (0.0, 0.0, 0.0), style.END)
        _write_names(axes, robot, scale, room)
        if wires:
            below = figure.add_axes((0.0, 0.0, 1.0, wiring / tall))
            wiring_drawing.draw_wiring(below, wires, f"board {robot.board}, pin map {robot.pin_map}")
        return figure_file.save(figure, path, title)


def _bounds(robot: RobotDescription) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of the robot and of what its sensors look at, as it is drawn (m)."""
    body = robot.body
    wheel = (body.wheel_radius_m, body.track_width_m / 2 + WHEEL_M)
    points = [*(body.outline_m or [(body.radius_m, body.radius_m)]), wheel]
    points += [(-x, -y) for x, y in points] if not body.outline_m else [(-wheel[0], -wheel[1])]
    for _, shape in scene.shapes(robot):
        points += _corners(shape)
    corners = np.array(points, dtype=np.float64)
    low, high = corners.min(axis=0), corners.max(axis=0)
    edge = MARGIN * float((high - low).max())
    return low - edge, high + edge


def _corners(shape: Shape) -> list[tuple[float, float]]:
    match shape:
        case Cone():
            half = shape.opening / 2
            turns = np.linspace(shape.heading - half, shape.heading + half, 9).tolist()
            return [_away(shape.position, turn, shape.reach) for turn in turns]
        case Ray():
            return [_away(shape.position, shape.heading, shape.reach)]
        case Stroke():
            return [shape.begin, shape.end]
        case Spot() | Axis():
            return [shape.position]


def _away(start: tuple[float, float], heading: float, reach: float, share: float = 1.0) -> tuple[float, float]:
    """A point that far from there, as far as a reach is drawn (m, rad)."""
    shown = share * min(reach, REACH_SHOWN_M)
    return start[0] + shown * math.cos(heading), start[1] + shown * math.sin(heading)


def _named_place(shape: Shape) -> tuple[float, float]:
    """Where the line to a shape's name begins."""
    match shape:
        case Cone():
            return _away(shape.position, shape.heading, shape.reach, 0.85)
        case Ray():
            return _away(shape.position, shape.heading, shape.reach, 0.6)
        case Stroke():
            return shape.end
        case Spot() | Axis():
            return shape.position


def _write_names(axes: Axes, robot: RobotDescription, scale: float, room: float) -> None:
    """Names right of the field, each with a line to its device, about as high as that; `scale`: inches per m; `room`:
    for the names, inches."""
    named: dict[str, tuple[tuple[float, float], str]] = {}
    for name, shape in scene.shapes(robot):
        reach = shape.reach if isinstance(shape, Cone | Ray) else 0.0
        named.setdefault(name, (_named_place(shape), f"{name}, up to {reach:g} m" if reach else name))
    rows = sorted(named.values(), key=lambda row: -row[0][1])
    step, right = NAME_ROW_IN / scale, axes.get_xlim()[1]
    x = right + NAME_IN / scale
    wanted = [place[1] for place, _ in rows]
    heights: list[float] = []
    for y in wanted:
        heights.append(min(y, heights[-1] - step) if heights else y)
    shift = 0.0
    if rows:
        low, high = axes.get_ylim()
        edge = (low + high) / 2 + room / scale / 2 - step / 2
        shift = sum(wanted) / len(wanted) - sum(heights) / len(heights)
        shift = max(low + high - edge - heights[-1], min(edge - heights[0], shift))
    for (place, text), apart in zip(rows, heights, strict=True):
        y = apart + shift
        axes.plot(
            (place[0], right + 0.3 * NAME_IN / scale, x - 0.15 * NAME_IN / scale), (place[1], y, y),
            color=style.FAINT, lw=0.7, zorder=14, clip_on=False,
        )  # fmt: skip
        axes.plot(*place, marker="o", ms=2.4, color=style.FAINT, zorder=14)
        axes.text(x, y, text, fontsize=8.5, color=style.INK, va="center")
