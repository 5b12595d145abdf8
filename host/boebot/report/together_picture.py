"""run.png of several robots: the arena from above, each robot's path in its own colour, and contacts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from boebot.report import picture, scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from boebot.result import TogetherResult

COLUMNS = 4  # of the legend


def write(result: TogetherResult, path: Path) -> Path:
    """Draws all robots of a run into a PNG file."""
    shown = [(number, robot, scene.view(robot)) for number, robot in enumerate(result.robots, 1) if robot.ticks]
    corners = [scene.bounds(view) for _, _, view in shown]
    low = np.min([low for low, _ in corners], axis=0)
    high = np.max([high for _, high in corners], axis=0)
    width, height = high - low
    scale = 8.0 / max(width, height)
    rows = -(-(len(shown) + 1) // COLUMNS)
    below = 0.5 + 0.24 * rows
    tall = height * scale + 0.88 + below
    figure = Figure(figsize=(max(width * scale, 6.0) + 0.4, tall), dpi=130, facecolor=picture.PAPER)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.02, below / tall, 0.96, (tall - 0.8 - below) / tall))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.axis("off")
    picture.draw_arena(axes, shown[0][2].outlines)
    for number, robot, view in shown:
        colour = scene.colour(number)
        axes.plot(view.path.x, view.path.y, color=colour, lw=1.8, alpha=0.85, zorder=5, solid_capstyle="round")
        axes.plot(view.path.x[0], view.path.y[0], "o", mfc=picture.PAPER, mec=colour, mew=1.8, ms=6, zorder=6)
        _draw_contacts(axes, view)
        picture.draw_robot(axes, robot, view, -1, colour)
        axes.annotate(
            str(number), (view.path.x[-1], view.path.y[-1]), color=picture.INK, fontsize=8, weight="bold",
            ha="center", va="center", zorder=13,
        )  # fmt: skip
    picture.draw_scale(axes, low, high)
    _draw_texts(figure, result, tall)
    figure.savefig(path, facecolor=picture.PAPER, metadata={"Title": _title(result), "Description": _caption(result)})
    return path


def _draw_contacts(axes: Axes, view: scene.View) -> None:
    if len(view.contacts):
        x, y = view.contacts.T
        axes.scatter(x, y, s=40, marker="x", color=picture.CONTACT, lw=1.6, zorder=8)


def _title(result: TogetherResult) -> str:
    first = result.robots[0]
    return f"{len(result.robots)} robots on {first.board} in {first.table()['arena']}"


def _caption(result: TogetherResult) -> str:
    contacts = sum(robot.contacts for robot in result.robots)
    parts = [
        f"{max(robot.run_time for robot in result.robots):.1f} s",
        f"{sum(robot.distance for robot in result.robots):.2f} m in all",
        picture.counted(contacts, "contact", "contacts"),
    ]
    if result.error is not None:
        parts.append("ended early")
    return "   ·   ".join(parts)


def _draw_texts(figure: Figure, result: TogetherResult, tall: float) -> None:
    figure.text(0.03, 1 - 0.32 / tall, _title(result), fontsize=15, weight="bold", color=picture.INK, va="center")
    figure.text(0.03, 1 - 0.62 / tall, _caption(result), fontsize=9.5, color=picture.FAINT, va="center")
    handles = [
        Line2D([], [], color=scene.colour(number), lw=2.2, label=f"{number}: {robot.brain}, {robot.robot.name}")
        for number, robot in enumerate(result.robots, 1)
    ]
    handles.append(Line2D([], [], ls="", marker="x", color=picture.CONTACT, mew=1.6, ms=7, label="body contact"))
    figure.legend(
        handles=handles, loc="lower center", ncols=min(COLUMNS, len(handles)), frameon=False, fontsize=8.5,
        labelcolor=picture.INK, bbox_to_anchor=(0.5, 0.06 / tall), handletextpad=0.5, columnspacing=1.6,
    )  # fmt: skip
