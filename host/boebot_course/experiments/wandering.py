"""Wandering, with and without avoidance of obstacles: section 5.3.2 of the notes, listings 5.1 and 5.2; E19 to E21."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from boebot import rates
from boebot.behaviors import Avoid, Wander
from boebot.brain import Brain, Utility
from boebot.cognition import near
from boebot.description.robots import RobotDescription
from boebot.view import style
from boebot_course.experiment import Axes, Figure, Measured, Outcome, Variant, about, exactly, experiment
from boebot_course.paths import draw_paths, floor
from boebot_course.trials import Alone, Trial, trial_seeds, try_once
from boebot_course.variants import narrow_arsim, scaled_arena

STEP = 0.01  # s, the notes'
STEPS = 400_000

# ---- the machine by itself -------------------------------------------------------------------------------------------


def stays(wander: Wander, seed: int) -> tuple[list[int], list[int], list[bool]]:
    """Steps that each stay in state 1 (forward) and in state 2 (turning) lasted, and whether each turn was to the left.

    The behavior looks at nothing.
    """
    alone = Alone(wander, STEP, seed)
    lengths: dict[str, list[int]] = {"time_to_turn": [], "time_to_stop_turning": []}
    lefts: list[bool] = []
    state, length = wander.machine.state, 0
    for _ in range(STEPS):
        alone.step()
        length += 1
        if wander.machine.state != state:
            if state in lengths:
                lengths[state].append(length)
            if state == "time_to_turn":
                left, right = alone.robot.command[1:]
                lefts.append(left < right)  # by (2.19): the right wheel ahead turns counter-clockwise
            state, length = wander.machine.state, 0
    return lengths["time_to_turn"], lengths["time_to_stop_turning"], lefts


def judge_stays(forward: list[int], turning: list[int], lefts: list[bool]) -> list[Measured]:
    """What is asked of them."""
    return [
        about("mean steps in state 1, forward", float(np.mean(forward)), 100, 5),
        about("mean steps in state 2, turning", float(np.mean(turning)), 33.3, 2),
        about("share of turns to the left", float(np.mean(lefts)), 0.5, 0.03),
    ]


@experiment("E19")
def stay_lengths(seed: int) -> Outcome:
    """Wandering: stays in its states are geometric

    In the notes: section 5.3.2, code listings 5.1 and 5.2

    Figure: Steps that wandering drives ahead, and turns, before it changes: histograms of 400,000 steps of 0.01 s,
    and the geometric law of the listing's probabilities.

    Expected: Means of 1 / 0.01 = 100 and 1 / 0.03 = 33.3 steps, known to 1.8 and 0.6: ± 5 and ± 2. Half turn left.
    """
    forward, turning, lefts = stays(Wander(), seed)
    count = min(len(forward), len(turning))

    def draw(figure: Figure) -> None:
        rows = (
            ("state 1: forward", np.array(forward), 0.01, 500, 20),
            ("state 2: turning", np.array(turning), 0.03, 170, 8),
        )
        for axes, (name, values, chance, longest, width) in zip(figure.subplots(1, 2), rows, strict=True):
            axes.hist(values, bins=np.arange(0.5, longest, width), density=True, color="C0", alpha=0.55)
            steps = np.arange(1, longest)
            axes.plot(steps, chance * (1 - chance) ** (steps - 1), color="C1", label=f"{chance:g} (1 - {chance:g})ⁿ⁻¹")
            axes.axvline(values.mean(), color="0.3", ls="--", lw=1, label=f"mean {values.mean():.1f}")
            axes.set(title=f"{name}, {len(values):,} times", xlabel="length n (steps of 0.01 s)", ylabel="share a step")
            axes.legend(fontsize="small")

    data = {"forward_steps": forward[:count], "turning_steps": turning[:count], "left": lefts[:count]}
    return Outcome(judge_stays(forward, turning, lefts), data, draw)


# ---- on robots -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A robot in an arena, and how its brain's chances and the run's length follow from how fast it is."""

    robot: str | RobotDescription
    on: str | None = None
    scale: float = 1.0
    """lengths of the arena against ARSim's"""
    turn: float = 0.01
    """probability to begin to turn in each 0.01 s"""
    stop_turn: float = 0.03
    """and to stop turning"""
    period: float = STEP
    """s, of the brain"""
    seconds: float = 30.0
    runs: int = 12


NOTES = Setting(robot="arsim")
NARROW = Setting(robot=narrow_arsim())
# scaled as E20 says
SHIELDBOT = Setting(
    robot="shieldbot", on="native", scale=0.35, turn=0.0064, stop_turn=0.0215, period=0.05, seconds=47.0
)

Make = Callable[[Setting], Brain]


def wanderer(setting: Setting) -> Brain:
    """Wandering alone."""
    return Brain([_wander(setting)], period=setting.period)


def avoider(setting: Setting) -> Brain:
    """Wandering and avoiding: tanh(10 near - 0.5) exceeds tanh(0.5) where near exceeds 0.10 (boebot.behaviors.avoid
    says why)."""
    avoid = Avoid(utility=Utility(b=-0.5, w={"near": 10.0}, tau=0.05))
    return Brain([_wander(setting), avoid], [near()], period=setting.period)


def _wander(setting: Setting) -> Wander:
    return Wander(
        turn_probability=setting.turn, stop_turn_probability=setting.stop_turn, utility=Utility(b=0.5, tau=0.2)
    )


def trials(make: Make, setting: Setting, seed: int) -> list[Trial]:
    """The setting's runs, each with its own brain and seed."""
    with scaled_arena("arsim", setting.scale) as arena:
        return [
            try_once(make(setting), setting.robot, arena, setting.seconds, on=setting.on, seed=trial_seed)
            for trial_seed in trial_seeds(seed, setting.runs)
        ]


def turns_begun(done: list[Trial], setting: Setting) -> tuple[int, float]:
    """How often the runs' brains began to turn, and how long in all they were ahead, from where they could (s)."""
    turns = steps = 0
    for trial in done:
        ahead = np.array([left == right for *_, left, right in trial.result.record.steps])
        turns += int((ahead[:-1] & ~ahead[1:]).sum())
        steps += int(ahead[:-1].sum())
    return turns, steps * setting.period


def judge_alone(done: list[Trial], setting: Setting) -> list[Measured]:
    """Without avoidance it is for empty space only: of 12 runs at least 10 end at something. And it is wandering: in
    each step ahead it begins to turn with the listing's probability, in the whole of the runs.

    Of n steps, each with probability p, np begin a turn, give or take √(np (1 - p)): 4 of these are allowed.
    """
    turns, ahead = turns_begun(done, setting)
    chance = 1 - (1 - setting.turn) ** (setting.period / STEP)
    expected, steps = chance / setting.period, ahead / setting.period
    sigma = math.sqrt(chance * (1 - chance) / steps) / setting.period
    return [
        Measured("runs that collide", sum(trial.has_collided for trial in done), least=round(10 / 12 * len(done))),
        about("turns begun in each second ahead", turns / ahead, expected, 4 * sigma, "1/s"),
    ]


def judge_avoiding(done: list[Trial]) -> list[Measured]:
    """No run collides. In most of them avoidance had something to do, as wandering alone collides in most."""
    needed = sum(trial.times_on("avoid") > 0 for trial in done)
    return [
        exactly("runs that collide", sum(trial.has_collided for trial in done), 0),
        Measured("runs in which it avoided something", needed, least=round(10 / 12 * len(done))),
    ]


def _data(done: list[Trial], seed: int) -> dict[str, object]:
    return {
        "seed": list(trial_seeds(seed, len(done))),
        "first_contact_s": [trial.first_contact for trial in done],
        "true_distance_m": [trial.way for trial in done],
        "times_avoided": [trial.times_on("avoid") for trial in done],
    }


@experiment(
    "E20",
    on={
        "arsim": Variant("arsim", NOTES, slow=True),
        "shieldbot": Variant("shieldbot (native)", SHIELDBOT, slow=True),
    },
)
def wandering(setting: Setting, seed: int) -> Outcome:
    """Wandering alone ends at a wall

    In the notes: section 5.3.2, code listing 5.2

    Figure: Wandering without avoidance, in ARSim's arena or at the shieldbot's scale: paths up to the first contact,
    and how many runs are free of contact yet.

    Expected: At least 10 of 12 runs collide, and that by wandering: of n steps ahead, each with probability p,
    np ± 4 √(np (1 - p)) begin a turn, as the listing has it.

    Expected on shieldbot: Lengths of the arena 0.35 times ARSim's, as the robots' radii (0.07 m, 0.20 m). At motor
    signal 0.5 its servos run at 0.178 m/s tanh(200 · 0.5 / 78.5) = 0.152 m/s against 0.682 m/s, so that everything
    takes 0.35 · 0.682 / 0.152 = 1.57 times as long: 47 s a run, turn_probability 0.01 / 1.57; it turns on the spot
    with 3.19 against 4.447 rad/s: stop_turn_probability 0.03 · 3.19 / 4.447. Paths are then alike.
    """
    done = trials(wanderer, setting, seed)

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(3, 2))
        draw_paths(left, done)
        left.set_title(f"{len(done)} paths up to the first contact")
        _draw_survivors(right, done, setting.seconds)

    return Outcome(judge_alone(done, setting), _data(done, seed), draw)


def _draw_survivors(axes: Axes, done: list[Trial], seconds: float) -> None:
    """Share of runs without a contact so far, against time, with its interval."""
    times = np.sort([trial.first_contact for trial in done if trial.has_collided])
    counts = [*range(len(done), len(done) - len(times) - 1, -1), len(done) - len(times)]
    least, most = np.transpose([rates.interval(count, len(done)) for count in counts])
    steps = [0, *times, seconds]
    axes.fill_between(steps, least, most, step="post", color="0.88", label="95 %")
    axes.step(steps, np.array(counts) / len(done), where="post")
    if len(times) > len(done) / 2:
        middle = float(np.median([trial.first_contact if trial.has_collided else math.inf for trial in done]))
        axes.axvline(middle, color="0.5", ls="--", lw=1, label=f"median {middle:.1f} s")
    axes.legend(fontsize="small")
    axes.set(xlabel="time (s)", ylabel="share of runs without contact", ylim=(0, 1.02), xlim=(0, seconds))


@experiment(
    "E21",
    on={
        "arsim": Variant("arsim", NARROW, slow=True),
        "shieldbot": Variant("shieldbot (native)", SHIELDBOT, slow=True),
        "avr": Variant("shieldbot (avr)", replace(SHIELDBOT, on="avr", runs=4), slow=True),
    },
)
def avoiding(setting: Setting, seed: int) -> Outcome:
    """Wandering and avoiding

    In the notes: section 5.3.2 and Fig. 5.1

    Figure: Wandering and avoiding in ARSim's arena, threshold 0.10: all paths, and the first one with the behavior
    that was active.

    Expected: IR sensors at ±0.3324 rad. No run of 12 collides. A threshold of 0.3 does not keep that (1 to 3 collide
    at most seeds), nor quite does one of 0.15 (1 of 60 runs grazes a pillar's corner). Things are heeded from 0.10 on
    here: 1 run of 420, of the seeds 1 to 35, grazes one after it has turned to where no beam had looked.

    Expected on shieldbot: From seeing to turning it takes at most 50 ms (IR) + 50 ms (brain) + 50 ms (utility) +
    75 ms (servo), 3.4 cm at 0.152 m/s; what lies in its way is in the beam of an IR pair or the Ping with at least
    9 cm to go; a round body that turns on the spot touches nothing. So no run may collide. Its arena and chances are
    those of E20.

    Expected on avr: As on shieldbot; 4 runs.
    """
    # IR beams: 0.25 to 0.65 rad from (0.05, 0.04) m, 0.20 m long; Ping: ±0.35 rad, nearness 0.10 at 0.36 m.
    done = trials(avoider, setting, seed)

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        draw_paths(left, done)
        left.set_title(f"{len(done)} paths of {setting.seconds:g} s, true contacts ×")
        _draw_activity(right, done[0])

    return Outcome(judge_avoiding(done), _data(done, seed), draw)


def _draw_activity(axes: Axes, trial: Trial) -> None:
    """One path, with the behavior that drove."""
    from boebot.view.painter import draw_robot

    floor(axes, trial.plan)
    avoids: NDArray[np.bool_] = trial.when_active("avoid")
    for name, active, colour in (("wander", ~avoids, style.END), ("avoid", avoids, style.ESTIMATE)):
        shown = np.where(active[:, None], trial.path, np.nan)
        axes.plot(*shown.T, color=colour, lw=2.6 if name == "avoid" else 1.4, label=name, zorder=7)
    for pose, colour in ((trial.start, style.START), (trial.end, style.END)):
        draw_robot(axes, trial.result.robot, pose, colour, plan=trial.plan)
    axes.legend(fontsize="small", ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.13))
    axes.set_title(f"the first path, {trial.times_on('avoid')} times avoided")
