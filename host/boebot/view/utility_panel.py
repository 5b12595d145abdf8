"""The utilities of a brain of processes over time, drawn with matplotlib (as in Fig. 8.3 of the notes): a line for each
process, and below them a band that says which motor behavior was active."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D

from boebot.view import style
from boebot.view.painter import quiet

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from boebot.record.brain_record import BrainRecord

COGNITIVE_AT_MOST = 4  # more of them are not drawn
BAND = (-1.42, -1.12)  # where the band lies, below the utilities' -1
LOW, HIGH = -1.55, 1.15  # ends of the axis
LEGEND_COLUMNS = 5


def segments(record: BrainRecord, end: float) -> list[tuple[int, float, float]]:
    """Which motor behavior (its index) was active from when to when (s), to the `end` of the run."""
    if not len(record.motor):
        return []
    changes = np.flatnonzero(np.diff(record.motor)) + 1
    begins = [0, *changes.tolist()]
    ends = [*record.time[changes].tolist(), max(end, float(record.time[-1]))]
    return [(int(record.motor[i]), float(record.time[i]), until) for i, until in zip(begins, ends, strict=True)]


def draw(axes: Axes, record: BrainRecord, end: float) -> None:
    """Draws the panel; `end` of the run in s."""
    low, high = BAND
    for behavior, begun, until in segments(record, end):
        colour = style.behavior(behavior)
        axes.fill_between((begun, until), low, high, facecolor=colour, edgecolor="none", zorder=3)
        axes.axvspan(begun, until, ymin=(-1.05 - LOW) / (HIGH - LOW), color=colour, alpha=0.07, lw=0, zorder=0)
    for name in shown_cognitive(record):
        axes.plot(record.time, record.utility_of(name), color=style.FAINT, lw=0.8, ls=_dashes(record, name), zorder=4)
    for index, name in enumerate(record.names.behaviors):
        axes.plot(record.time, record.utility_of(name), color=style.behavior(index), lw=1.7, zorder=5)
    axes.set_xlim(0.0, max(end, 1e-3))
    axes.set_ylim(LOW, HIGH)
    axes.set_yticks((sum(BAND) / 2, -1.0, -0.5, 0.0, 0.5, 1.0), ("active", "−1", "−0.5", "0", "0.5", "1"))
    quiet(axes, "time (s)", "utility (1)")
    axes.set_facecolor(style.FLOOR)
    axes.legend(
        handles=_legend(record, end), loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=LEGEND_COLUMNS, frameon=False,
        fontsize=8.5, labelcolor=style.INK, handletextpad=0.5, columnspacing=1.6, borderaxespad=0.1,
    )  # fmt: skip


def legend_rows(record: BrainRecord) -> int:
    """Of the legend above the panel."""
    return -(-(len(record.names.behaviors) + len(shown_cognitive(record))) // LEGEND_COLUMNS)


def shown_cognitive(record: BrainRecord) -> Sequence[str]:
    """The cognitive processes that are drawn: those whose utility changes, where they are few."""
    changing = [name for name in record.names.cognitive if len(record) and np.ptp(record.utility_of(name)) > 0]
    return changing if len(changing) <= COGNITIVE_AT_MOST else []


def _dashes(record: BrainRecord, name: str) -> tuple[int, tuple[float, ...]]:
    return style.DASHES[record.names.cognitive.index(name) % len(style.DASHES)]


def _legend(record: BrainRecord, end: float) -> list[Artist]:
    shares = record.shares(end)
    entries: list[Artist] = [
        Line2D([], [], color=style.behavior(index), lw=2.4, label=f"{name} {100 * shares[name]:.0f} %")
        for index, name in enumerate(record.names.behaviors)
    ]
    entries += [
        Line2D([], [], color=style.FAINT, lw=0.8, ls=_dashes(record, name), label=name)
        for name in shown_cognitive(record)
    ]
    return entries
