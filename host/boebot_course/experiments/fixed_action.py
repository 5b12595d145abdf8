"""Fixed action patterns: released by a sign stimulus, they run to their end without it. Section 4.4.3 of the notes (egg
rolling of the goose), E34.

The robot stands still until something comes near; then it escapes: back for 0.4 s, a turn of 120 degrees, ahead for
0.3 s. In one run the stimulus stays, in the other it is gone at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot import run
from boebot.behaviors import Stop
from boebot.brain import Action, Brain, FixedActionPattern
from boebot.description.robots import load_robot
from boebot.result import RunResult
from boebot.robot import Robot
from boebot_course.experiment import Figure, Floats, Measured, Outcome, Variant, about, exactly, experiment
from boebot_course.trials import decisions, true_pose
from boebot_course.variants import arena_file

PERIOD = 0.02  # s
COMES, GONE = 1.0, 1.2  # s; when the stimulus begins to come, and when it begins to leave, if it does
# rad/s at motor signals of ±0.7: arsim's steady state, and by the servos' curve, 51.25 rpm tanh(140 µs / 78.5 µs), at
# wheels of 33.1 mm that are 105 mm apart
TURN_RATES = {"arsim": 4.447, "shieldbot": 51.25 * 2 * math.pi / 60 * math.tanh(140 / 78.5) * 0.0331 / 0.0525}
JUMP = 0.1  # s that either takes
ANGLE = 2 * math.pi / 3  # of the turn


def escape(robot: str) -> FixedActionPattern:
    """The pattern; its turn lasts as long as 120 degrees take on that robot."""
    rate = TURN_RATES[robot]
    actions = [Action(-0.5, -0.5, 0.4), Action(0.7, -0.7, ANGLE / rate), Action(0.5, 0.5, 0.3)]
    return FixedActionPattern(name="escape", actions=actions, releaser=something_near)


def something_near(robot: Robot) -> bool:
    """The sign stimulus: an infra-red sensor sees something."""
    return any(one.valid and one.detected for one in (robot.infrared_left, robot.infrared_right))


@dataclass(frozen=True)
class Escape:
    """A run, from the release of the pattern on."""

    result: RunResult
    released: float
    """s"""
    ended: float
    """s"""
    commands: NDArray[np.float64]
    """motor signals asked for, a row a step of the brain while the pattern lasts"""

    def span(self, values: Any) -> Floats:
        """The robot's readings at the ticks from release to end and two more steps, in which it shows at the wheels."""
        time = self.result.series.time
        return np.asarray(values)[(time >= self.released - 1e-9) & (time < self.ended + 2 * PERIOD - 1e-9)]

    @property
    def seen(self) -> Floats:
        """Whether a sensor saw something, at those ticks."""
        series = self.result.series
        return self.span(series.flag("infrared_left", "detected") | series.flag("infrared_right", "detected"))

    @property
    def turned(self) -> float:
        """Degrees, clockwise."""
        heading = true_pose(self.result, [self.released, self.ended]).heading
        return -math.degrees(math.remainder(float(heading[1] - heading[0]), 2 * math.pi))


def run_escape(robot: str, at: tuple[float, float, float], stays: bool, seed: int) -> Escape:
    """One run.

    Args:
        at: the stimulus, a disc of 0.1 m: its direction (rad), and how far its middle is before and while it is there.
    """
    description = load_robot(robot)
    pattern = escape(robot)
    brain = Brain([Stop(), pattern], period=PERIOD)
    with arena_file("stimulus", _arena(*at, stays)) as arena:
        result = run(brain, robot=description, arena=arena, seconds=4.0, seed=seed, pose=(0.0, 0.0, 0.0))
    record = decisions(result)
    begin = [switch.time for switch in record.switches if switch.on == "escape"]
    end = [switch.time for switch in record.switches if switch.off == "escape"]
    released, ended = (begin[0], end[0]) if begin and end else (math.nan, math.nan)
    during = np.flatnonzero((released - 1e-9 <= record.time) & (record.time < ended - 1e-9))
    commands = [result.record.steps[index][2:] for index in during]
    return Escape(result, released, ended, np.array(commands).reshape(-1, 2))


def _arena(direction: float, far: float, near: float, stays: bool) -> str:
    there = [(0.0, far), (COMES, far), (COMES + JUMP, near), (GONE, near)]
    if not stays:
        there.append((GONE + JUMP, far))
    points = ", ".join(
        f"{{ time_s = {time}, x_m = {r * math.cos(direction)}, y_m = {r * math.sin(direction)} }}" for time, r in there
    )
    return f'[[moving]]\nname = "stimulus"\nradius_m = 0.1\nrepeat = "once"\npath = [{points}]\n'


def differing(one: Floats, other: Floats) -> int:
    """Rows in which two sequences differ, and those that only one of them has."""
    both = min(len(one), len(other))
    differ = np.any(one[:both] != other[:both], axis=1)
    return int(differ.sum()) + abs(len(one) - len(other))


def compare(stays: Escape, gone: Escape, duration: float) -> list[Measured]:
    """What holds for every robot. `duration`: of the pattern (s)."""
    blind = 1 - float(np.mean(gone.seen)) if len(gone.seen) else 0.0
    return [
        exactly("commands that differ", differing(stays.commands, gone.commands), 0),
        about("the pattern lasts", gone.ended - gone.released, duration, 3 * PERIOD, "s"),
        Measured("share of it without stimulus", blind, least=0.5),
    ]


@experiment(
    "E34",
    on={
        "arsim": Variant("arsim", "arsim", (0.7854, 2.0, 0.5)),
        "shieldbot": Variant("shieldbot (native)", "shieldbot", (0.5, 1.0, 0.25)),
    },
)
def pattern(robot: str, at: tuple[float, float, float], seed: int) -> Outcome:
    """A fixed action pattern runs to its end without its stimulus

    In the notes: section 4.4.3, fixed action patterns

    Figure: Stimulus as a sensor sees it and motor signals asked for, with a stimulus that stays and with one that has
    gone before the pattern is through.

    Expected: Commands are the same without the stimulus; the pattern lasts as long as its parts, ± 3 steps.

    Expected on shieldbot: The turn lasts as long as 120 degrees take at 3.20 rad/s by the servos' curve. Commands
    and pulses follow from the brain's steps alone: none may differ. Each of three actions ends at the first step,
    every 0.02 s, after its time. Servos differ by 2.5 % of top speed and 3 % by direction, the mean of two by 2.8
    %: three times that, and up to two steps more, 7 degrees: 120 degrees ± 17.
    """
    both = stays, gone = [run_escape(robot, at, one, seed) for one in (True, False)]
    measured = compare(stays, gone, escape(robot).duration)
    if robot == "shieldbot":
        pulses = [
            np.column_stack(
                [one.span(one.result.series.number(name, "pulse")) for name in ("servo_left", "servo_right")]
            )
            for one in both
        ]
        measured.append(exactly("ticks whose servo pulses differ", differing(*pulses), 0))
        measured.append(about("turned", gone.turned, math.degrees(ANGLE), 17.0, "degrees"))
    series = [one.result.series for one in (stays, gone)]
    ticks = min(len(one) for one in series)
    data: dict[str, Any] = {"time_s": series[0].time[:ticks]}
    for name, one in zip(("stays", "gone"), series, strict=True):
        data[f"seen_{name}"] = (one.flag("infrared_left", "detected") | one.flag("infrared_right", "detected"))[
            :ticks
        ].astype(int)
        data[f"left_{name}"] = one.signals[0][:ticks]
        data[f"right_{name}"] = one.signals[1][:ticks]

    def draw(figure: Figure) -> None:
        rows = figure.subplots(2, 1, sharex=True, sharey=True)
        for axes, name, one in zip(rows, ("stays", "gone"), (stays, gone), strict=True):
            axes.fill_between(data["time_s"], -1, 1, where=data[f"seen_{name}"] > 0, color="#e69f00", alpha=0.3, lw=0)
            axes.plot(data["time_s"], data[f"left_{name}"], color="#0072b2", label="left motor signal")
            axes.plot(
                data["time_s"], data[f"right_{name}"], color="#d55e00", linestyle="--", label="right motor signal"
            )
            for time in (one.released, one.ended):
                axes.axvline(time, color="0.4", linewidth=0.8, linestyle=":")
            axes.set(ylabel="motor signal", ylim=(-1, 1))
            title = "the stimulus stays" if name == "stays" else "the stimulus goes"
            axes.set_title(f"{title} (shaded: a sensor sees it; dotted: the pattern begins and ends)", fontsize=9)
        rows[1].set(xlabel="time (s)", xlim=(0.8, 3.4))
        rows[0].legend(loc="upper right", fontsize=8)

    return Outcome(measured, data, draw)
