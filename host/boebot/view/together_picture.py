"""run.png of several robots: the arena from above, each robot's path in its own colour, touches and contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.lines import Line2D

from boebot.errors import brief
from boebot.record.figures import counted
from boebot.view import scene, style
from boebot.view.painter import draw_arena, draw_layers, draw_robot, draw_swept, legend_entries
from boebot.view.picture import draw_marks
from boebot.view.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.artist import Artist

    from boebot.record.run import Run

Shown = tuple[int, "Run", scene.View]


def write(robots: Sequence[Run], error: BaseException | None, path: Path) -> Path:
    """Draws all robots of a run into a PNG file."""
    return draw(robots, error).save(path)


def draw(robots: Sequence[Run], error: BaseException | None) -> Sheet:
    """Draws all robots of a run; `error`: why it ended before its time, or None."""
    shown: list[Shown] = [(n, robot, scene.view(robot)) for n, robot in enumerate(robots, 1) if robot.ticks]
    plan = shown[0][2].plan
    low, high = scene.bounds(*(view for _, _, view in shown))
    sheet = Sheet(low, high, _title(robots), _caption(robots, error), _legend(shown))
    axes = sheet.axes
    draw_arena(axes, plan)
    for number, robot, view in shown:
        colour = style.colour(number)
        axes.plot(view.path.x, view.path.y, color=colour, lw=1.9, ls=style.dashes(number), zorder=7)
        axes.plot(view.path.x[0], view.path.y[0], "o", mfc=style.PAPER, mec=colour, mew=1.8, ms=6, zorder=8)
        draw_layers(axes, view, colour)
        draw_marks(axes, view)
        draw_swept(axes, view.swept, -1, colour)
        draw_robot(axes, robot.robot, view.pose(-1), colour, plan=plan, turret=float(view.turret[-1]))
        axes.annotate(
            str(number), view.pose(-1)[:2], color=style.INK, fontsize=8, weight="bold", ha="center", va="center",
            zorder=13,
        )  # fmt: skip
    return sheet


def _title(robots: Sequence[Run]) -> str:
    first = robots[0]
    return f"{len(robots)} robots on {first.board} in {first.table()['arena']}"


def _caption(robots: Sequence[Run], error: BaseException | None) -> list[str]:
    return [
        f"{max(robot.run_time for robot in robots):.1f} s",
        f"true distance {sum(robot.true_distance or 0.0 for robot in robots):.2f} m in all",
        counted(sum(robot.true_contacts or 0 for robot in robots), "true contact", "true contacts"),
        *brief(error),
    ]


def _legend(shown: list[Shown]) -> list[Artist]:
    entries: list[Artist] = [
        Line2D(
            [], [], color=style.colour(n), lw=2.2, ls=style.dashes(n), label=f"{n}: {robot.brain}, {robot.robot.name}"
        )
        for n, robot, _ in shown
    ]
    entries.append(Line2D([], [], ls="", marker="o", mfc=style.PAPER, mec=style.INK, mew=1.6, ms=6, label="start"))
    if any(len(view.touches) for _, _, view in shown):
        entries.append(
            Line2D([], [], ls="", marker="o", mfc=style.FLOOR, mec=style.TOUCH, mew=1.6, ms=6, label="whisker touch")
        )
    if any(len(view.true_contacts) for _, _, view in shown):
        entries.append(Line2D([], [], ls="", marker="x", color=style.CONTACT, mew=1.9, ms=7, label="true contact"))
    return entries + legend_entries(shown[0][2].plan)
