"""run.png: the run seen from above. Arena, true path, path by odometry, true contacts, the robot at start and end with
what its sensors look at. What the robot does not have is neither drawn nor named. Of a brain of processes, the path has
the colour of the active motor behavior, and its utilities stand below (as in Fig. 8.3 of the notes): a line for each
motor behavior, and a band that says which was active. Of several robots each path has the robot's colour."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from boebot.errors import brief
from boebot.record.figures import counted
from boebot.view import scene, style
from boebot.view.painter import (
    draw_arena,
    draw_layers,
    draw_robot,
    draw_swept,
    frame,
    layer_entries,
    legend_entries,
    paint,
    quiet,
)

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from boebot.arenas.arena import Floats
    from boebot.record.brain_record import BrainRecord
    from boebot.record.overview import Overview
    from boebot.record.run import Run
    from boebot.record.truth import Pose

SEGMENTS_MAXIMUM = 6000  # of a path as it is drawn
SPOT_M = 0.03  # a shorter stretch would hardly be seen
BAND = (-1.42, -1.12)  # where the band of active behaviors lies, below the utilities' -1
LOW, HIGH = -1.55, 1.15  # ends of the utilities' axis
LEGEND_COLUMNS = 5

LEFT_IN, RIGHT_IN = 0.72, 0.18  # beside the field
TALLEST_IN = 8.2  # of the field
LINE_IN, ROW_IN = 0.22, 0.205  # of the caption, of the legend
CAPTION_COLUMNS, TITLE_COLUMNS = 126, 68
PANEL_IN, PANEL_BELOW_IN = 1.5, 0.5  # of the panel below the field, and for the words below it
ENTRY_IN, LETTER_IN = 0.5, 0.062  # of the legend: handle and gaps, one letter
POINTS_AT_ONCE = 5000  # of a line, which has a gap after them; the dashes of a long one at once take 100 MB
PARTING = "   ·   "
TOUCH: dict[str, Any] = {
    "ls": "", "marker": "o", "mfc": style.FLOOR, "mec": style.TOUCH, "mew": 1.6, "ms": 5.5, "zorder": 9
}  # fmt: skip
CONTACT: dict[str, Any] = {"ls": "", "marker": "x", "color": style.CONTACT, "mew": 1.9, "ms": 7, "zorder": 9.5}
PIXELS_PER_INCH = 96  # of a page

Shown = tuple[int, "Run", scene.View]


def draw(robots: Sequence[Run], error: BaseException | None) -> Sheet:
    """Draws the run; `error`: why it ended before its time, or None."""
    return _draw_one(robots[0]) if len(robots) == 1 else _draw_together(robots, error)


def _draw_one(result: Run) -> Sheet:
    view = scene.view(result)
    low, high = scene.bounds(view)
    record = result.overview.brain if result.overview.brain else None
    rows = _legend_rows(record) if record is not None else 0
    sheet = Sheet(low, high, _title(result, view), _caption(result), _legend(result, view), rows)
    axes = sheet.axes
    draw_arena(axes, view.plan)
    if record is None:
        _draw_path(axes, view.path, result.overview.columns.time)
    else:
        assert sheet.panel is not None
        _draw_behaviors(axes, view.path, result.overview.columns.time, record)
        with rc_context({"text.parse_math": False}):
            _draw_utilities(sheet.panel, record, result.run_time)
    if view.estimate is not None:
        thin = slice(None, None, max(1, len(view.estimate.x) // SEGMENTS_MAXIMUM))  # each dash takes memory
        axes.plot(view.estimate.x[thin], view.estimate.y[thin], color=style.ESTIMATE, lw=1.1, ls=(0, (4, 2)), zorder=6)
        paint(axes, scene.ghost_items(result.robot), pose=view.estimate.at(-1))
    draw_layers(axes, view)
    _draw_marks(axes, result.overview)
    for index, colour in ((0, style.START), (-1, style.END)):
        turret = float(view.turret[index])
        draw_swept(axes, view.swept, index, colour)
        draw_robot(axes, result.robot, view.path.at(index), colour, plan=view.plan, turret=turret)
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
    for behavior, begun, until in segments(record, float(time[-1])):
        first, last = np.searchsorted(time, (begun, until))
        there = slice(int(first), int(last) + 1)  # up to where the next one begins
        x, y, colour = path.x[there], path.y[there], style.behavior(behavior)
        axes.plot(x, y, color=colour, lw=2.4, solid_capstyle="round", zorder=7)
        if len(x) and np.hypot(np.ptp(x), np.ptp(y)) < SPOT_M:
            axes.plot(x[0], y[0], "o", ms=5.5, color=colour, mec=style.FLOOR, mew=0.6, zorder=8)


def _draw_marks(axes: Axes, few: Overview) -> None:
    """Where a whisker was pressed (circles) and where the body touched something (crosses)."""
    for places, look in ((few.touch_places, TOUCH), (few.contact_places, CONTACT)):
        if len(places):
            axes.plot(*places.T, **look)


def _title(result: Run, view: scene.View) -> str:
    where = f" in {view.plan.described.name}" if view.known else ""
    return result.title + where


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
    return entries + _legend_marks([result]) + layer_entries(view) + legend_entries(view.plan)


def _legend_marks(runs: Sequence[Run]) -> list[Artist]:
    """Entries of touches and contacts, where there are any."""
    entries: list[Artist] = []
    if any(len(run.overview.touch_places) for run in runs):
        entries.append(Line2D([], [], label="whisker touch", **TOUCH))
    if any(len(run.overview.contact_places) for run in runs):
        entries.append(Line2D([], [], label="true contact", **CONTACT))
    return entries


# ---- the utilities of a brain of processes ---------------------------------------------------------------------------


def segments(record: BrainRecord, end: float) -> list[tuple[int, float, float]]:
    """Which motor behavior (its index) was active from when to when (s), to the `end` of the run."""
    if not len(record.motor):
        return []
    changes = np.flatnonzero(np.diff(record.motor)) + 1
    begins = [0, *changes.tolist()]
    ends = [*record.time[changes].tolist(), max(end, float(record.time[-1]))]
    return [(int(record.motor[i]), float(record.time[i]), until) for i, until in zip(begins, ends, strict=True)]


def _draw_utilities(axes: Axes, record: BrainRecord, end: float) -> None:
    """Draws the panel; `end` of the run in s."""
    low, high = BAND
    for behavior, begun, until in segments(record, end):
        colour = style.behavior(behavior)
        axes.fill_between((begun, until), low, high, facecolor=colour, edgecolor="none", zorder=3)
        axes.axvspan(begun, until, ymin=(-1.05 - LOW) / (HIGH - LOW), color=colour, alpha=0.07, lw=0, zorder=0)
    for index, name in enumerate(record.names.behaviors):
        axes.plot(record.time, record.utility_of(name), color=style.behavior(index), lw=1.7, zorder=5)
    axes.set_xlim(0.0, max(end, 1e-3))
    axes.set_ylim(LOW, HIGH)
    axes.set_yticks((sum(BAND) / 2, -1.0, -0.5, 0.0, 0.5, 1.0), ("active", "−1", "−0.5", "0", "0.5", "1"))
    quiet(axes, "time (s)", "utility (1)")
    axes.set_facecolor(style.FLOOR)
    axes.legend(
        handles=_utility_entries(record, end), loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=LEGEND_COLUMNS,
        frameon=False, fontsize=8.5, labelcolor=style.INK, handletextpad=0.5, columnspacing=1.6, borderaxespad=0.1,
    )  # fmt: skip


def _legend_rows(record: BrainRecord) -> int:
    """Of the legend above the panel."""
    return -(-len(record.names.behaviors) // LEGEND_COLUMNS)


def _utility_entries(record: BrainRecord, end: float) -> list[Artist]:
    shares = record.shares(end)
    return [
        Line2D([], [], color=style.behavior(index), lw=2.4, label=f"{name} {100 * shares[name]:.0f} %")
        for index, name in enumerate(record.names.behaviors)
    ]


# ---- several robots --------------------------------------------------------------------------------------------------


def _draw_together(robots: Sequence[Run], error: BaseException | None) -> Sheet:
    shown: list[Shown] = [(n, robot, scene.view(robot)) for n, robot in enumerate(robots, 1) if robot.ticks]
    plan = shown[0][2].plan
    low, high = scene.bounds(*(view for _, _, view in shown))
    sheet = Sheet(low, high, _title_together(robots), _caption_together(robots, error), _legend_together(shown))
    axes = sheet.axes
    draw_arena(axes, plan)
    for number, robot, view in shown:
        colour = style.colour(number)
        axes.plot(view.path.x, view.path.y, color=colour, lw=1.9, ls=style.dashes(number), zorder=7)
        axes.plot(view.path.x[0], view.path.y[0], "o", mfc=style.PAPER, mec=colour, mew=1.8, ms=6, zorder=8)
        draw_layers(axes, view, colour)
        _draw_marks(axes, robot.overview)
        draw_swept(axes, view.swept, -1, colour)
        draw_robot(axes, robot.robot, view.path.at(-1), colour, plan=plan, turret=float(view.turret[-1]))
        axes.annotate(
            str(number), view.path.at(-1)[:2], color=style.INK, fontsize=8, weight="bold", ha="center", va="center",
            zorder=13,
        )  # fmt: skip
    return sheet


def _title_together(robots: Sequence[Run]) -> str:
    first = robots[0]
    return f"{len(robots)} robots on {first.board} in {first.table()['arena']}"


def _caption_together(robots: Sequence[Run], error: BaseException | None) -> list[str]:
    return [
        f"{max(robot.run_time for robot in robots):.1f} s",
        f"true distance {sum(robot.true_distance or 0.0 for robot in robots):.2f} m in all",
        counted(sum(robot.true_contacts or 0 for robot in robots), "true contact", "true contacts"),
        *brief(error),
    ]


def _legend_together(shown: list[Shown]) -> list[Artist]:
    entries: list[Artist] = [
        Line2D(
            [], [], color=style.colour(n), lw=2.2, ls=style.dashes(n), label=f"{n}: {robot.brain}, {robot.robot.name}"
        )
        for n, robot, _ in shown
    ]
    entries.append(Line2D([], [], ls="", marker="o", mfc=style.PAPER, mec=style.INK, mew=1.6, ms=6, label="start"))
    return entries + _legend_marks([robot for _, robot, _ in shown]) + legend_entries(shown[0][2].plan)


# ---- the sheet of both -----------------------------------------------------------------------------------------------


class NotebookFigure(Figure):
    """A figure that a notebook shows where it is the last line of a cell. Those of pyplot are shown because pyplot asks
    for it; the kit draws without pyplot."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The figure as PNG, and how large a notebook shows it, in pixels."""
        png = io.BytesIO()
        self.savefig(png, format="png", dpi=self.dpi)
        width, height = (round(PIXELS_PER_INCH * float(inches)) for inches in self.get_size_inches())
        return png.getvalue(), {"width": width, "height": height}


class Sheet:
    """A picture under way.

    Attributes:
        figure: the whole.
        axes: of the field, to draw on.
        panel: the axes below the field, where they were asked for.
    """

    def __init__(
        self,
        low: Floats,
        high: Floats,
        title: str,
        caption: Sequence[str],
        legend: Sequence[Artist],
        panel_rows: int = 0,
    ) -> None:
        """Field from `low` to `high` (m), two corners; parts of the caption; entries of the legend; rows of the
        legend above a panel below the field, 0: there is no panel."""
        self.title, self.caption = title, PARTING.join(caption)
        lines = _wrapped(caption)
        across = style.WIDTH_IN - LEFT_IN - RIGHT_IN
        width, height = (high - low).tolist()
        scale = min(across / width, TALLEST_IN / height)
        longest = max((len(str(entry.get_label())) for entry in legend), default=0)
        columns = max(1, min(len(legend), int(across / (ENTRY_IN + LETTER_IN * longest))))
        rows = -(-len(legend) // columns)
        above = 0.62 + LINE_IN * len(lines)
        foot = ROW_IN * rows + 0.12
        panel_in = PANEL_IN + ROW_IN * panel_rows + 0.15 + PANEL_BELOW_IN if panel_rows else 0.0
        below = 0.5 + panel_in + foot
        tall = height * scale + above + below
        self.figure = NotebookFigure(figsize=(style.WIDTH_IN, tall), dpi=style.DPI, facecolor=style.PAPER)
        inset = (across - width * scale) / 2
        self.axes = self.figure.add_axes(
            (
                (LEFT_IN + inset) / style.WIDTH_IN,
                below / tall,
                width * scale / style.WIDTH_IN,
                height * scale / tall,
            )
        )
        self.axes.set_facecolor(style.PAPER)
        self.panel = self._panel(foot, across, tall) if panel_rows else None
        frame(self.axes, low, high)
        with rc_context({"text.parse_math": False}):  # a $ in a name is a $
            self._write(tall, lines, legend, columns)

    def _panel(self, foot: float, across: float, tall: float) -> Axes:
        """Axes as wide as the sheet, `foot` above its lower edge."""
        return self.figure.add_axes(
            (LEFT_IN / style.WIDTH_IN, (foot + PANEL_BELOW_IN) / tall, across / style.WIDTH_IN, PANEL_IN / tall)
        )

    def _write(self, tall: float, lines: Sequence[str], legend: Sequence[Artist], columns: int) -> None:
        """Title, caption and legend on a sheet of this height, inches."""
        left = 0.18 / style.WIDTH_IN
        shown = textwrap.shorten(self.title, TITLE_COLUMNS, placeholder="…")
        self.figure.text(left, 1 - 0.32 / tall, shown, fontsize=15, weight="bold", color=style.INK, va="center")
        for number, line in enumerate(lines):
            y = 1 - (0.64 + LINE_IN * number) / tall
            self.figure.text(left, y, line, fontsize=9.5, color=style.FAINT, va="center")
        if legend:
            self.figure.legend(
                handles=list(legend), loc="lower center", ncols=columns, frameon=False, fontsize=8.5,
                labelcolor=style.INK, bbox_to_anchor=(0.5, 0.06 / tall), handletextpad=0.5, columnspacing=1.6,
            )  # fmt: skip

    @property
    def width(self) -> int:
        """Of the picture, in pixels of a page."""
        return round(float(self.figure.get_figwidth()) * PIXELS_PER_INCH)

    def save(self, path: Path) -> Path:
        """Writes it as PNG, with title and caption in its text."""
        path.write_bytes(self.png())
        return path

    def png(self) -> bytes:
        """As the bytes of a PNG file, with title and caption in its text."""
        metadata = {"Title": self.title, "Description": self.caption}
        file = io.BytesIO()
        with rc_context({"agg.path.chunksize": POINTS_AT_ONCE}):
            self.figure.savefig(file, format="png", facecolor=style.PAPER, metadata=metadata)
        return file.getvalue()


def _wrapped(parts: Sequence[str]) -> list[str]:
    """The caption in lines that are not too long, broken between its parts."""
    lines: list[str] = []
    for part in parts:
        if lines and len(lines[-1]) + len(PARTING) + len(part) <= CAPTION_COLUMNS:
            lines[-1] += PARTING + part
        else:
            lines.append(part)
    return lines
