"""Runs several robots in one simulated world: `boebot.run_together(...)`, and `boebot run` with several of them.

Each has its own board, brain and seed, and they sense and bump each other. Brains step here, in the caller's thread;
each robot's line is tended by a strand (boebot.driving.strand) that pauses while it waits. One clock turns them all:
when all of them wait, time passes up to the earliest wake-up, and robots that wake at the same instant go on in the
order of their numbers. The run of each is then a function of what its own robot meets.

An error in one ends the run: all motors are stopped, and the error says which robot it was.
"""

from __future__ import annotations

import time as wall
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path

from boebot import interrupts, report
from boebot.boards import BoardRequest, BoardSession, SharedWorld, open_together
from boebot.driving import PROGRESS_S, Progress, Task
from boebot.driving.board import BoardDriver
from boebot.driving.strand import PAUSED, Strand
from boebot.errors import BoebotError
from boebot.result import RunResult, TogetherResult
from boebot.robots import RobotDescription
from boebot.runner import expect, prepare, step_once, switched_off

DEFAULT_KIND = "native"
_STEP = "step"  # what a strand says when the brain is to step


@dataclass(frozen=True, kw_only=True)
class Member:
    """One robot of a run of several.

    Attributes:
        brain: as for `boebot.run`.
        robot: as for `boebot.run`; one with a board.
        pose: where it starts: x (m), y (m), heading (rad). None: the arena's start for the first such robot, then free
            places near it.
        seed: of the brain's chance. None: the run's seed for the first robot, one more for each further one.
        period: seconds from step to step of the brain. None: the brain's PERIOD, or 0.05.
        without: its imperfections that are switched off, as for `boebot.run`.
    """

    brain: object = "wander"
    robot: str | Path | RobotDescription = "shieldbot"
    pose: tuple[float, float, float] | None = None
    seed: int | None = None
    period: float | None = None
    without: Sequence[str] = ()


class StoppedError(BoebotError):
    """Another robot's end has ended this one's run."""


def run_together(
    members: Sequence[Member],
    arena: str | Path | None = None,
    seconds: float = 60.0,
    on: str = DEFAULT_KIND,
    seed: int = 1,
    realtime: bool = False,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> TogetherResult:
    """Runs several robots, each with its own board and brain, in one simulated world.

        boebot.run_together([Member(brain="wander"), Member(brain="chase.py", pose=(0.5, 0.5, 0))], seconds=30)

    Args:
        members: the robots. arena: bundled name or .toml file; None: the simulator's own choice. seconds: length of the
        run by each board's clock. on: "native" or "avr". seed: of the world's noise and of the robots' imperfections.
        realtime: slow down to the wall clock. out: folder for a picture and a page of all robots, and for a folder of
        files per robot. progress: called with the seconds that have passed, about ten times a second.

    Returns:
        A result per robot, and what is common to them.

    Raises:
        BoebotError: whatever the user can mend: bad input, no free place, an error in a brain (with its robot and
            place). The record up to there is written to `out` all the same.
        KeyboardInterrupt: Ctrl-C; all motors stopped and the record written.
    """
    if out is not None:
        expect("out", out, "a folder or None", str, Path)
        report.make_folder(Path(out))
    result = execute_together(members, arena, seconds, on, seed, realtime, progress)
    if out is not None:
        try:
            with interrupts.ignored():
                result.save(out)
        except BoebotError as unsaved:
            if result.error is None:
                raise
            result.error.add_note(str(unsaved))
    if result.error is not None:
        raise result.error
    return result


def execute_together(
    members: Sequence[Member],
    arena: str | Path | None = None,
    seconds: float = 60.0,
    on: str = DEFAULT_KIND,
    seed: int = 1,
    realtime: bool = False,
    progress: Progress | None = None,
) -> TogetherResult:
    """As `run_together`, but once the run has begun every end of it, even by an error, is a result: see
    `TogetherResult.error`.

    Raises:
        BoebotError: the run could not begin.
    """
    expect("members", members, "a list of boebot.Member", list, tuple)
    expect("arena", arena, "a name, a .toml file or None", str, Path, type(None))
    expect("on", on, "the name of a board", str)
    expect("seconds", seconds, "a number", Real)
    expect("seed", seed, "a whole number", Integral)
    if not members:
        raise BoebotError("there is no robot to run; expected at least one Member")
    tasks = []
    for number, member in enumerate(members, 1):
        expect("members", member, "a list of boebot.Member", Member)
        try:
            tasks.append(_task(member, number, arena, on, seconds, seed, realtime))
        except BoebotError as error:
            raise _of_robot(error, number, len(members)) from None
    world = open_together(on, [task.request for task in tasks])
    try:
        return _Run(world, tasks, progress).run()
    finally:
        world.close()


def _task(
    member: Member, number: int, arena: str | Path | None, on: str, seconds: float, seed: int, realtime: bool
) -> Task:
    expect("seed", member.seed, "a whole number or None", Integral, type(None))
    loaded, description, period_s = prepare(member.brain, member.robot, seconds, member.period)
    request = BoardRequest(
        robot=description,
        arena=None if arena is None else str(arena),
        seed=seed,
        realtime=realtime,
        start_pose=_pose(member.pose),
        without=switched_off(member.without),
    )
    own = seed + number - 1 if member.seed is None else member.seed
    return Task(brain=loaded, request=request, on=on, seconds=seconds, period_s=period_s, brain_seed=own)


def _pose(pose: object) -> tuple[float, float, float] | None:
    if pose is None:
        return None
    if isinstance(pose, tuple | list) and len(pose) == 3 and all(isinstance(value, Real) for value in pose):
        x, y, heading = pose
        return float(x), float(y), float(heading)
    raise BoebotError(f"pose is {pose!r}; expected (x in m, y in m, heading in rad)")


def _of_robot(error: BaseException, number: int, count: int) -> BaseException:
    """The error, saying which robot it is about, where there are several."""
    if count == 1 or not isinstance(error, BoebotError):
        return error
    return type(error)(f"robot {number}: {error}")


class _Robot:
    """One robot of a run: its driver on a strand, and its brain."""

    def __init__(self, session: BoardSession, task: Task, number: int) -> None:
        self.number = number
        self.task = task
        self.driver: BoardDriver | None = None
        self.error: BaseException | None = None
        self.result: RunResult | None = None
        self.is_ending = False  # its motors are being stopped
        self.time_s = 0.0
        self._session = session
        self.strand = Strand(self._work, f"robot {number}")

    def _work(self) -> None:
        """What the strand does: the whole run, from the link opened to the motors stopped."""
        self.driver = driver = BoardDriver(self._session, self.task)
        try:
            driver.begin()
            for self.time_s in driver.steps():
                self.strand.pause(_STEP)
        except BoebotError as error:
            self.error = self.error or error
        finally:
            self.is_ending = True
            driver.end()
            self.result = driver.result(None, 0.0)  # now: what comes later is the others' time

    def turn(self, error: BaseException | None = None) -> None:
        """Goes on until it waits for time to pass, or is done; the brain steps meanwhile.

        Raises:
            BrainError: an error in the brain.
        """
        said = self.strand.resume(error)
        while said == _STEP:
            assert self.driver is not None
            try:
                step_once(self.driver.robot, self.task.brain)
            except BaseException as caught:
                self.error = caught
                raise
            said = self.strand.resume()

    @property
    def failure(self) -> BaseException | None:
        """Why it ended before its time."""
        return self.error or self.strand.error


class _Run:
    """All robots of a run, turned on one clock."""

    def __init__(self, world: SharedWorld, tasks: Sequence[Task], progress: Progress | None) -> None:
        self._world = world
        self._robots = [
            _Robot(session, task, number)
            for number, (session, task) in enumerate(zip(world.sessions, tasks, strict=True), 1)
        ]
        self._progress = progress
        self._next_progress = 0.0
        world.on_wait(lambda index: self._robots[index].strand.pause(PAUSED))

    def run(self) -> TogetherResult:
        """The whole run, from the first hello to the last stop."""
        started = wall.perf_counter()
        error: BaseException | None = None
        try:
            self._loop()
        except (BoebotError, KeyboardInterrupt) as caught:
            error = caught
        finally:
            with interrupts.ignored():  # a second Ctrl-C must not keep motors running
                self._stop_all(error)
        return self._result(error, wall.perf_counter() - started)

    def _loop(self) -> None:
        """Turns the clock until all are done.

        Raises:
            BoebotError: one of them ended before its time.
        """
        awake = self._robots
        while True:
            for robot in awake:
                self._turn(robot)
            if all(robot.strand.is_done for robot in self._robots):
                return
            awake = [self._robots[index] for index in self._world.advance()]
            self._report()

    def _turn(self, robot: _Robot) -> None:
        try:
            robot.turn()
        except BoebotError as error:
            raise _of_robot(error, robot.number, len(self._robots)) from error
        if (failure := robot.failure) is not None:
            raise _of_robot(failure, robot.number, len(self._robots)) from failure

    def _report(self) -> None:
        if self._progress is not None and wall.perf_counter() >= self._next_progress:
            self._next_progress = wall.perf_counter() + PROGRESS_S
            self._progress(min(robot.time_s for robot in self._robots))

    def _stop_all(self, error: BaseException | None) -> None:
        """Tells every robot that still runs to end, and lets time pass until all of them have stopped."""
        why = "Ctrl-C" if isinstance(error, KeyboardInterrupt) else str(error)
        stop = StoppedError(f"the run has ended: {why}")
        for robot in self._robots:
            if not robot.is_ending:
                robot.strand.resume(stop)
        try:
            while not all(robot.strand.is_done for robot in self._robots):
                for index in self._world.advance():
                    self._robots[index].strand.resume()
        except BoebotError as broken:  # no time passes any more: nothing moves either
            while not all(robot.strand.is_done for robot in self._robots):
                for robot in self._robots:
                    robot.strand.resume(broken)

    def _result(self, error: BaseException | None, elapsed_s: float) -> TogetherResult:
        """Raises the error of a run that never began."""
        results: list[RunResult] = []
        for robot in self._robots:
            if (result := robot.result) is None:
                raise error if error is not None else BoebotError(f"robot {robot.number} did not begin")
            result.error = error if isinstance(error, KeyboardInterrupt) else robot.failure
            result.wall_time = elapsed_s
            results.append(result)
        return TogetherResult(robots=results, error=error)
