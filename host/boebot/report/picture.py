"""run.png: the run seen from above. Arena, true path, odometric estimate, contacts, start and end with sensor cones."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon, Rectangle, Wedge
from matplotlib.transforms import Affine2D

from boebot import robots, vehicle_devices
from boebot.report import scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from boebot.result import RunResult
    from boebot.series import Floats, Pose

PAPER = "#fbfaf7"
WALL = "#3b4252"
FLOOR = "#ffffff"
INK = "#2e3440"
FAINT = "#8a8f9c"
ESTIMATE = "#d08770"
CONTACT = "#bf3f4a"
START, END = "#4c9a6a", "#3f6fb5"
BODY = "#e5e9f0"
PATH_COLOURS = "viridis"
CONE_SHOWN_M = 0.35  # the Ping reaches 3 m; a cone is drawn this far at most


def write(result: RunResult, path: Path) -> Path:
    """Draws the run into a PNG file."""
    view = scene.view(result)
    low, high = scene.bounds(view)
    width, height = high - low
    scale = 8.0 / max(width, height)
    figure = Figure(figsize=(max(width * scale, 4.5) + 0.4, height * scale + 1.6), dpi=130, facecolor=PAPER)
    FigureCanvasAgg(figure)
    total = figure.get_figheight()
    axes = figure.add_axes((0.02, 0.72 / total, 0.96, (total - 1.52) / total))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.axis("off")

    draw_arena(axes, view.outlines)
    _draw_path(axes, view.path, result.series.time)
    if view.estimate is not None:
        axes.plot(view.estimate.x, view.estimate.y, color=ESTIMATE, lw=1.1, ls=(0, (4, 2)), zorder=4)
        _draw_ghost(axes, result.robot.body.radius_m, view.estimate)
    _draw_contacts(axes, view)
    draw_robot(axes, result, view, 0, START)
    draw_robot(axes, result, view, -1, END)
    draw_scale(axes, low, high)
    _draw_texts(figure, result, view, total)
    figure.savefig(path, facecolor=PAPER, metadata={"Title": _title(result, view), "Description": _caption(result)})
    return path


def draw_arena(axes: Axes, outlines: list[Floats]) -> None:
    for index, outline in enumerate(outlines):
        if index == 0:  # the outer wall, around the floor
            axes.add_patch(Polygon(outline, closed=True, facecolor=FLOOR, edgecolor=WALL, lw=3.0, zorder=1))
        else:
            axes.add_patch(Polygon(outline, closed=True, facecolor="#c9ced9", edgecolor=WALL, lw=1.6, zorder=2))


def _draw_path(axes: Axes, path: Pose, time: Floats) -> None:
    """The path, its colour running with time."""
    points = np.column_stack((path.x, path.y))
    thin = max(1, len(points) // 6000)
    points, time = points[::thin], time[::thin]
    if len(points) < 2:
        return
    segments = np.stack((points[:-1], points[1:]), axis=1)
    lines = LineCollection(list(segments), array=time[:-1], cmap=PATH_COLOURS, lw=2.0, zorder=5)
    lines.set_capstyle("round")
    axes.add_collection(lines)


def _draw_ghost(axes: Axes, radius: float, estimate: Pose) -> None:
    """The odometric ghost: the robot where it believes to be at the end."""
    x, y, heading = float(estimate.x[-1]), float(estimate.y[-1]), float(estimate.heading[-1])
    axes.add_patch(Circle((x, y), radius, facecolor="none", edgecolor=ESTIMATE, lw=1.1, ls=(0, (3, 2)), zorder=6))
    nose = (x + radius * math.cos(heading), y + radius * math.sin(heading))
    axes.plot((x, nose[0]), (y, nose[1]), color=ESTIMATE, lw=1.1, zorder=6)


def _draw_contacts(axes: Axes, view: scene.View) -> None:
    if len(view.touches):
        x, y = view.touches.T
        axes.scatter(x, y, s=26, marker="o", facecolor="none", edgecolor="#c98a2b", lw=1.2, zorder=7)
    if len(view.contacts):
        x, y = view.contacts.T
        axes.scatter(x, y, s=46, marker="x", color=CONTACT, lw=1.8, zorder=8)


def draw_robot(axes: Axes, result: RunResult, view: scene.View, index: int, colour: str) -> None:
    """The robot with its wheels, whiskers and sensor cones; walls cut the cones off."""
    robot, path = result.robot, view.path
    floor = Polygon(view.outlines[0], closed=True).get_path() if view.outlines else None
    place = (
        Affine2D().rotate(float(path.heading[index])).translate(float(path.x[index]), float(path.y[index]))
        + axes.transData
    )
    body = robot.body
    wheel = body.wheel_radius_m
    for device in robot.device.values():
        if not device.on:
            continue
        if isinstance(device, scene.RANGING):
            reach = min(scene.reach(device), CONE_SHOWN_M)
            turn = math.degrees(device.heading_rad)
            half = math.degrees(device.beam_rad) / 2
            alpha = 0.16 if isinstance(device, scene.SEEING) else 0.07
            cone = Wedge(
                device.position_m, reach, turn - half, turn + half,
                facecolor=colour, edgecolor="none", alpha=alpha, transform=place, zorder=3,
            )  # fmt: skip
            axes.add_patch(cone)
            if floor is not None:
                cone.set_clip_path(floor, axes.transData)
        elif isinstance(device, robots.Whisker | vehicle_devices.TouchWhisker):
            (x0, y0), (x1, y1) = device.root_m, device.tip_m
            axes.plot((x0, x1), (y0, y1), color=INK, lw=1.0, transform=place, zorder=11, solid_capstyle="round")
    for side in (-1, 1):
        corner = (-wheel, side * body.track_width_m / 2 - 0.006)
        axes.add_patch(Rectangle(corner, 2 * wheel, 0.012, facecolor=INK, transform=place, zorder=11))
    axes.add_patch(
        Circle(
            (0, 0),
            body.radius_m,
            facecolor=BODY,
            edgecolor=colour,
            lw=1.8,
            alpha=0.92,
            transform=place,
            zorder=10,
        )
    )
    nose = np.array([(0.9, 0.0), (0.35, 0.32), (0.35, -0.32)]) * body.radius_m
    axes.add_patch(Polygon(nose, closed=True, facecolor=colour, edgecolor="none", transform=place, zorder=12))


def draw_scale(axes: Axes, low: Floats, high: Floats) -> None:
    """A scale bar below the arena, a quarter of its width or so."""
    wanted = (high[0] - low[0]) / 4
    length = max(size for size in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if size <= max(wanted, 0.1))
    x, y = low[0] + scene.margin(low, high), low[1] - 0.018 * (high[1] - low[1])
    axes.plot((x, x + length), (y, y), color=INK, lw=2.5, solid_capstyle="butt", clip_on=False)
    axes.text(x + length, y, f"  {length:g} m", va="center", fontsize=8.5, color=INK)


def _title(result: RunResult, view: scene.View) -> str:
    where = f" in {result.table()['arena']}" if view.known else ""
    return f"{result.brain} on {result.board}{where}"


def _caption(result: RunResult) -> str:
    error = result.table()["odometry_error_m"]
    parts = [
        f"{result.run_time:.1f} s",
        f"{result.distance:.2f} m",
        counted(result.contacts, "contact", "contacts"),
        counted(result.whisker_touches, "whisker touch", "whisker touches"),
    ]
    if error is not None:
        parts.append(f"odometry off by {error:.2f} m at the end")
    parts.append(f"seed {result.seed}")
    if result.without:
        parts.append(f"without {counted(len(result.without), 'imperfection', 'imperfections')}")
    if result.error is not None:
        parts.append("ended early")
    return "   ·   ".join(parts)


def _draw_texts(figure: Figure, result: RunResult, view: scene.View, height: float) -> None:
    figure.text(
        0.03, 1 - 0.32 / height, _title(result, view), fontsize=15, weight="bold", color=INK, va="center"
    )  # fmt: skip
    figure.text(0.03, 1 - 0.62 / height, _caption(result), fontsize=9.5, color=FAINT, va="center")
    handles = [
        Line2D(
            [],
            [],
            color="#3b8a8c",
            lw=2.2,
            label="true path, dark to light in time" if view.known else "path by odometry",
        ),
        *([Line2D([], [], color=ESTIMATE, lw=1.2, ls=(0, (4, 2)), label="odometric estimate")] if view.known else []),
        Line2D([], [], ls="", marker="o", mfc=BODY, mec=START, mew=1.8, ms=8, label="start"),
        Line2D([], [], ls="", marker="o", mfc=BODY, mec=END, mew=1.8, ms=8, label="end"),
        Line2D([], [], ls="", marker="o", mfc="none", mec="#c98a2b", mew=1.2, ms=6, label="whisker touch"),
        Line2D([], [], ls="", marker="x", color=CONTACT, mew=1.8, ms=7, label="body contact"),
    ]
    if not view.known:
        handles = [handle for handle in handles if handle.get_label() not in ("odometric estimate", "body contact")]
    figure.legend(
        handles=handles, loc="lower center", ncols=len(handles), frameon=False, fontsize=8.5,
        labelcolor=INK, bbox_to_anchor=(0.5, 0.06 / height), handletextpad=0.5, columnspacing=1.6,
    )  # fmt: skip


def counted(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"
