"""run.png: the run seen from above. Arena, true path, path by odometry, true contacts, the robot at start and end with
what its sensors look at. What the robot does not have is neither drawn nor named. Of a brain of processes, the path has
the colour of the active motor behavior, and its utilities stand below."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from boebot.errors import brief
from boebot.record.figures import counted
from boebot.view import scene, style, utility_panel
from boebot.view.painter import draw_arena, draw_layers, draw_robot, draw_swept, layer_entries, legend_entries, paint
from boebot.view.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from boebot.record.brain_record import BrainRecord
    from boebot.record.run import Run
    from boebot.record.truth import Floats, Pose

SEGMENTS_MAXIMUM = 6000  # of a path as it is drawn
SPOT_M = 0.03  # a shorter stretch would hardly be seen


def write(result: Run, path: Path) -> Path:
    """Draws the run into a PNG file."""
    return draw(result).save(path)


def draw(result: Run) -> Sheet:
    """Draws the run."""
    view = scene.view(result)
    low, high = scene.bounds(view)
    record = result.overview.brain if result.overview.brain else None
    rows = utility_panel.legend_rows(record) if record is not None else 0
    sheet = Sheet(low, high, _title(result, view), _caption(result), _legend(result, view), rows)
    axes = sheet.axes
    draw_arena(axes, view.plan)
    if record is None:
        _draw_path(axes, view.path, result.overview.columns.time)
    else:
        assert sheet.panel is not None
        _draw_behaviors(axes, view.path, result.overview.columns.time, record)
        with rc_context({"text.parse_math": False}):
            utility_panel.draw(sheet.panel, record, result.run_time)
    if view.estimate is not None:
        thin = slice(None, None, max(1, len(view.estimate.x) // SEGMENTS_MAXIMUM))  # each dash takes memory
        axes.plot(view.estimate.x[thin], view.estimate.y[thin], color=style.ESTIMATE, lw=1.1, ls=(0, (4, 2)), zorder=6)
        paint(axes, scene.ghost_items(result.robot), pose=view.estimate.at(-1))
    draw_layers(axes, view)
    draw_marks(axes, view)
    for index, colour in ((0, style.START), (-1, style.END)):
        turret = float(view.turret[index])
        draw_swept(axes, view.swept, index, colour)
        draw_robot(axes, result.robot, view.pose(index), colour, plan=view.plan, turret=turret)
    return sheet


def _draw_path(axes: Axes, path: Pose, time: Floats) -> None:
    """The path, its colour running with time."""
    points = np.column_stack((path.x, path.y))
    thin = max(1, len(points) // SEGMENTS_MAXIMUM)
    points, time = points[::thin], time[::thin]
    if len(points) < 2:
        return
    segments = np.stack((points[:-1], points[1:]), axis=1)
    lines = LineCollection(list(segments), array=time[:-1], cmap=style.PATH, lw=2.2, zorder=7)
    lines.set_clim(time[0], time[0] + (time[-1] - time[0]) / style.PATH_SHARE)
    lines.set_capstyle("round")
    axes.add_collection(lines)


def _draw_behaviors(axes: Axes, path: Pose, time: Floats, record: BrainRecord) -> None:
    """The path, each stretch in the colour of the motor behavior that was active; a turn on the spot as a dot."""
    for behavior, begun, until in utility_panel.segments(record, float(time[-1])):
        first, last = np.searchsorted(time, (begun, until))
        there = slice(int(first), int(last) + 1)  # up to where the next one begins
        x, y, colour = path.x[there], path.y[there], style.behavior(behavior)
        axes.plot(x, y, color=colour, lw=2.4, solid_capstyle="round", zorder=7)
        if len(x) and np.hypot(np.ptp(x), np.ptp(y)) < SPOT_M:
            axes.plot(x[0], y[0], "o", ms=5.5, color=colour, mec=style.FLOOR, mew=0.6, zorder=8)


def draw_marks(axes: Axes, view: scene.View) -> None:
    """Where a whisker was pressed (circles) and where the body touched something (crosses)."""
    if len(view.touches):
        axes.scatter(
            view.touches[:, 0], view.touches[:, 1], s=30, marker="o", fc=style.FLOOR, ec=style.TOUCH, lw=1.6, zorder=9
        )
    if len(view.true_contacts):
        axes.scatter(
            view.true_contacts[:, 0],
            view.true_contacts[:, 1],
            s=46,
            marker="x",
            color=style.CONTACT,
            lw=1.9,
            zorder=9.5,
        )


def _title(result: Run, view: scene.View) -> str:
    where = f" in {view.plan.name}" if view.known else ""
    return f"{result.brain} on {result.robot.name} ({result.board}){where}"


def _caption(result: Run) -> list[str]:
    parts = [f"{result.run_time:.1f} s", *result.way_in_words()]
    if (error := result.odometry_error) is not None:
        parts.append(f"odometry off by {error:.2f} m at the end")
    parts.append(f"seed {result.seed}")
    if result.without:
        parts.append(f"without {counted(len(result.without), 'imperfection', 'imperfections')}")
    if result.imperfections:
        parts.append(f"{counted(len(result.imperfections), 'imperfection', 'imperfections')} set")
    return [*parts, *brief(result.error)]


def _legend(result: Run, view: scene.View) -> list[Artist]:
    composed = bool(result.overview.brain)
    colours = "coloured by behavior" if composed else "dark to light in time"
    said = f"true path, {colours}" if view.known else f"path by odometry, {colours}"
    entries: list[Artist] = []
    if view.path_is_seen:
        entries.append(Line2D([], [], color=style.behavior(0) if composed else "#3b8a8c", lw=2.4, label=said))
    if view.estimate is not None:
        entries.append(Line2D([], [], color=style.ESTIMATE, lw=1.2, ls=(0, (4, 2)), label="path by odometry"))
    for label, colour in (("start", style.START), ("end", style.END)):
        entries.append(Line2D([], [], ls="", marker="o", mfc=style.BODY, mec=colour, mew=1.8, ms=8, label=label))
    if len(view.touches):
        entries.append(
            Line2D([], [], ls="", marker="o", mfc=style.FLOOR, mec=style.TOUCH, mew=1.6, ms=6, label="whisker touch")
        )
    if len(view.true_contacts):
        entries.append(Line2D([], [], ls="", marker="x", color=style.CONTACT, mew=1.9, ms=7, label="true contact"))
    return entries + layer_entries(view) + legend_entries(view.plan)
