"""Sense, model, plan, act in series against behaviors in parallel: Fig. 5.1 of the notes, sections 5.1 and 5.2, on one
task with the same sensors, the same motions and the same rule of when to do which.

The robot crosses the arena to a place that it knows by its odometer, and keeps off what its infra-red sensors see. The
*serial* brain works on a reading for half a second before it acts on it, and drives on meanwhile as it last decided;
then it reads again. In the *behavior-based* brain each behavior follows the readings at every step, and utilities
choose.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import boebot
from boebot.arenas.floor_plan import FloorPlan
from boebot.behaviors import Avoid
from boebot.brain import Brain, MotorBehavior, Utility
from boebot.cognition import near, wrapped
from boebot.record.columns import VehicleColumns
from boebot.record.truth import touch_indices
from boebot.result import RunResult
from boebot.robot import Command, Robot
from boebot_course.experiment import Figure, Floats, Measured, Outcome, exactly, experiment
from boebot_course.paths import floor
from boebot_course.variants import narrow_arsim

PERIOD, PLANNING = 0.05, 0.5  # s
GOAL, NEAR_GOAL = (1.3, -1.3), 0.3  # m
SIGNAL, TURN, GAIN = 0.4, 0.4, 0.3  # motor signals; GAIN for each rad
SEEN, CLEAR, AFTER = 0.3, 0.15, 0.2  # nearness from which on it avoids, and below which for how long (s) no more
SECONDS = 20.0
STARTS = ((-1.3, 1.3), (-1.3, 1.0), (-1.5, 0.8), (-1.4, 0.4), (-0.2, 1.3), (-1.4, -0.5), (0.2, 1.2), (-0.9, 0.3))
PLANNINGS = (0.05, 0.1, 0.2, 0.3, 0.5)  # s; to see what it is that matters


def towards(robot: Robot) -> tuple[float, float]:
    """Motor signals to the goal, by the odometer; at the goal none."""
    pose = robot.odometer
    dx, dy = GOAL[0] - pose.x, GOAL[1] - pose.y
    if math.hypot(dx, dy) < NEAR_GOAL / 2:
        return 0.0, 0.0
    steer = GAIN * max(-1.0, min(1.0, wrapped(math.atan2(dy, dx) - pose.heading)))
    return SIGNAL - steer, SIGNAL + steer


@dataclass(kw_only=True)
class Approach(MotorBehavior):
    """Drives to the goal."""

    NEEDS = ("odometer",)

    def step(self, robot: Robot) -> None:
        robot.drive(*towards(robot))


def behavior_based() -> Brain:
    """Approach, and Avoid with a threshold of 0.3; 3 near - 0.4 > 0.5 where near > 0.3."""
    approach = Approach(utility=Utility(b=0.5, tau=PERIOD))
    avoid = Avoid(turn=TURN, clear=CLEAR, after=AFTER, utility=Utility(b=-0.4, w={"near": 0.9 / SEEN}, tau=PERIOD / 10))
    return Brain([approach, avoid], [near()], period=PERIOD)


class Serial:
    """Sense, model, plan, act; and again. Its plan is what the behavior-based brain would do on the same reading."""

    PERIOD = PERIOD

    def __init__(self, planning: float = PLANNING) -> None:
        """`planning`: seconds that model and plan take."""
        self._planning = planning
        self._planner = behavior_based()
        self.NEEDS = self._planner.NEEDS
        self._ready = -math.inf
        self._plan: Command | None = None

    def step(self, robot: Robot) -> None:
        """Acts on the plan once it is made; then senses anew."""
        if robot.time < self._ready - 1e-9:
            return
        acts = self._plan or robot.command
        self._planner.step(robot)
        self._plan, robot.command = robot.command, acts
        self._ready = robot.time + self._planning


@dataclass(frozen=True)
class Crossing:
    """One run, until the goal or the end."""

    plan: FloorPlan
    x: Floats
    """m"""
    y: Floats
    touched: NDArray[np.intp]
    """indices at which the robot came to touch something"""
    arrival: float
    """s; NaN: never"""
    reaction: float
    """seconds from the first reading that is near, and remains so, to a turn; NaN: never near, or no turn"""


def cross(brain: object, start: tuple[float, float], seed: int) -> Crossing:
    """From that place, heading for the goal."""
    pose = (*start, math.atan2(GOAL[1] - start[1], GOAL[0] - start[0]))
    result = boebot.run(brain, robot=narrow_arsim(), arena="arsim", seconds=SECONDS, pose=pose, seed=seed)
    truth = result.truth
    assert truth is not None
    there = np.flatnonzero(np.hypot(truth.x - GOAL[0], truth.y - GOAL[1]) < NEAR_GOAL)
    end = int(there[0]) + 1 if len(there) else len(truth.time)
    return Crossing(
        truth.plan,
        truth.x[:end],
        truth.y[:end],
        touch_indices(truth.time[:end], truth.contact[:end]),
        float(truth.time[there[0]]) if len(there) else math.nan,
        _reaction(result),
    )


def _reaction(result: RunResult) -> float:
    """From the first reading that is near, and near for a period of the brain: noise lets it flicker at first."""
    series = result.series
    assert isinstance(series, VehicleColumns)
    nearness = np.maximum(series.values("infrared_left")[:, 0], series.values("infrared_right")[:, 0])
    ticks = round(PERIOD / result.tick)
    lasting = np.flatnonzero(np.lib.stride_tricks.sliding_window_view(nearness, ticks).min(axis=1) >= SEEN)
    turns = np.array([left == -right != 0.0 for _, left, right in series.command.tolist()])
    after = np.flatnonzero(turns[lasting[0] :]) if len(lasting) else lasting
    return float(after[0] * result.tick) if len(after) else math.nan


@experiment("paradigms", robot="arsim (infra-red sensors at ±0.3324 rad)", slow=True)
def paradigms(seed: int) -> Outcome:
    """Sense-model-plan-act against behavior-based control

    In the notes: sections 5.1 and 5.2, Fig. 5.1

    Figure: The same task, sensors and motions: paths to the goal (star) of a robot that plans for 0.5 s before it
    acts, and of a behavior-based one; crosses: collisions. Right: collisions against the time that a plan takes.

    Expected: A behavior acts on a reading at its next step, within 0.05 s; a plan 0.5 s later, one that has to wait
    for the last up to 1 s later, and a period either way. At 0.55 m/s that is 0.27 m to 0.55 m, and what the
    sensors call near is 0.39 m away: some must be hit. Planned in 0.05 s the same decisions arrive everywhere and
    hit less than half as often.
    """
    brains: dict[str, Callable[[], object]] = {"parallel": behavior_based}
    brains |= {f"serial_{planning:g}s".replace(".", "_"): partial(Serial, planning) for planning in PLANNINGS}
    runs: dict[str, list[Crossing]] = {name: [] for name in brains}
    for start in STARTS:
        for name, brain in brains.items():
            runs[name].append(cross(brain(), start, seed))
    parallel, quick, *_, serial = runs.values()
    hits = [sum(len(one.touched) for one in crossings) for crossings in runs.values()][1:]
    soonest, latest = PLANNING - PERIOD, 2 * PLANNING + PERIOD
    measured = [
        exactly("behavior-based: collisions", sum(len(one.touched) for one in parallel), 0),
        exactly("behavior-based: crossings that get there", sum(one.arrival > 0 for one in parallel), len(STARTS)),
        Measured("behavior-based: slowest crossing", max(one.arrival for one in parallel), "s", most=SECONDS),
        Measured("behavior-based: slowest reaction", _worst(parallel, max), "s", 0.0, PERIOD),
        Measured("plans for 0.5 s: collisions", hits[-1], least=1),
        Measured(
            "plans for 0.5 s: crossings that get there", sum(one.arrival > 0 for one in serial), most=len(STARTS) - 1
        ),
        Measured("plans for 0.5 s: quickest reaction", _worst(serial, min), "s", soonest, latest),
        Measured("plans for 0.5 s: slowest reaction", _worst(serial, max), "s", soonest, latest),
        Measured("plans for 0.05 s: share of these collisions", hits[0] / max(hits[-1], 1), most=0.5),
        exactly("plans for 0.05 s: crossings that get there", sum(one.arrival > 0 for one in quick), len(STARTS)),
    ]
    data: dict[str, Any] = {"start_x_m": [x for x, _ in STARTS], "start_y_m": [y for _, y in STARTS]}
    for name, crossings in runs.items():
        data[f"{name}_arrival_s"] = [one.arrival for one in crossings]
        data[f"{name}_reaction_s"] = [one.reaction for one in crossings]
        data[f"{name}_collisions"] = [float(len(one.touched)) for one in crossings]
    return Outcome(measured, data, lambda figure: _draw(figure, serial, parallel, hits))


def _worst(crossings: list[Crossing], of: Callable[..., float]) -> float:
    return of((one.reaction for one in crossings if not math.isnan(one.reaction)), default=math.nan)


def _draw(figure: Figure, serial: list[Crossing], parallel: list[Crossing], hits: list[int]) -> None:
    left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1))
    for axes, name, crossings in ((left, "plans for 0.5 s", serial), (middle, "behavior-based", parallel)):
        floor(axes, crossings[0].plan)
        for one in crossings:
            axes.plot(one.x, one.y, linewidth=0.8)
            axes.plot(one.x[one.touched], one.y[one.touched], "x", color="red", markersize=5)
        axes.plot(*GOAL, "*", color="black")
        axes.set(title=name)
        axes.locator_params(nbins=5)
    right.plot(PLANNINGS, hits, "o-", label="serial")
    right.axhline(sum(len(one.touched) for one in parallel), linestyle="--", color="C1", label="behavior-based")
    right.set(xlabel="time for a plan (s)", ylabel=f"collisions in {len(serial)} crossings")
    right.set_box_aspect(1.0)
    right.legend(fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1.0))
    middle.set(ylabel="")
