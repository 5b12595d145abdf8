"""What drives a robot in a run, behind one small interface: over the link to its board, or direct.

A run is one loop (boebot.running.runner): each turn of `Driver.steps` shows the brain a new observation, the brain
steps, and the next turn carries out its command. A brain sees no difference between drivers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from boebot.arguments import duration
from boebot.boards import BoardRequest, BoardSession, VehicleSession
from boebot.brain.composition import MadeOf
from boebot.brains import LoadedBrain
from boebot.errors import BoebotError
from boebot.link.transport import BusFigures
from boebot.record.brain_record import BrainNames, append_brain
from boebot.record.record import Record
from boebot.result import RunResult
from boebot.robot import Robot
from boebot.running.stepping import AT_LEISURE, StepLimit

Progress = Callable[[float], None]
"""Called now and then with the seconds of the run that have passed."""

TICK_S = 0.01  # of the firmware's control tick
PERIOD_MAXIMUM_S = 10.0  # of any brain
PROGRESS_S = 0.1  # wall time between two reports of progress


@dataclass(frozen=True, kw_only=True)
class Task:
    """One run, as it was asked for."""

    brain: LoadedBrain
    request: BoardRequest
    on: str
    """the board, as the user named it"""
    seconds: float
    """may be infinite"""
    period_s: float
    record: Record = field(default_factory=Record)
    """where what happens goes"""
    progress: Progress | None = None
    step_timeout_s: float | None = None
    """how long a step of the brain may take by the wall clock; None: the driver's choice"""
    brain_seed: int
    """of the brain's chance"""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """of the brain that were set for this run, by name"""
    made_of: MadeOf | None = None
    """the brain, if it is one of processes"""
    unrealisable: str | None = None
    """why sensors, period and line do not go together in time, where the run was forced all the same"""


class LinkQuality(NamedTuple):
    """Of the link to a board, since the run began."""

    lost: int
    """telemetry frames that never came"""
    bad: int
    """frames that came damaged"""
    sessions_lost: int
    resets: int
    """of the board"""
    round_trip_s: float | None
    """median from question to answer; None: not known"""
    bus: BusFigures | None = None
    """of the CAN bus, if the board is on one"""


class Driver(Protocol):
    """Drives one robot through one run."""

    @property
    def session(self) -> BoardSession | VehicleSession:
        """The robot as it was opened."""

    @property
    def robot(self) -> Robot:
        """What the brain meets."""

    @property
    def step_limit(self) -> StepLimit:
        """How long a step of the brain may take."""

    def link_quality(self) -> LinkQuality | None:
        """How the link has done so far; None: there is none."""

    def begin(self) -> None:
        """Makes the robot ready to move.

        Raises:
            BoebotError: it cannot be.
        """

    def steps(self) -> Iterator[float]:
        """One turn per step of the brain, until the run's time is up: gives the run's time (s) of the observation that
        `robot` then shows. `robot.command` is carried out at the beginning of the next turn.

        Raises:
            BoebotError: the robot cannot go on.
        """

    def end(self) -> None:
        """Stops the motors and lets go of the robot, whatever happened before."""

    def result(self, error: BaseException | None, elapsed_s: float) -> RunResult:
        """The run's result so far; `elapsed_s`: its length by the wall clock; `error`: why it ended before its time."""


def result_so_far(
    task: Task, session: BoardSession | VehicleSession, error: BaseException | None, elapsed_s: float, **own: Any
) -> RunResult:
    """A driver's `result`; `own`: what it alone knows."""
    request, brain = task.request, task.brain
    return RunResult(
        brain=brain.name,
        board=task.on,
        description=session.description,
        arena=request.arena,
        seed=task.brain_seed,
        error=error,
        record=task.record,
        world=session.arena,
        steps=task.record.count("command"),
        wall_time=elapsed_s,
        counters=dict(session.counters()),
        without=request.without,
        imperfections=request.imperfections,
        brain_names=BrainNames.of(brain.brain),
        parameters=task.parameters,
        made_of=task.made_of,
        odometry_source=brain.odometry,
        unrealisable=task.unrealisable,
        **own,
    )


def keep_rows(driver: Driver, task: Task, time_s: float, *, ended: bool = False) -> None:
    """Hands over what has happened up to that time of the run to be kept. `ended`: the run has ended.

    Raises:
        BoebotError: it cannot be kept.
    """
    gather_rows(driver, task, ended=ended)
    task.record.keep(time_s)


def gather_rows(driver: Driver, task: Task, *, ended: bool = False) -> None:
    """Brings what has happened into the record, where it waits to be kept."""
    append_brain(task.record, task.brain.brain, driver.robot)
    if ended:
        driver.robot.showing.end()
    for row in driver.robot.showing.take():
        task.record.append(*row)
    task.record.put(driver.session.drain(ended=ended))


def end_rows(driver: Driver, task: Task) -> BoebotError | None:
    """The same at the end of a run. Returns why they cannot be kept."""
    try:
        keep_rows(driver, task, driver.result(None, 0.0).run_time, ended=True)
    except BoebotError as error:
        return error
    return None


def step_limit(task: Task, otherwise: StepLimit = AT_LEISURE) -> StepLimit:
    """As the task says, or else."""
    return otherwise if task.step_timeout_s is None else AT_LEISURE._replace(seconds=task.step_timeout_s)


def check_period(period_s: float, most_s: float = PERIOD_MAXIMUM_S) -> None:
    """Raises BoebotError where a brain's period is none, or longer than `most_s`."""
    if not (period_s > 0 and math.isfinite(period_s)):
        raise BoebotError(f"a brain period of {duration(period_s)} is none; expected more than 0")
    if period_s > most_s:
        meant = f"; {period_s:g} ms would be {period_s / 1000:g}, or {period_s:g}ms as an option"
        raise BoebotError(
            f"a brain period of {duration(period_s)} is too long; expected at most {duration(most_s)}"
            + (meant if period_s / 1000 <= most_s else "")
        )


def whole_ticks(period_s: float, tick_s: float) -> int:
    """A brain's period in ticks.

    Raises:
        BoebotError: it is none, or no whole number of them.
    """
    check_period(period_s)
    ticks = round(period_s / tick_s)
    if ticks < 1 or abs(ticks * tick_s - period_s) > 1e-6:
        raise BoebotError(
            f"a brain period of {duration(period_s)} does not fit; expected a multiple of {duration(tick_s)}"
        )
    return ticks
