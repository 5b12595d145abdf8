"""A patrol with localization and without: section 6.3 of the notes, Figs. 6.14 and 6.15; E55.

The robot drives round after round through the arena `blocks`; every five seconds it stops and corrects where it
believes to be. Its odometry goes on drifting meanwhile, so that one run shows both. A Shield-Bot with a sonar on a
turret does the same on the emulated AVR.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from boebot.brain import Brain, CognitiveProcess, Utility
from boebot.cognition import Odometry
from boebot.navigation import Estimator, FollowPath, LineMap, Localization, RandomSearch
from boebot.navigation.frames import Pose, composed
from boebot.robot import Robot
from boebot_course.experiment import Figure, Floats, Measured, Outcome, Variant, experiment
from boebot_course.paths import floor
from boebot_course.trials import Trial, trial_seeds, true_pose, try_once

ARENA = "blocks"
ROUND = ((2.8, 1.2), (2.8, 2.7), (4.4, 2.8), (4.4, 4.65), (1.2, 4.65), (0.8, 2.8), (0.8, 0.8))  # m
START = (0.8, 0.8, 0.0)  # m, m, rad
JUMP = 0.05  # m: from here on a correction is one that can be seen
WINDOW = 0.4  # m to each side of the correction that is drawn enlarged


@dataclass(kw_only=True)
class Patrol(FollowPath):
    """Round after round, by what localization says."""

    localization: Localization

    def forget(self) -> None:
        super().forget()
        self._next, self._scans = 0, -1

    def step(self, robot: Robot) -> None:
        scans = len(self.localization.estimates)
        if self.arrived:
            self._next = (self._next + 1) % len(ROUND)
        if self.arrived or scans != self._scans:
            self._scans = scans
            self.follow(self.localization.to_odometry([ROUND[self._next]]))
        super().step(robot)


@dataclass(kw_only=True)
class Watch(CognitiveProcess):
    """Writes down where the robot believes to be."""

    localization: Localization

    def enter(self, robot: Robot) -> None:
        self._begin = self.localization.correction

    def forget(self) -> None:
        self.times: list[float] = []
        self.poses: list[tuple[float, ...]] = []
        """by odometry alone (m, m, rad), and by localization"""

    def step(self, robot: Robot) -> None:
        if robot.time > 0:
            self.times.append(robot.time)
            self.poses.append((*composed(self._begin, self.other(Odometry).pose), *self.localization.pose))


@dataclass(frozen=True)
class Errors:
    """How far from the truth the robot believes to be (m), over time (s)."""

    trial: Trial
    times: Floats
    poses: Floats
    """as `Watch` has them"""
    odometry: Floats
    localization: Floats
    jumps: Floats
    """of each scan: how far the estimate went (m)"""


def patrolled(
    seed: int, robot: str, seconds: float, every: float, estimator: Estimator, on: str | None = None
) -> Errors:
    """One run. `every`: s from scan to scan."""
    localization = Localization(
        plan=LineMap.of(ARENA),
        start=START,
        every=every,
        estimator=estimator,
        utility=Utility(b=-1.0, w={"due": 3.0}, tau=0.05),
    )
    watch = Watch(localization=localization)
    patrol = Patrol(localization=localization, speed=0.25, turn_speed=0.1, arrival=0.1, utility=Utility(b=0.5))
    brain = Brain([Odometry(), localization, watch, patrol], [localization.due_variable])
    trial = try_once(brain, robot, ARENA, seconds, pose=START, seed=seed, on=on)
    times, poses = np.array(watch.times), np.array(watch.poses)
    true = true_pose(trial.result, times)
    steps = np.hypot(*(poses[1:, 3:5] - poses[:-1, 3:5]).T) - np.hypot(*(poses[1:, :2] - poses[:-1, :2]).T)
    scanned = np.searchsorted(times, [time for time, _ in localization.estimates])
    return Errors(
        trial,
        times,
        poses,
        np.hypot(poses[:, 0] - true.x, poses[:, 1] - true.y),
        np.hypot(poses[:, 3] - true.x, poses[:, 4] - true.y),
        np.array([steps[max(0, at - 1) : at + 2].max() for at in scanned if at < len(steps)]),
    )


@experiment(
    "E55",
    on={
        "roller": Variant("roller", "roller", None, 12, 120.0, 5.0, (0.1, 0.1, 0.1), slow=True),
        "avr": Variant(
            "shieldbot-turret (avr)", "shieldbot-turret", "avr", 5, 240.0, 10.0, (0.15, 0.15, 0.3), slow=True
        ),
    },
)
def patrol(
    robot: str,
    on: str | None,
    count: int,
    seconds: float,
    every: float,
    box: Pose,
    seed: int,
) -> Outcome:
    """A patrol with localization and without

    In the notes: section 6.3, Figs. 6.14 and 6.15

    Figure: Above: true path of the first run (green) and the path as believed (red), by odometry alone, with
    localization, and enlarged about its largest correction. Below: how far from the truth it believes to be; all
    runs, the first one dark. It scans every five seconds, with a turret every ten.

    Expected: Medians of the greatest error of twelve runs: at least 0.5 m by odometry alone (0.73 m computed from its
    noise), at most 0.2 m with localization, whose corrections can be seen as jumps. In five seconds the heading drifts
    by 0.001 √200 / 0.24 = 0.06 rad (one sigma); the search finds back from 0.15 rad.

    Expected on avr: As the notes' figure shows it: the greatest error of a run with localization is less than half of
    that by odometry alone; medians.
    """
    seeds = trial_seeds(seed, count)
    runs = [patrolled(number, robot, seconds, every, RandomSearch(box=box), on) for number in seeds]
    alone = [float(run.odometry.max()) for run in runs]
    corrected = [float(run.localization.max()) for run in runs]
    by, with_it = float(np.median(alone)), float(np.median(corrected))
    worst = Measured("worst of all runs with localization", max(corrected), "m")
    if on is None:
        jumps = [int((run.jumps > JUMP).sum()) for run in runs]
        measured = [
            Measured("greatest error by odometry alone, median", by, "m", least=0.5),
            Measured("greatest error with localization, median", with_it, "m", most=0.2),
            worst,
            Measured("corrections of more than 0.05 m, fewest in a run", min(jumps), least=1),
            Measured("scans in a run, mean", float(np.mean([len(run.jumps) for run in runs]))),
        ]
        data = {"greatest_error_by_odometry_m": alone, "greatest_error_with_localization_m": corrected, "jumps": jumps}
    else:
        measured = [
            Measured("greatest error by encoders alone, median", by, "m", least=0.2),
            Measured("greatest error with localization, median", with_it, "m"),
            Measured("the one as a share of the other", with_it / by, most=0.5),
            worst,
        ]
        data = {"greatest_error_by_encoders_m": alone, "greatest_error_with_localization_m": corrected}
    return Outcome(measured, data, lambda figure: _draw(figure, runs))


def _draw(figure: Figure, runs: list[Errors]) -> None:
    figure.set_figheight(6.4)
    panels = figure.subplot_mosaic([["alone", "localized", "jump"], ["errors"] * 3], height_ratios=(1.1, 1))
    poses, right = runs[0].poses, panels["errors"]
    titles = {"alone": "odometry alone", "localized": "with localization", "jump": "its largest correction"}
    for name, title in titles.items():
        floor(axes := panels[name], runs[0].trial.plan)
        believed = poses[:, :2] if name == "alone" else poses[:, 3:5]
        axes.plot(*runs[0].trial.path.T, color="#009e73", lw=1.4, zorder=6, label="true path")
        axes.plot(*believed.T, color="#d55e00", lw=0.9, zorder=7, label="path as believed")
        axes.set_title(title, fontsize=10)
    at = poses[np.hypot(*np.diff(poses[:, 3:5], axis=0).T).argmax(), 3:5]
    axes.set(xlim=(at[0] - WINDOW, at[0] + WINDOW), ylim=(at[1] - WINDOW, at[1] + WINDOW))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=9)
    for number, run in reversed(list(enumerate(runs))):
        strength = 1.0 if number == 0 else 0.25
        for name, errors, colour in (
            ("odometry alone", run.odometry, "#d55e00"),
            ("with localization", run.localization, "#0072b2"),
        ):
            right.plot(run.times, errors, color=colour, alpha=strength, lw=1.1, label=name if number == 0 else None)
    right.set(xlabel="time (s)", ylabel="distance from the truth (m)", ylim=(0, None), xlim=(0, runs[0].times[-1]))
    right.legend(loc="upper left", fontsize=9, frameon=False)
