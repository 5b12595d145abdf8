"""Draws a robot from above, with the names of its sensors, and how its devices are wired: PNG or SVG."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from boebot.description.wiring import connections
from boebot.errors import printable
from boebot.view import figure_file, scene, style, wiring_drawing
from boebot.view.painter import draw_robot, frame

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from boebot.arenas.arena import Floats
    from boebot.description.robots import RobotDescription
    from boebot.devices.drawing import Item

LEFT_IN, BELOW_IN, ABOVE_IN = 0.72, 0.55, 0.6  # around the field
FIELD_IN, TALLEST_IN = 5.2, 4.2  # of the field: across, and at most upwards
NAME_IN, NAME_ROW_IN = 0.35, 0.22  # from the field to the names beside it; from name to name
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
    room = max(upwards, NAME_ROW_IN * len(scene.device_items(robot)))  # for the field and the names
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
        axes.locator_params(steps=[1, 2, 5, 10])
        axes.set_xlabel("x, forward (m)", color=style.INK, fontsize=9)
        axes.set_ylabel("y, left (m)", color=style.INK, fontsize=9)
        draw_robot(axes, robot, (0.0, 0.0, 0.0), style.END)
        _write_names(axes, robot, scale)
        if wires:
            below = figure.add_axes((0.0, 0.0, 1.0, wiring / tall))
            runs = f"pin map {robot.pin_map}" if robot.takes_brain else "for programs of your own"
            wiring_drawing.draw_wiring(below, wires, f"board {robot.board}, {runs}")
        return figure_file.save(figure, path, title)


def _bounds(robot: RobotDescription) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of the robot and of what its sensors look at, as it is drawn (m)."""
    corners = np.array([point for item in _shown(scene.robot_items(robot)) for point in item.points])
    low, high = corners.min(axis=0), corners.max(axis=0)
    edge = MARGIN * float((high - low).max())
    return low - edge, high + edge


def _shown(items: Sequence[Item]) -> list[Item]:
    """Those that do not wait for a sign or a measurement."""
    return [item for item in items if not item.when and not item.reach_by]


def _named_place(item: Item) -> tuple[float, float]:
    """Where the line to its name begins: within what a sensor sees, at the end of a wire."""
    (x, y), (end_x, end_y) = item.points[0], item.points[len(item.points) // 2]
    share = 0.85 if item.closed else 0.6
    return x + share * (end_x - x), y + share * (end_y - y)


def _write_names(axes: Axes, robot: RobotDescription, scale: float) -> None:
    """Names right of the field, one below the other, each with a line to its device; `scale`: inches per m."""
    named = []
    for name, items in scene.device_items(robot).items():
        first = _shown(items)[0]
        named.append((_named_place(first), f"{name}, {first.says}" if first.says else name))
    rows = sorted(named, key=lambda row: -row[0][1])
    step, right = NAME_ROW_IN / scale, axes.get_xlim()[1]
    x = right + NAME_IN / scale
    middle = sum(axes.get_ylim()) / 2
    for number, (place, text) in enumerate(rows):
        y = middle + ((len(rows) - 1) / 2 - number) * step
        axes.plot(
            (place[0], right + 0.3 * NAME_IN / scale, x - 0.15 * NAME_IN / scale), (place[1], y, y),
            color=style.FAINT, lw=0.7, zorder=14, clip_on=False,
        )  # fmt: skip
        axes.plot(*place, marker="o", ms=2.4, color=style.FAINT, zorder=14)
        axes.text(x, y, text, fontsize=8.5, color=style.INK, va="center")
