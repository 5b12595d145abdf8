"""Runs several robots in one simulated world: `boebot.run_together(...)`, and `boebot run` with several of them.

Each has its own brain and seed, and a board or none, and they sense and bump each other. Brains step here, in the
caller's thread; each robot is driven by a thread that pauses while it waits (boebot.brain.pausable_thread). One clock
turns them all: when all of them wait, time passes up to the earliest wake-up, and robots that wake at the same instant
go on in the order of their numbers. The run of each is then a function of what its own robot meets.

An error in one ends the run: all motors are stopped, and the error says which robot it was.
"""

from __future__ import annotations

import time as wall
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from boebot.boards import DIRECT, BoardSession, SharedWorld, VehicleSession, open_together
from boebot.brain.pausable_thread import PAUSED, PausableThread
from boebot.brains import LoadedBrain
from boebot.errors import BoebotError, BrainError
from boebot.record.recording import Recording
from boebot.record.run_folder import RunFolder
from boebot.result import RunResult, TogetherResult
from boebot.running import interrupts
from boebot.running.brain_parameters import in_force
from boebot.running.driver import PROGRESS_S, Driver, Progress, Task, end_rows, keep_rows
from boebot.running.hands import Hands, Onlooker
from boebot.running.runner import UNENDED, driver_of, keep, result_of, viewed
from boebot.running.sources import sources
from boebot.running.stepping import AT_LEISURE, StepTimes, StepWatch, step_once
from boebot.running.tasks import Member, Request, check_progress, of_robot

__all__ = ["Member", "StoppedError", "execute_together", "run_together"]

_STEP = "step"  # what a thread says when the brain is to step


class StoppedError(BoebotError):
    """Another robot's end has ended this one's run."""


def run_together(
    members: Sequence[Member],
    arena: str | Path | None = None,
    seconds: float = 60.0,
    on: str | None = None,
    seed: int = 1,
    realtime: bool = False,
    out: str | Path | None = None,
    progress: Progress | None = None,
    step_timeout: float | None = None,
    force_timing: bool = False,
    pins: bool = False,
    view: bool = False,
) -> TogetherResult:
    """Runs several robots, each with its own brain, and with its own board if it has one, in one simulated world.

        boebot.run_together([Member(brain="wander"), Member(brain="chase.py", pose=(0.5, 0.5, 0))], seconds=30)

    Args:
        members: the robots.
        arena, seconds, on, seed, realtime, step_timeout, force_timing, pins, view: as of `boebot.run`.
        out: folder for a picture and a page of all robots, and for a folder of files per robot.
        progress: called with the run's time so far (s), about ten times a second.

    Returns:
        A result per robot, and the figures common to them.

    Raises:
        BoebotError: whatever the user can mend: bad input, no free place, an error in a brain (with its robot and
            place). The record up to there is written to `out` all the same.
        KeyboardInterrupt: Ctrl-C; all motors stopped and the record written.
    """
    request = Request(
        members=members,
        arena=arena,
        on=on,
        seconds=seconds,
        seed=seed,
        realtime=realtime,
        step_timeout=step_timeout,
        force_timing=force_timing,
        pins=pins,
    )
    return keep(viewed(request, progress, execute_together, view=view), out)


def execute_together(
    request: Request,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
    put_away: Callable[[TogetherResult], None] | None = None,
    onlooker: Onlooker | None = None,
) -> TogetherResult:
    """Runs all robots of a request in one world; their record goes to the folder as it comes. Once the run has begun
    every end of it, even by an error, is a result: see `TogetherResult.error`. If a brain goes on after Ctrl-C,
    `put_away` gets the result, in another thread, and then the process ends. An `onlooker` watches it, and may
    interfere.

    Raises:
        BoebotError: the run could not begin.
    """
    check_progress(progress)
    with interrupts.heard(), ExitStack() as stack:
        tasks = request.tasks()
        for task in tasks:
            stack.enter_context(in_force(task.brain, task.parameters))
        recording = Recording(len(tasks), recorded=request.record)
        tasks = [replace(task, record=record) for task, record in zip(tasks, recording.records, strict=True)]
        _check_own_brains([task.brain for task in tasks])
        kind = next((task.on for task in tasks if task.request.robot.has_board), request.on or DIRECT)
        world = open_together(kind, [task.request for task in tasks])
        try:
            return _Run(world, request, tasks, progress, recording, folder, onlooker).run(put_away)
        finally:
            world.close()


def _check_own_brains(loaded: Sequence[LoadedBrain]) -> None:
    """A brain of processes remembers one robot's run; so does each process.

    Raises:
        BrainError: two robots share one.
    """
    owner: dict[int, int] = {}
    for number, brain in enumerate((one.brain for one in loaded), 1):
        for process in () if brain is None else brain.processes:
            first = owner.setdefault(id(process), number)
            if first != number:
                raise BrainError(
                    f"robots {first} and {number} share the brain of {process.name!r}; expected another Brain for "
                    "each (a file, or a function that makes one, gives that)"
                )


class _Robot:
    """One robot of a run: its driver on a thread, and its brain."""

    def __init__(self, session: BoardSession | VehicleSession, task: Task, number: int) -> None:
        self.number = number
        self.task = task
        self.driver: Driver | None = None
        self.error: BaseException | None = None
        self.result: RunResult | None = None
        self.is_ending = False  # its motors are being stopped
        self.time_s = 0.0
        self.hands: Hands | None = None  # who interferes with it
        self._times = StepTimes()
        self._session = session
        self.thread = PausableThread(self._work, f"robot {number}")

    def _work(self) -> None:
        """What the thread does: the whole run, from the robot made ready to the motors stopped."""
        self.driver = driver = driver_of(self._session, self.task)
        try:
            driver.begin()
            for self.time_s in driver.steps():
                if self.task.brain.is_over:
                    break
                self.thread.pause(_STEP)
        except BoebotError as error:
            self.error = self.error or error
        finally:
            self.is_ending = True
            driver.end()
            unkept = end_rows(driver, self.task)
            self.error = self.error or unkept
            self.task.brain.end()
            self.result = result_of(driver, self.task, self._times, None, 0.0)  # now: later is the others' time

    def turn(self, watch: StepWatch, error: BaseException | None = None) -> None:
        """Goes on until it waits for time to pass, or is done; the brain steps meanwhile.

        Raises:
            BrainError: an error in the brain.
        """
        said = self.thread.resume(error)
        while said == _STEP:
            assert self.driver is not None
            try:
                watch.limit = self.driver.step_limit
                if self.hands is not None:
                    self.hands.before_step(self.time_s)
                step_once(self.driver.robot, self.task.brain, watch, self._times)
                if self.hands is not None:
                    self.hands.after_step()
            except BaseException as caught:
                self.error = caught
                raise
            said = self.thread.resume()

    @property
    def failure(self) -> BaseException | None:
        """Why it ended before its time."""
        return self.error or self.thread.error


class _Run:
    """All robots of a run, turned on one clock."""

    def __init__(
        self,
        world: SharedWorld,
        request: Request,
        tasks: Sequence[Task],
        progress: Progress | None,
        recording: Recording,
        folder: RunFolder | None,
        onlooker: Onlooker | None,
    ) -> None:
        self._onlooker = onlooker
        self._world, self._request = world, request
        self._recording, self._folder, self._is_recorded = recording, folder, False
        self._robots = [
            _Robot(session, task, number)
            for number, (session, task) in enumerate(zip(world.sessions, tasks, strict=True), 1)
        ]
        self._progress = progress
        self._next_progress = 0.0
        world.on_wait(lambda index: self._robots[index].thread.pause(PAUSED))

    def run(self, put_away: Callable[[TogetherResult], None] | None) -> TogetherResult:
        """The whole run, from the first hello to the last stop."""
        started = wall.perf_counter()
        error: BaseException | None = None

        def take_over() -> None:
            interrupted = KeyboardInterrupt()
            self._stop_all(interrupted)
            result = self._result(interrupted, wall.perf_counter() - started)
            result.robots[0].notices.append(UNENDED)
            if put_away is not None:
                put_away(result)

        try:
            with StepWatch(AT_LEISURE, take_over, self._keep_due) as watch:
                self._loop(watch)
        except (BoebotError, KeyboardInterrupt) as caught:
            error = caught
        finally:
            with interrupts.ignored():  # a second Ctrl-C must not keep motors running
                self._stop_all(error)
        return self._result(error, wall.perf_counter() - started)

    def _loop(self, watch: StepWatch) -> None:
        """Turns the clock until all are done.

        Raises:
            BoebotError: one of them ended before its time.
        """
        awake = self._robots
        while True:
            for robot in awake:
                self._turn(robot, watch)
            if all(robot.thread.is_done for robot in self._robots):
                return
            awake = [self._robots[index] for index in self._world.advance()]
            self._record()
            self._report()
            if self._onlooker is not None and self._is_recorded:
                self._onlooker.look(max(robot.time_s for robot in self._robots))

    def _turn(self, robot: _Robot, watch: StepWatch) -> None:
        try:
            robot.turn(watch)
        except BoebotError as error:
            raise of_robot(error, robot.number, len(self._robots)) from error
        if (failure := robot.failure) is not None:
            raise of_robot(failure, robot.number, len(self._robots)) from failure

    def _record(self) -> None:
        """What is due to be kept; nothing happens meanwhile."""
        if not self._is_recorded and all(robot.driver is not None for robot in self._robots):
            self._begin_record()
        self._keep_due()

    def _keep_due(self) -> None:
        for robot in self._robots:
            if self._is_recorded and not robot.is_ending and robot.task.record.is_due():
                assert robot.driver is not None
                keep_rows(robot.driver, robot.task, robot.time_s)

    def _begin_record(self) -> None:
        self._is_recorded = True
        results = [robot.driver.result(None, 0.0) for robot in self._robots if robot.driver is not None]
        waits = not self._robots[0].task.request.realtime
        tasks = [robot.task for robot in self._robots]
        self._recording.begin(
            self._folder, results, sources(self._request, tasks), self._request.said(tasks), waits=waits
        )
        if self._onlooker is not None:
            for robot in self._robots:
                if robot.driver is not None:
                    robot.hands = Hands(robot.driver, robot.task, robot.number - 1, self._onlooker)
            self._onlooker.begin([robot.hands for robot in self._robots if robot.hands is not None], results)

    def _report(self) -> None:
        if self._progress is not None and wall.perf_counter() >= self._next_progress:
            self._next_progress = wall.perf_counter() + PROGRESS_S
            self._progress(min(robot.time_s for robot in self._robots))

    def _stop_all(self, error: BaseException | None) -> None:
        """Ends every robot that still runs, and lets time pass until all of them have stopped."""
        why = "Ctrl-C" if isinstance(error, KeyboardInterrupt) else str(error)
        stop = StoppedError(f"the run has ended: {why}")
        for robot in self._robots:
            if not robot.is_ending:
                robot.thread.resume(stop)
        try:
            while not all(robot.thread.is_done for robot in self._robots):
                for index in self._world.advance():
                    self._robots[index].thread.resume()
        except BoebotError as broken:  # no time passes any more: nothing moves either
            while not all(robot.thread.is_done for robot in self._robots):
                for robot in self._robots:
                    robot.thread.resume(broken)

    def _result(self, error: BaseException | None, elapsed_s: float) -> TogetherResult:
        """Raises the error of a run that never began."""
        results: list[RunResult] = []
        for robot in self._robots:
            if (result := robot.result) is None:
                raise error if error is not None else BoebotError(f"robot {robot.number} did not begin")
            result.error = error if isinstance(error, KeyboardInterrupt) else robot.failure
            result.wall_time = elapsed_s
            results.append(result)
        if not self._is_recorded:
            self._begin_record()
        return TogetherResult(robots=results, error=self._recording.end(results) or error)
