"""The picture of both estimators: error over time, median of twenty runs each."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

from boebot.navigation import LineMap
from boebot.view import figure_file, style
from boebot_course.tests.navigation_figures import kidnapping
from boebot_course.tests.navigation_figures.figures import side_by_side
from boebot_timing.plots import PLOTS

COURSES = {
    "office, from a good start": ("office", False),
    "office, carried away at 20 s": ("office", True),
    "rooms that look alike, carried away": ("twins", True),
}
LOOKS = {
    "random search": {"color": "#0072b2", "lw": 2.0, "zorder": 4},
    "particle filter": {"color": "#d55e00", "lw": 2.0, "zorder": 5},
    "odometry alone": {"color": "#8d93a1", "lw": 1.4, "ls": (0, (5, 2)), "zorder": 3},
}
Curves = dict[str, dict[str, list[float]]]


def run(number: int, arena: str, is_carried: bool) -> dict[str, list[float]]:
    """One of them: errors (m)."""
    plan = kidnapping.twins() if arena == "twins" else LineMap.of(arena)
    return kidnapping.errors(plan, number, is_carried=is_carried)


def medians() -> Curves:
    """Of each kind of course and each estimator, the error after each step (m)."""
    curves: Curves = {}
    for name, (arena, is_carried) in COURSES.items():
        runs = side_by_side(partial(run, arena=arena, is_carried=is_carried), range(kidnapping.RUNS))
        curves[name] = {kind: np.median([one[kind] for one in runs], axis=0).tolist() for kind in LOOKS}
    return curves


def draw(curves: Curves, path: Path) -> None:
    """Into a PNG file."""
    with mpl.rc_context(PLOTS):
        figure = Figure(figsize=(style.WIDTH_IN, 3.4), dpi=style.DPI, layout="constrained")
        panels = figure.subplots(1, len(curves), sharex=True, sharey=True)
        for axes, (name, courses) in zip(panels, curves.items(), strict=True):
            for kind, away in courses.items():
                times = kidnapping.STEP_S * np.arange(1, len(away) + 1)
                axes.plot(times, np.maximum(away, 0.005), label=kind, **LOOKS[kind])
            if COURSES[name][1]:
                axes.axvline(kidnapping.CARRIED_S, color=style.INK, lw=0.9, ls=":")
            axes.set(title=name, xlabel="time (s)", yscale="log", ylim=(0.007, 6), xlim=(0, kidnapping.SECONDS))
            axes.title.set_fontsize(9.5)
            axes.yaxis.set_major_locator(FixedLocator([0.01, 0.03, 0.1, 0.3, 1.0, 3.0]))
            axes.yaxis.set_minor_locator(NullLocator())
            axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.set_xticks([0, 20, 40, 60])
        panels[0].set_ylabel("error of the place (m)")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9, frameon=False)
        figure_file.save(figure, path, "Error of both estimators over time")
