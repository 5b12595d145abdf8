"""What a brain of processes costs: a step of the demonstration brain, its runs, and what of them the emulator takes."""

from __future__ import annotations

import statistics
import time
from typing import Any
from unittest import mock

from boebot.brains import load_brain
from boebot.result import RunResult
from boebot.robot import Robot
from boebot.running.loop import execute
from boebot.running.tasks import Request
from sim_bridge.sim import SimRobot
from tools.bench.figures import figure

ROBOT, ARENA = "shieldbot-charging", "station"
PERIOD_S = 0.05


def run(brain: object, on: str, seconds: float) -> RunResult:
    """A run as `make run` has it.

    Raises:
        BoebotError: it ended before its time.
    """
    result: RunResult = execute(
        Request.single(brain, robot=ROBOT, arena=ARENA, on=on, seconds=seconds, period=PERIOD_S)
    )
    if result.error is not None:
        raise result.error
    return result


@figure("demonstration brain, a step, p50", "us", at_most=60, rounds=3)
def step_cost() -> float:
    """Processor time of the brain's thread, over a minute on the native board."""
    step = load_brain("demo").step
    costs: list[int] = []

    def timed(robot: Robot) -> None:
        begun = time.thread_time_ns()
        step(robot)
        costs.append(time.thread_time_ns() - begun)

    run(timed, "native", 60.0)
    return statistics.median(costs) / 1000


@figure("demonstration brain, 10 minutes at 50 ms, native board", "× real time", at_least=300, rounds=3)
def native_run() -> float:
    result = run("demo", "native", 600.0)
    return result.real_time_factor or 0.0


@figure("demonstration brain, a minute at 50 ms, AVR image", "× real time")
def avr_run() -> float:
    result = run("demo", "avr", 60.0)
    return result.real_time_factor or 0.0


@figure("demonstration brain, AVR image: share of emulator and world", "%")
def avr_share() -> float:
    """Of the run's time by the wall clock, what is spent inside the simulator's C core."""
    inside = 0.0
    wait = SimRobot.wait

    def timed(self: SimRobot, *arguments: Any, **named: Any) -> Any:
        nonlocal inside
        begun = time.perf_counter()
        try:
            return wait(self, *arguments, **named)
        finally:
            inside += time.perf_counter() - begun

    with mock.patch.object(SimRobot, "wait", timed):
        result = run("demo", "avr", 60.0)
    return 100 * inside / (result.wall_time or 0.0)
