"""Pictures of trials: paths in their arena, seen from above. Not an experiment itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from boebot.arenas.floor_plan import FloorPlan
from boebot.view import scene, style
from boebot_course.experiment import Axes, Floats
from boebot_course.trials import Trial


def floor(axes: Axes, plan: FloorPlan, *places: Floats) -> None:
    """Draws an arena, wide enough for its walls or, in the open, for those places (m, shape (n, 2))."""
    from boebot.view.painter import draw_arena, frame

    if plan.outlines:
        low, high = scene.plan_bounds(plan, [])
    else:
        points = np.vstack(places)
        edge = 0.15 * float(np.ptp(points, axis=0).max())
        low, high = points.min(axis=0) - edge, points.max(axis=0) + edge
    frame(axes, low, high)
    draw_arena(axes, plan)


def draw_paths(axes: Axes, trials: Sequence[Trial]) -> None:
    """All paths, each up to its first contact, which a cross marks; the robot stands where the first one begins."""
    from boebot.view.painter import draw_robot

    floor(axes, trials[0].plan)
    for number, trial in enumerate(trials, 1):
        last = np.searchsorted(trial.time, trial.first_contact) if trial.has_collided else len(trial.time) - 1
        path = trial.path[: int(last) + 1]
        axes.plot(*path.T, color=style.colour(number), lw=1.1, alpha=0.85, zorder=6)
        if trial.has_collided:
            axes.plot(*path[-1], "x", color=style.CONTACT, ms=7, mew=1.8, zorder=13)
    draw_robot(axes, trials[0].result.robot, trials[0].start, style.START)
