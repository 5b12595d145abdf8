"""Draws an arena with its start, and its moving shapes at the start and along their way: PNG or SVG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from boebot.arenas.floor_plan import floor_plan, path_end
from boebot.errors import printable
from boebot.view import figure_file, style
from boebot.view.painter import draw_arena, frame
from boebot.view.scene import plan_bounds

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from boebot.arenas.arena import Arena

ROBOT_RADIUS_M = 0.07
LONGER_IN = 5.0  # longer side of the field


def write(arena: Arena, path: Path) -> Path:
    """Writes a picture of the arena.

    Raises:
        BoebotError: the file's ending names no format of pictures, or it cannot be written.
    """
    figure_file.check(path)
    plan = floor_plan(arena, 0.0, path_end(arena))
    low, high = plan_bounds(plan, [arena.start[:2]])
    width, height = LONGER_IN * (high - low) / float((high - low).max())
    figure = Figure(figsize=(width + 0.9, height + 0.9), dpi=style.DPI, layout="constrained")
    axes = figure.subplots()
    axes.set_facecolor(style.PAPER)
    draw_arena(axes, plan)
    _draw_start(axes, arena)
    frame(axes, low, high)
    title = printable(f"{arena.name}: {arena.description.title}" if arena.description.title else arena.name)
    axes.set_title(title, fontsize=12, color=style.INK, parse_math=False)
    return figure_file.save(figure, path, title)


def _draw_start(axes: Axes, arena: Arena) -> None:
    x, y, heading = arena.start
    axes.add_patch(Circle((x, y), ROBOT_RADIUS_M, facecolor=style.END, edgecolor=style.EDGE, lw=1.0, zorder=6))
    nose = 2.2 * ROBOT_RADIUS_M
    axes.arrow(x, y, nose * np.cos(heading), nose * np.sin(heading), head_width=0.06, color=style.END, zorder=6)
