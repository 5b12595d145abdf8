"""Columns of run.csv over time as a picture, a panel for each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from boebot.errors import BoebotError, did_you_mean, printable
from boebot.former_names import FIGURES, refusal
from boebot.view import figure_file, style, tables

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from boebot.record.result import RunResult

TIME = "time_s"
PANEL_IN = 1.7  # height of a panel
PANELS_AT_MOST = 20


def write(result: RunResult, names: Sequence[str], path: Path) -> Path:
    """Draws those columns, by their names in run.csv.

    Raises:
        BoebotError: the run has no such column, a column has no numbers, there are too many, or the picture cannot be
            written.
    """
    figure_file.check(path)
    if len(names) > PANELS_AT_MOST:
        raise BoebotError(f"{len(names)} columns are too many for a picture; expected at most {PANELS_AT_MOST}")
    columns = tables.columns(result)
    values = [_numbers(columns, name) for name in names]
    time = _numbers(columns, TIME)
    figure = Figure(figsize=(style.WIDTH_IN, 0.8 + PANEL_IN * len(names)), dpi=style.DPI, layout="constrained")
    panels = figure.subplots(len(names), sharex=True, squeeze=False)[:, 0]
    for index, (axes, name, series) in enumerate(zip(panels, names, values, strict=True)):
        axes.plot(time, series, color=style.ROBOTS[index % len(style.ROBOTS)], lw=1.2)
        axes.set_ylabel(name, color=style.INK, fontsize=9)
        axes.tick_params(labelsize=8.5, colors=style.FAINT, labelcolor=style.INK, length=3)
        axes.grid(color=style.GRID, lw=0.7)
        axes.set_facecolor(style.FLOOR)
    panels[-1].set_xlabel("time (s)", color=style.INK, fontsize=9)
    title = printable(f"{result.brain} on {result.robot.name}")
    panels[0].set_title(title, fontsize=12, color=style.INK, parse_math=False)
    return figure_file.save(figure, path, title)


def _numbers(columns: dict[str, list[str]], name: str) -> NDArray[np.float64]:
    """The cells of a column; an empty one is not a number."""
    if name not in columns:
        raise BoebotError(
            refusal(name, FIGURES)
            or f"the run has no column {name!r}; expected one of {', '.join(columns)}{did_you_mean(name, columns)}"
        )
    try:
        return np.array([float(cell) if cell else math.nan for cell in columns[name]])
    except ValueError:
        raise BoebotError(f"column {name!r} has words, not numbers; expected a column of numbers") from None
