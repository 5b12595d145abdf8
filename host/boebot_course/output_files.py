"""Files of an experiment: its figure as PNG and SVG, its data as CSV (RFC 4180), its verdict as JSON.

The same experiment with the same seed gives the same bytes: no date, no times, no random names.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from boebot import resources
from boebot.view import figure_file, style
from boebot_course.experiment import Experiment, Measured, Outcome
from boebot_timing.plots import PLOTS

HEIGHT_IN = 4.8  # of a figure, unless what draws it asks for another


def files(experiment: Experiment, outcome: Outcome, seed: int) -> dict[str, bytes]:
    """All of them: name -> content.

    Raises:
        ValueError: the data are no columns of one length.
    """
    name = experiment.name
    table = as_csv(outcome)  # first: it finds fault sooner than the figure is drawn
    png, svg = pictures(experiment, outcome, {"png": style.DPI, "svg": style.DPI})
    verdict = record(experiment, outcome.measured) | {"seed": seed, "version": resources.version()}
    return {
        f"{name}.png": png,
        f"{name}.svg": svg,
        f"{name}.csv": table,
        f"{name}.json": json.dumps(verdict, indent=1, ensure_ascii=False, allow_nan=False).encode() + b"\n",
    }


def pictures(experiment: Experiment, outcome: Outcome, forms: dict[str, float]) -> list[bytes]:
    """The figure in those forms, "png" or "svg", with that many dots per inch."""
    found = []
    with mpl.rc_context(PLOTS):
        figure = Figure(figsize=(style.WIDTH_IN, HEIGHT_IN), layout="constrained")
        outcome.draw(figure)
        for form, dpi in forms.items():
            found.append(figure_file.as_bytes(figure, form, f"{experiment.name}: {experiment.title}", dpi))
            figure.set_layout_engine("none")  # it is laid out
    return found


def as_csv(outcome: Outcome) -> bytes:
    """The data; numbers in the fewest digits that are read back as the same, an empty cell for what is not a number."""
    columns = outcome.columns()
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*(map(_cell, column.tolist()) for column in columns.values()), strict=True))
    return text.getvalue().encode()


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return int(value)
    return "" if value is None or value != value else value


def record(experiment: Experiment, measured: Iterable[Measured], error: str = "") -> dict[str, Any]:
    """What an experiment is and what came of it, for programs; None where a figure is not finite."""
    figures = [
        {"name": one.name, "value": _finite(one.value), "unit": one.unit}
        | {"least": _finite(one.least), "most": _finite(one.most), "expected": one.expected, "met": one.is_met}
        for one in measured
    ]
    said = {field: getattr(experiment, field) for field in ("name", "title", "source", "robot", "criterion")}
    is_met = not error and all(one["met"] for one in figures)
    return {**said, "met": is_met, "error": error or None, "measured": figures}


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
