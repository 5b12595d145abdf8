"""Predator and prey: M. xanthus feeds on E. coli, moves some 200 times slower, and lures it. Section 4.4.2 of the
notes.

The predator is the source of what its prey takes for food: prey that follows (4.1) up the attractant gathers around it,
and stays with it wherever it goes.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, experiment
from boebot_course.experiments.chemotaxis import (
    SIZE,
    SPEED,
    STRIDE,
    Swarm,
    begin_and_end,
    draw_circle,
    gaussian,
    positions,
    swarm,
    uniform,
)
from boebot_course.trials import trial_seeds

REACH = 0.5  # m around the predator
SLOWER = 200.0
PREY, LASTS = 40, 200.0  # s: it moves by 1 m, twice its reach
PERIOD = 0.05  # s, of the brains
LATE = slice(round(150 / STRIDE), None)  # the last 50 s


def lure(x: float, y: float, time: float) -> float:
    """The attractant around the predator, which moves along x."""
    return gaussian(x - SPEED / SLOWER * time, y, 0.0)


def predators(times: Floats) -> Floats:
    """Where the predator is (m), shape (times, 2)."""
    return np.column_stack((SPEED / SLOWER * times, np.zeros_like(times)))


def density_ratio(group: Swarm) -> float:
    """Prey within `REACH` of the predator in the last 50 s, against what there would be if it were spread evenly over
    the square where it began."""
    times = STRIDE * np.arange(len(group.path), dtype=np.float64)[LATE]
    away = group.path[LATE] - predators(times)[:, None]
    return float((np.hypot(away[..., 0], away[..., 1]) < REACH).mean() * SIZE**2 / (math.pi * REACH**2))


@experiment("predator-prey", robot="arsim, as narrow as a bacterium", slow=True)
def luring(seed: int) -> Outcome:
    """M. xanthus lures E. coli

    In the notes: section 4.4.2

    Figure: Bacteria before and after 200 s, lured by a predator 200 times slower, which moves by 1 m meanwhile;
    circle: what is near to it.

    Expected: Prey around the predator at least three times as dense as if spread evenly, and not so without
    attractant. In the last 50 s the predator is 0.75 m to 1 m from where it began, 0.875 m in the mean, and so is
    the prey's middle. A bacterium is some 0.6 m (1 σ, along x) from the attractant's middle, the middle of 40 of
    them 0.095 m: four of these are allowed.
    """
    first = trial_seeds(seed, PREY)[0] + 400
    prey = partial(swarm, count=PREY, seconds=LASTS, period=PERIOD)
    group = prey(first, lure)
    control = prey(first + PREY, uniform)
    middle = group.path[LATE].mean(axis=(0, 1))
    measured = [
        Measured("density around the predator, times uniform", density_ratio(group), least=3.0),
        Measured("the same without attractant", density_ratio(control), most=3.0),
        about("the prey's middle along the predator's way", float(middle[0]), 0.875, 0.38, "m"),
        about("and across it", float(middle[1]), 0.0, 0.38, "m"),
    ]

    def draw(figure: Figure) -> None:
        places = predators(np.array([0.0, LASTS]))
        for (axes, at), source in zip(begin_and_end(figure, group, LASTS), places.tolist(), strict=True):
            axes.plot(*at.T, ".", color="#0072b2", markersize=3, label="prey")
            axes.plot([0, source[0]], [0, source[1]], color="#d55e00", linewidth=0.8)
            axes.plot(*source, "s", color="#d55e00", markersize=6, label="predator", zorder=4)
            draw_circle(axes, REACH, tuple(source), color="#d55e00", linewidth=1.5, zorder=4)
        axes.legend(loc="upper right", fontsize=9)

    return Outcome(measured, positions(group), draw)
