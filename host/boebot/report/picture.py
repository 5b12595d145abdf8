"""run.png: the run seen from above. Arena, true path, odometric estimate, contacts, the robot at start and end with
what its sensors look at. What the robot does not have is neither drawn nor named."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D

from boebot.report import scene, style
from boebot.report.arena_drawing import draw_arena, legend_entries
from boebot.report.robot_drawing import body_patch, draw_robot
from boebot.report.sheet import Sheet, counted

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from boebot.result import RunResult
    from boebot.robots import Body
    from boebot.series import Floats, Pose

SEGMENTS_MAXIMUM = 6000  # of a path as it is drawn


def write(result: RunResult, path: Path) -> Path:
    """Draws the run into a PNG file."""
    view = scene.view(result)
    low, high = scene.bounds(view)
    sheet = Sheet(low, high, _title(result, view), _caption(result, view), _legend(result, view))
    axes = sheet.axes
    draw_arena(axes, view.plan)
    _draw_path(axes, view.path, result.series.time)
    if view.estimate is not None:
        axes.plot(view.estimate.x, view.estimate.y, color=style.ESTIMATE, lw=1.1, ls=(0, (4, 2)), zorder=6)
        _draw_ghost(axes, result.robot.body, view.estimate)
    draw_marks(axes, view)
    for index, colour in ((0, style.START), (-1, style.END)):
        turret = float(view.turret[index])
        draw_robot(axes, result.robot, view.pose(index), colour, plan=view.plan, turret=turret)
    return sheet.save(path)


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


def _draw_ghost(axes: Axes, body: Body, estimate: Pose) -> None:
    """The odometric ghost: the robot where it believes to be at the end."""
    x, y, heading = float(estimate.x[-1]), float(estimate.y[-1]), float(estimate.heading[-1])
    on_axes = Affine2D().rotate(heading).translate(x, y) + axes.transData
    look = {"facecolor": "none", "edgecolor": style.ESTIMATE, "lw": 1.1, "ls": (0, (3, 2)), "zorder": 8}
    axes.add_patch(body_patch(body.radius_m, body.outline_m, transform=on_axes, **look))
    axes.plot((0.0, body.front_m), (0.0, 0.0), color=style.ESTIMATE, lw=1.1, transform=on_axes, zorder=8)


def draw_marks(axes: Axes, view: scene.View) -> None:
    """Where a whisker was pressed (circles) and where the body touched something (crosses)."""
    if len(view.touches):
        axes.scatter(
            view.touches[:, 0], view.touches[:, 1], s=30, marker="o", fc=style.FLOOR, ec=style.TOUCH, lw=1.6, zorder=9
        )
    if len(view.contacts):
        axes.scatter(
            view.contacts[:, 0], view.contacts[:, 1], s=46, marker="x", color=style.CONTACT, lw=1.9, zorder=9.5
        )


def _title(result: RunResult, view: scene.View) -> str:
    where = f" in {view.plan.name}" if view.known else ""
    return f"{result.brain} on {result.robot.name} ({result.board}){where}"


def _caption(result: RunResult, view: scene.View) -> list[str]:
    parts = [f"{result.run_time:.1f} s"]
    if view.path_is_seen:
        parts.append(f"{result.distance:.2f} m")
    else:
        parts.append("nobody knows where it went: it has nothing to measure its way with")
    if view.known:
        parts.append(counted(result.contacts, "contact", "contacts"))
    if view.has_whiskers:
        parts.append(counted(result.whisker_touches, "whisker touch", "whisker touches"))
    if (error := result.odometry_error) is not None:
        parts.append(f"odometry off by {error:.2f} m at the end")
    parts.append(f"seed {result.seed}")
    if result.without:
        parts.append(f"without {counted(len(result.without), 'imperfection', 'imperfections')}")
    if result.error is not None:
        parts.append("ended early")
    return parts


def _legend(result: RunResult, view: scene.View) -> list[Artist]:
    said = "true path, dark to light in time" if view.known else "path by odometry, dark to light in time"
    entries: list[Artist] = []
    if view.path_is_seen:
        entries.append(Line2D([], [], color="#3b8a8c", lw=2.4, label=said))
    if view.estimate is not None:
        entries.append(Line2D([], [], color=style.ESTIMATE, lw=1.2, ls=(0, (4, 2)), label="odometric estimate"))
    for label, colour in (("start", style.START), ("end", style.END)):
        entries.append(Line2D([], [], ls="", marker="o", mfc=style.BODY, mec=colour, mew=1.8, ms=8, label=label))
    if len(view.touches):
        entries.append(
            Line2D([], [], ls="", marker="o", mfc=style.FLOOR, mec=style.TOUCH, mew=1.6, ms=6, label="whisker touch")
        )
    if len(view.contacts):
        entries.append(Line2D([], [], ls="", marker="x", color=style.CONTACT, mew=1.9, ms=7, label="body contact"))
    return entries + legend_entries(view.plan)
