"""Trials: one brain run again and again on a robot in an arena, and what the world knows of each run afterwards.

Not an experiment itself. Robots and arenas made for one experiment are those of `variants`; `paths` draws trials.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot.arenas.floor_plan import FloorPlan
from boebot.brain import Brain, CognitiveProcess, MotorBehavior
from boebot.description.equipment import Equipment
from boebot.description.robots import RobotDescription, load_robot
from boebot.link import messages
from boebot.record.brain_record import BrainRecord
from boebot.record.truth import Pose, interpolated
from boebot.result import RunResult
from boebot.robot import Observation, Robot
from boebot.running.runner import run
from boebot_course.experiment import Floats

PER_SEED = 1000


@dataclass(frozen=True)
class Trial:
    """One run and the brain that made it."""

    result: RunResult
    brain: Brain
    """as it was at the end"""

    @cached_property
    def time(self) -> Floats:
        """s since the run began, of each sample of the path"""
        return np.asarray(self.result.series.time)

    @cached_property
    def path(self) -> Floats:
        """The true way of the robot's middle (m), shape (n, 2)."""
        return np.column_stack((self._true_pose.x, self._true_pose.y))

    @property
    def start(self) -> tuple[float, float, float]:
        """Where the robot began: m, m, rad."""
        return self._pose(0)

    @property
    def end(self) -> tuple[float, float, float]:
        """Where it ended: m, m, rad."""
        return self._pose(-1)

    def _pose(self, index: int) -> tuple[float, float, float]:
        pose = self._true_pose
        return float(pose.x[index]), float(pose.y[index]), float(pose.heading[index])

    @property
    def _true_pose(self) -> Pose:
        assert self.result.true_pose is not None, "experiments run in the simulator"
        return self.result.true_pose

    @property
    def plan(self) -> FloorPlan:
        """Walls and obstacles of its arena."""
        assert self.result.truth is not None
        return self.result.truth.plan

    @cached_property
    def first_contact(self) -> float:
        """When the body first touched something (s); NaN: never."""
        truth = self.result.truth
        assert truth is not None
        times = truth.time[truth.contact] - self.result.clock_offset
        inside = times[(times >= 0) & (times <= self.result.run_time)]
        return float(inside[0]) if len(inside) else math.nan

    @property
    def has_collided(self) -> bool:
        """The body touched something during the run."""
        return not math.isnan(self.first_contact)

    @property
    def way(self) -> float:
        """How far it went (m)."""
        return float(np.hypot(*np.diff(self.path, axis=0).T).sum())

    def times_on(self, process: str) -> int:
        """How often a motor behavior became active."""
        return sum(switch.on == process for switch in decisions(self.result).switches)

    def when_active(self, process: str) -> NDArray[np.bool_]:
        """At which samples of the path that motor behavior was active."""
        record = decisions(self.result)
        active = record.motor == record.names.behaviors.index(process)
        last = np.searchsorted(record.time, self.time, side="right") - 1
        return np.asarray(active[np.clip(last, 0, len(record) - 1)])


@dataclass(kw_only=True)
class Log(CognitiveProcess):
    """Keeps what `read` gives in each of its steps, in `rows`."""

    read: Callable[[CognitiveProcess, Robot], Any]

    def forget(self) -> None:
        self.rows: list[Any] = []

    def step(self, robot: Robot) -> None:
        self.rows.append(self.read(self, robot))


@dataclass(kw_only=True)
class Steady(MotorBehavior):
    """Drives with the same motor signals all the time."""

    left: float
    right: float

    def step(self, robot: Robot) -> None:
        robot.drive(self.left, self.right)


class Alone:
    """A behavior that runs by itself, on a robot whose readings never change."""

    def __init__(self, behavior: MotorBehavior, step: float, seed: int = 0) -> None:
        """It begins; `step` in s."""
        self.robot, self._behavior, self._step, self._steps = Robot("none", step, seed), behavior, step, 0
        self._equipment = Equipment(load_robot("shieldbot"), step)
        behavior.join(step, self.robot.stream(behavior.name), lambda kind: behavior, lambda process, gamma: None)
        self._see()
        behavior.enter(self.robot)

    def step(self) -> None:
        """One step more."""
        self._see()
        self._behavior.step(self.robot)
        self._steps += 1

    def _see(self) -> None:
        nothing = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))
        self.robot.observation = Observation(nothing, self._equipment, time=self._steps * self._step)


def trial_seeds(seed: int, count: int) -> range:
    """Seeds of the trials of an experiment with that seed."""
    return range(PER_SEED * seed, PER_SEED * seed + count)


def try_once(brain: Brain, robot: str | RobotDescription, arena: str | Path, seconds: float, **terms: Any) -> Trial:
    """One run; `terms` as of `boebot.run`.

    Raises:
        BoebotError: the run did not come to its end.
    """
    return Trial(run(brain, robot=robot, arena=arena, seconds=seconds, **terms), brain)


def decisions(result: RunResult) -> BrainRecord:
    """What the run's brain of processes did."""
    assert result.brain_record is not None, "a brain of processes"
    return result.brain_record


def true_pose(result: RunResult, times: Sequence[float] | Floats) -> Pose:
    """Where the robot really was at those times (s of the run)."""
    assert result.truth is not None
    truth, at = result.truth, np.asarray(times, dtype=np.float64) + result.clock_offset
    return interpolated(truth.time, Pose(truth.x, truth.y, truth.heading), at)
