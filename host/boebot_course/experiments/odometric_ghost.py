"""The odometric ghost: where a robot believes to be, when its odometry takes one wheel for larger than it is; E24.

With a wheel factor k = 1.02 of the left wheel and 1.00 of the right one, odometry adds, by (2.7) to (2.9),

    ds = (1.02 ds_L + ds_R) / 2,   dφ = (ds_R - 1.02 ds_L) / 2 R

The brain sees nothing but the ghost: it stops when the ghost has gone a metre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from boebot.cognition import Odometry
from boebot.view import scene, style
from boebot_course.experiment import Figure, Measured, Outcome, Variant, about, exactly, experiment
from boebot_course.experiments.straight_line import HOLD, LEAST, Straight, columns, drive, runner
from boebot_course.paths import floor
from boebot_course.trials import trial_seeds
from boebot_course.variants import varied

FACTOR = 1.02
RUNS = 5  # shieldbots


def ghost(trial: Straight) -> tuple[float, float, float]:
    """Where the brain believes to be at the end (m, m, rad), by its own cognitive process."""
    found = trial.brain.processes[1]
    assert isinstance(found, Odometry)
    return found.pose


def ghost_path(trial: Straight) -> NDArray[np.float64]:
    """The ghost's way (m), shape (n, 2): by odometry from the robot's readings, with that wheel factor."""
    estimate = trial.result.odometry
    assert estimate is not None
    if trial.result.layout is not None:  # the odometer's own: it has the factor
        return np.column_stack((estimate.x, estimate.y))
    assert trial.result.series.travel is not None
    left, right = trial.result.series.travel
    left = FACTOR * left
    turn = (right - left) / trial.result.robot.body.track_width_m
    middle, step = np.cumsum(turn) - turn / 2, (left + right) / 2
    return np.column_stack((np.cumsum(step * np.cos(middle)), np.cumsum(step * np.sin(middle))))


def error(trial: Straight) -> float:
    """Distance of the ghost from the robot at the end (m)."""
    return math.dist(ghost(trial)[:2], trial.end[:2])


def _draw(figure: Figure, trials: Sequence[Straight]) -> None:
    """Ways of robots and ghosts from above, with robot and ghost where the first ones end."""
    from boebot.view.painter import draw_robot, paint

    axes = figure.subplots()
    first = trials[0]
    reach = first.result.robot.body.radius_m
    ends = np.array([(x - reach, y - reach) for x, y in ((0, 0), (1, 0))])
    floor(axes, first.plan, *(trial.path for trial in trials), *map(ghost_path, trials), ends, ends + 2 * reach)
    for number, trial in enumerate(trials):
        axes.plot(*trial.path.T, color=style.END, lw=1.4, zorder=7, label="" if number else "robot")
        axes.plot(
            *ghost_path(trial).T, color=style.ESTIMATE, lw=1.4, ls=(0, (4, 2)), zorder=7,
            label="" if number else "ghost: where it believes to be",
        )  # fmt: skip
    draw_robot(axes, first.result.robot, first.start, style.START)
    draw_robot(axes, first.result.robot, first.end, style.END)
    paint(axes, scene.ghost_items(first.result.robot), pose=ghost(first))
    axes.legend(fontsize="small", ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))


# ---- the notes' robot ------------------------------------------------------------------------------------------------
# Both wheels turn alike: the robot goes straight, the ghost on an arc of curvature κ = 0.02 / (1.01 · 0.4 m) and a
# length 1.01 times as long. When the arc's chord is 0.98 m the robot has gone 0.9703 m, and the ghost is 2.4 cm to the
# right and 0.9 cm ahead of it.


def arc_error(believed: float, track_width: float) -> float:
    """Distance of ghost and robot (m) when the ghost is `believed` metres from the start and the robot went
    straight."""
    if FACTOR == 1:  # no arc: the ghost goes where the robot goes
        return 0.0
    curvature = (1 - FACTOR) / ((1 + FACTOR) / 2 * track_width)
    arc = 2 / abs(curvature) * math.asin(abs(curvature) * believed / 2)
    bearing = curvature * arc / 2
    truth = arc / ((1 + FACTOR) / 2)
    return math.dist((believed * math.cos(bearing), believed * math.sin(bearing)), (truth, 0.0))


def judge_notes(trial: Straight) -> list[Measured]:
    """What is asked, and the closed form."""
    odometer = trial.result.odometry
    assert odometer is not None
    expected = arc_error(math.hypot(*ghost(trial)[:2]), trial.result.robot.body.track_width_m)
    return [
        Measured("error of the estimate at the end", error(trial), "m", least=0.01),
        about("the same against its closed form", error(trial) - expected, 0, 1e-3, "m"),
        Measured("believed d at the stop command", trial.believed, "m", 0.980, 0.982),
        about(
            "what the brain believes off what the odometer measures",
            math.dist(ghost(trial), (odometer.x[-1], odometer.y[-1], odometer.heading[-1])), 0, 1e-3, "m",
        ),
    ]  # fmt: skip


# ---- shieldbots ------------------------------------------------------------------------------------------------------


def judge_shieldbots(trials: Sequence[Straight]) -> list[Measured]:
    """By the derivation in the criterion."""
    errors = [error(trial) for trial in trials]
    return [
        exactly("runs that stop", sum(trial.behavior.arrived for trial in trials), len(trials)),
        Measured("smallest error of the estimate at the end", min(errors), "m", least=0.01),
        about("mean error", float(np.mean(errors)), 0.090, 0.036, "m"),
        Measured("runs in which the robot ends to the left of its ghost", float(sum(
            trial.end[1] > ghost(trial)[1] for trial in trials)), least=len(trials)),
    ]  # fmt: skip


@experiment("E24", on={"arsim": Variant("arsim", False), "shieldbot": Variant("shieldbot (native)", True)})
def ghosts(on_board: bool, seed: int) -> Outcome:
    """The odometric ghost

    In the notes: section 5.4, code listing 5.4

    Figure: Robot and ghost, of shieldbots five, on a metre straight ahead by an odometer that takes the left wheel for
    2 % larger than it is.

    Expected: More than 0.01 m off after a metre, and as the closed form has it. The brain has the estimate alone.

    Expected on shieldbot: The brain keeps the ghost straight, so that the right wheel rolls 1.02 times as far as the
    left: an arc of 0.189 / m. After 0.98 m of the ghost it is 8.9 cm to the side and 1.5 cm back, 9.0 cm off. First
    edges anywhere within 3.25 mm make 1.2 cm (1 σ) of it uncertain, 0.6 misses or flickers a run of two edges each
    2.4 cm; the mean of five is known to 1.2 cm: three of them are allowed. In each run more than the notes' 1 cm.
    Servos are centred.
    """
    if not on_board:
        robot = varied("arsim", "arsim-1.02", odometer={"factor_left": FACTOR})
        trial = drive(runner(period=0.01), robot, 6.0, seed)
        return Outcome(judge_notes(trial), columns(trial), lambda figure: _draw(figure, [trial]))
    seeds = trial_seeds(seed, RUNS)
    trials = []
    for trial_seed in seeds:
        brain = runner(period=0.05, least=LEAST, hold=HOLD, factors=(FACTOR, 1.0))
        trials.append(drive(brain, "shieldbot", 14.0, trial_seed, "native"))
    data = {
        "seed": list(seeds),
        "true_x_m": [trial.end[0] for trial in trials],
        "true_y_m": [trial.end[1] for trial in trials],
        "believed_x_m": [ghost(trial)[0] for trial in trials],
        "believed_y_m": [ghost(trial)[1] for trial in trials],
        "error_m": [error(trial) for trial in trials],
    }
    return Outcome(judge_shieldbots(trials), data, lambda figure: _draw(figure, trials))
