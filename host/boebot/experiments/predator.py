"""Predator and prey: M. xanthus feeds on E. coli, moves some 200 times slower, and lures it. Section 4.4.2 of the
notes.

The predator is the source of what its prey takes for food: prey that follows (4.1) up the attractant gathers around it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from boebot.experiments.chemotaxis import SIZE, SPEED, Swarm, begin_and_end, draw_circle, positions, swarm
from boebot.experiments.experiment import Measured, Outcome, Progress, about, experiment, with_progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REACH = 0.5  # around the predator
SLOWER = 200.0
COUNT, SECONDS = 400, 10.0


def density_ratio(group: Swarm) -> float:
    """Prey within `REACH` of the predator at the end, against what there would be if it were spread evenly."""
    near = np.hypot(*(group.ended - group.source).T) < REACH
    return float(near.sum() / (len(group.ended) * math.pi * REACH**2 / SIZE**2))


@experiment(
    "predator-prey",
    title="M. xanthus lures E. coli",
    source="section 4.4.2",
    caption="Bacteria before and after 10 s, lured by a predator 200 times slower; circle: what is near to it.",
)
def lure(seed: int, progress: Progress) -> Outcome:
    groups = [
        swarm(np.random.default_rng([seed, 200 + number]), count=COUNT, seconds=SECONDS, drift=SPEED / SLOWER)
        for number in with_progress(range(5), progress)
    ]
    control = swarm(np.random.default_rng([seed, 300]), count=10 * COUNT, seconds=SECONDS, uniform=True)
    measured = [
        Measured("density around the predator, times uniform", min(map(density_ratio, groups)), least=3.0),
        # 4000 bacteria leave the square by diffusion at its edge only; within the reach are 31, give or take 18 %
        about("the same without attractant", density_ratio(control), 1.0, 0.55),
    ]
    one = groups[0]

    def draw(figure: Figure) -> None:
        for (axes, at), source in zip(begin_and_end(figure, one), ((0.0, 0.0), one.source), strict=True):
            axes.plot(*at.T, ".", color="#0072b2", markersize=3, label="prey")
            axes.plot(*source, "s", color="#d55e00", markersize=6, label="predator", zorder=4)
            draw_circle(axes, REACH, source, color="#d55e00", linewidth=1.5, zorder=4)
        axes.legend(loc="upper right", fontsize=9)

    return Outcome(measured, positions(one), draw)
