"""Phototaxis: two light sensors, crossed excitation, to the lamp from anywhere (section 4.4.2 of the notes; E27).

The behavior itself is boebot.behaviors.phototaxis.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from boebot import rates
from boebot.behaviors import Phototaxis
from boebot.brain import Brain
from boebot.description.robots import RobotDescription
from boebot.devices.light import Phototransistor
from boebot.view import style
from boebot_course.experiment import Figure, Measured, Outcome, Variant, about, experiment
from boebot_course.paths import floor
from boebot_course.trials import Steady, Trial, trial_seeds, try_once
from boebot_course.variants import SMALL_RADIUS, arena_file, at_angle, small_arsim, varied

STARTS = 60
AWAY_M, REACHED_M = 2.0, 0.15
SIGNAL = 0.5  # s_0; k = 0.6 s_0
LAMP = "[[light]]\nx_m = 0\ny_m = 0\npower_w = 20\n"


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A robot, how long it may take, and what is dark to it."""

    robot: RobotDescription
    on: str | None
    seconds: float
    straight: float
    """time of the straight way to the lamp, expected (s), within 4 %"""
    dark: float = 0.0
    """brightness of both sensors together"""


def _small_arsim() -> RobotDescription:
    """The notes' robot in the size of a Boe-Bot with two phototransistors on its rim, turned 0.5 rad outwards as the
    shieldbot's are."""
    left, right = (Phototransistor(**at_angle(SMALL_RADIUS, angle)) for angle in (0.5, -0.5))
    return small_arsim(0.3, light_left=left, light_right=right)


# Ambient light of irradiance 1: 667 / s of each sensor (decay 1.5 ms); the lamp, 20 W at 2 m, adds 5 · 667 / s.
# The straight way: 1.85 m at 0.15 m/s; at 0.178 m/s tanh(200 · 0.5 / 78.5) = 0.152 m/s, and 0.1 s.
ARSIM = Setting(robot=_small_arsim(), on=None, seconds=24.0, straight=1.85 / 0.15)
SHIELDBOT = Setting(
    robot=varied("shieldbot", "shieldbot-lights", light_left={"on": True}, light_right={"on": True}),
    on="native",
    seconds=24.0,
    straight=1.85 / 0.152 + 0.1,
    dark=2000.0,
)


def time_to_lamp(trial: Trial) -> float:
    """When the robot's middle was first within 0.15 m of the lamp (s); infinite: never."""
    near = np.flatnonzero(np.hypot(*trial.path.T) < REACHED_M)
    return float(trial.time[near[0]]) if len(near) else math.inf


def trials(setting: Setting, seed: int, *, flee: bool = False, starts: int = STARTS) -> list[Trial]:
    """Runs from all around the lamp, headings by chance."""
    chance = random.Random(f"taxis {seed}")
    done = []
    with arena_file("lamp", LAMP) as arena:
        for trial_seed in trial_seeds(seed, starts):
            bearing, heading = (chance.uniform(-math.pi, math.pi) for _ in range(2))
            pose = (AWAY_M * math.cos(bearing), AWAY_M * math.sin(bearing), heading)
            brain = Brain([Phototaxis(signal=SIGNAL, dark=setting.dark, flee=flee)])
            terms = {"on": setting.on, "seed": trial_seed, "pose": pose}
            done.append(try_once(brain, setting.robot, arena, setting.seconds, **terms))
    return done


def straight_time(setting: Setting) -> float:
    """What the same robot needs straight ahead (s), its parts nominal."""
    robot = msgspec.structs.replace(setting.robot, unit=0) if setting.robot.has_board else setting.robot
    with arena_file("lamp", LAMP) as arena:
        pose = (-AWAY_M, 0.0, 0.0)
        trial = try_once(
            Brain([Steady(left=SIGNAL, right=SIGNAL)]), robot, arena, setting.seconds, on=setting.on, pose=pose
        )
    return time_to_lamp(trial)


def judge(setting: Setting, times: Sequence[float], straight: float) -> list[Measured]:
    """What is asked of 60 starts."""
    reached = sum(time < math.inf for time in times)
    return [
        Measured("starts that reach the lamp", reached, least=round(58 / 60 * len(times))),
        Measured("median time against the straight way's", float(np.median(times)) / straight, most=1.2),
        about("time of the straight way", straight, setting.straight, 0.04 * setting.straight, "s"),
    ]


def _draw(figure: Figure, done: Sequence[Trial], times: Sequence[float], straight: float) -> None:
    """Ways up to the lamp, and the times that they took."""
    from matplotlib.patches import Circle

    from boebot.view.painter import draw_robot

    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    floor(left, done[0].plan, np.array([(-AWAY_M, -AWAY_M), (AWAY_M, AWAY_M)]))
    for trial, time in zip(done, times, strict=True):
        until = int(np.searchsorted(trial.time, time)) + 1
        left.plot(*trial.path[:until].T, color=style.END if time < math.inf else style.ESTIMATE, lw=0.8, zorder=6)
        left.plot(*trial.path[0], ".", color=style.START, ms=4, zorder=7)
    left.add_patch(Circle((0, 0), REACHED_M, fill=False, ls="--", ec=style.FAINT, zorder=8))
    draw_robot(left, done[0].result.robot, done[0].start, style.START)
    reached = [time for time in times if time < math.inf]
    left.set_title(f"starts that reach the lamp: {rates.in_words(len(reached), len(times))}")
    right.hist(reached, bins=24)
    right.axvline(straight, color="0.3", ls="--", lw=1, label=f"straight {straight:.1f} s")
    if reached:
        right.axvline(float(np.median(times)), color="C1", lw=1.5, label=f"median {np.median(times):.1f} s")
    right.set(xlabel="time to the lamp (s)", ylabel="starts", xlim=(0, None))
    right.legend(fontsize="small")


@experiment(
    "E27",
    on={
        "arsim": Variant("arsim in the size of a Boe-Bot", ARSIM, slow=True),
        "shieldbot": Variant("shieldbot (native)", SHIELDBOT, slow=True),
    },
)
def taxis(setting: Setting, seed: int) -> Outcome:
    """Taxis: to the lamp from everywhere

    In the notes: section 4.4.2

    Figure: Phototaxis from 60 places 2 m from a lamp, headings by chance: paths until 0.15 m from it, and times.

    Expected: At least 58 of 60 arrive; the median in 1.2 times the straight time, 1.85 m / 0.15 m/s = 12.3 s.

    Expected on shieldbot: Up to 2000 / s of both sensors together it is dark (ambient 1333 / s ± 7 σ of 10 % unlike
    sensors). Sensors unlike by 10 % (1 σ) each make a lamp ahead seem 0.07 / tan 0.5 = 0.13 rad beside, servos
    unlike by 2.9 % another 0.1 rad: the way is a spiral into the lamp, 1 / cos 0.16 = 1.3 % longer, at 3 σ 13 %.
    Turning towards the lamp takes up to 1 s in the dark (1.9 rad/s) and an arc of 0.15 m of radius, 0.2 m at a
    right angle, of 1.85 m of way: 1.2 times the straight time is kept by the median, and 24 s by all but the
    rarest.
    """
    done = trials(setting, seed)
    times, straight = [time_to_lamp(trial) for trial in done], straight_time(setting)
    poses = [trial.start for trial in done]
    data = {
        "seed": list(trial_seeds(seed, len(done))),
        "true_x_m": [x for x, _, _ in poses],
        "true_y_m": [y for _, y, _ in poses],
        "heading_rad": [heading for _, _, heading in poses],
        "time_s": times,
    }
    return Outcome(judge(setting, times, straight), data, lambda figure: _draw(figure, done, times, straight))
