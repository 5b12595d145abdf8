"""Columns of run.csv over time as a picture, a panel for each, and in it a curve for each robot that has it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from boebot.errors import BoebotError, brief, did_you_mean, printable
from boebot.view import figure_file, style, tables
from boebot.view.painter import quiet

if TYPE_CHECKING:
    from boebot.record.run import Run
    from boebot.record.truth import Floats

TIME = "time_s"
PANEL_IN = 1.7  # height of a panel
PANELS_AT_MOST = 20


def write(robots: Mapping[int, Run], names: Sequence[str], path: Path) -> Path:
    """Draws those columns, by their names in run.csv, of the robots by their numbers.

    Raises:
        BoebotError: no robot has such a column, a column has no numbers, there are too many, or the picture cannot be
            written.
    """
    figure_file.check(path)
    if len(names) > PANELS_AT_MOST:
        raise BoebotError(f"{len(names)} columns are too many for a picture; expected at most {PANELS_AT_MOST}")
    tables_of = {number: tables.columns(result) for number, result in robots.items()}
    curves = [_curves(tables_of, name) for name in names]
    figure = Figure(figsize=(style.WIDTH_IN, 0.8 + PANEL_IN * len(names)), dpi=style.DPI, layout="constrained")
    panels = figure.subplots(len(names), sharex=True, squeeze=False)[:, 0]
    is_alone = len(robots) == 1
    for index, (axes, name, found) in enumerate(zip(panels, names, curves, strict=True), 1):
        for number, (time, series) in found.items():
            colour = style.colour(index if is_alone else number)
            axes.plot(time, series, color=colour, lw=1.2, label=f"robot {number}")
        if not is_alone:
            axes.legend(fontsize=8, frameon=False, loc="best")
        quiet(axes, "time (s)" if index == len(names) else "", name)
        axes.set_facecolor(style.FLOOR)
    titles = (f"{one.brain} on {one.robot.name}" + ", ".join(["", *brief(one.error)]) for one in robots.values())
    title = printable("; ".join(dict.fromkeys(titles)))
    panels[0].set_title(title, fontsize=12, color=style.INK, parse_math=False)
    return figure_file.save(figure, path, title)


def _curves(tables_of: Mapping[int, dict[str, list[str]]], name: str) -> dict[int, tuple[Floats, Floats]]:
    """Times and values of the robots that have the column; of the first one, if none has it, for its error."""
    having = {number: table for number, table in tables_of.items() if name in table} or tables_of
    return {number: (_numbers(table, TIME), _numbers(table, name)) for number, table in having.items()}


def _numbers(columns: dict[str, list[str]], name: str) -> Floats:
    """The cells of a column; an empty one is not a number."""
    if name not in columns:
        raise BoebotError(
            f"the run has no column {name!r}; expected one of {', '.join(columns)}{did_you_mean(name, columns)}"
        )
    try:
        return np.array([float(cell) if cell else math.nan for cell in columns[name]])
    except ValueError:
        raise BoebotError(f"column {name!r} has words, not numbers; expected a column of numbers") from None
