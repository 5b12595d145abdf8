"""The loop of a run, of one robot or of several in one simulated world, from the opened world to what came of it.

Each robot is driven over the link to its board, or direct; its brain steps here, in the caller's thread. A single robot
lets time pass itself, as it waits. Several are each driven by a thread that pauses while it waits
(boebot.pausable_thread), and one clock turns them all: when all of them wait, time passes up to the earliest
wake-up, and robots that wake at the same instant go on in the order of their numbers. The run of each is then a
function of what its own robot meets.

However a run ends (time up, an error in a brain, Ctrl-C, a port that vanishes, a low supply, a stop from elsewhere),
all motors are stopped and the record is complete up to there; of several robots the error says which one it was.
"""

from __future__ import annotations

import time as wall
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, cast

from boebot import slips
from boebot.boards import DIRECT, BoardSession, VehicleSession, World, is_live, open_world
from boebot.description.robots import notices
from boebot.errors import BoebotError, BrainError
from boebot.pausable_thread import DONE, PAUSED, PausableThread
from boebot.record.brain_record import BrainNames, append_brain
from boebot.record.recording import Recording
from boebot.record.run import Run
from boebot.record.run_folder import RunFolder
from boebot.result import Result, RunResult, TogetherResult
from boebot.running import interrupts
from boebot.running.driver import Driver
from boebot.running.faults import unfired
from boebot.running.stepping import AT_LEISURE, StepTimes, StepWatch, step_once
from boebot.running.tasks import Request, Task, check_progress, of_robot

if TYPE_CHECKING:
    from boebot.running.hands import Hands, Onlooker

Progress = Callable[[float], None]
"""Called now and then with the seconds of the run that have passed."""

PROGRESS_S = 0.1  # wall time between two reports of progress
_STEP = "step"  # what a stretch of a robot's run ends with when its brain is to step


class StoppedError(BoebotError):
    """Another robot's end has ended this one's run."""


def execute(
    request: Request,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
    onlooker: Onlooker | None = None,
) -> Any:
    """Runs the robots of a request; their record goes to the folder as it comes. Returns a `RunResult`, or of several a
    `TogetherResult`. Once the run has begun every end of
    it, even by an error, is a result: see its `error`. An `onlooker` watches it, and may interfere.

    Raises:
        BoebotError: the run could not begin.
    """
    check_progress(progress)
    with interrupts.heard(), ExitStack() as stack:
        tasks = request.tasks()
        _check_own_brains(tasks)
        for task in tasks:
            if task.parameters:
                from boebot.running.brain_parameters import in_force

                stack.enter_context(in_force(task.brain, task.parameters))
        recording = Recording(len(tasks), recorded=request.record)
        for task, record in zip(tasks, recording.records, strict=True):
            task.record = record
        on = next((task.on for task in tasks if task.board.robot.has_board), request.on or DIRECT)
        world = open_world(on, [task.board for task in tasks])
        if request.typed or request.inputs or any(task.faults for task in tasks):
            from boebot.running.hands import Onlooker, Together, script

            onlooker = Together(script(request, tasks), onlooker or Onlooker())
        try:
            return _Loop(world, request, tasks, progress, recording, folder, onlooker).run()
        finally:
            world.close()


def _check_own_brains(tasks: Sequence[Task]) -> None:
    """A brain of processes remembers one robot's run; so does each process.

    Raises:
        BrainError: two robots share one.
    """
    owner: dict[int, int] = {}
    for number, brain in enumerate((task.brain.brain for task in tasks), 1):
        for process in () if brain is None else brain.processes:
            first = owner.setdefault(id(process), number)
            if first != number:
                raise BrainError(
                    f"robots {first} and {number} share the brain of {process.name!r}; expected another Brain for "
                    "each (a file, or a function that makes one, gives that)"
                )


def gather_rows(driver: Driver, task: Task, *, ended: bool = False) -> None:
    """Brings what has happened into the record, where it waits to be kept."""
    append_brain(task.record, task.brain.brain, driver.robot)
    if ended:
        driver.robot.showing.end()
    for row in driver.robot.showing.take():
        task.record.append(*row)
    task.record.put(driver.session.drain(ended=ended))


def about(driver: Driver, task: Task) -> Mapping[str, Any]:
    """What is known of a robot's run from its beginning, by the names of `boebot.record.run.Run`."""
    board = task.board
    return {
        "brain": task.brain.name,
        "robot": driver.description,
        "board": task.on,
        "description": driver.session.description,
        "arena": board.arena,
        "seed": task.seed,
        "period": driver.period_s,
        "tick": driver.tick_s,
        "record": task.record,
        "world": driver.session.arena,
        "identity": driver.identity,
        "layout": driver.layout,
        "without": board.without,
        "imperfections": board.imperfections,
        "brain_names": BrainNames.of(task.brain.brain),
        "parameters": task.parameters,
        "made_of": task.made_of,
        "unrealisable": task.unrealisable,
        "program": task.program,
    }


class _Robot:
    """One robot of a run: its driver, and its brain.

    Attributes:
        driver: once it is there.
        time_s: of the run, at its last step.
        error: why it ended before its time.
        result: what came of it, once it has ended.
        hands: who interferes with it.
    """

    def __init__(self, session: BoardSession | VehicleSession, task: Task, number: int, *, alone: bool) -> None:
        self.session, self.task, self.number = session, task, number
        self.driver: Driver | None = None
        self.time_s = 0.0
        self.error: BaseException | None = None
        self.result: RunResult | None = None
        self.hands: Hands | None = None
        self._times = StepTimes()
        self._is_ending = False  # its motors are being stopped
        self._stretches = self._life()
        self.thread = None if alone else PausableThread(self._in_thread, f"robot {number}")

    def _in_thread(self) -> None:
        assert self.thread is not None
        try:
            for _ in self._stretches:
                self.thread.pause(_STEP)
        finally:
            self._stretches.close()

    def _life(self) -> Generator[None, None, None]:
        """The whole run, from the robot made ready to the motors stopped; up to a step of the brain each time."""
        self.driver = driver = self._driver()
        try:
            driver.begin()
            for self.time_s in driver.steps():
                if self.task.brain.is_over:
                    break
                yield
        except BoebotError as error:
            self.error = self.error or error
        finally:
            self._is_ending = True
            with interrupts.held():
                driver.end()
                try:
                    gather_rows(driver, self.task, ended=True)
                    self.task.record.keep(driver.status().run_time)
                except BoebotError as unkept:
                    self.error = self.error or unkept
                self.task.brain.end()
                self.result = self._result(driver)  # now: later is the others' time

    def _driver(self) -> Driver:
        """Who drives it: over the link to its board, or direct; or the program on its board does."""
        driver: Driver
        if self.task.brain.is_program:
            from boebot.running.program_driver import ProgramDriver

            driver = ProgramDriver(cast(BoardSession, self.session), self.task)
        elif self.task.board.robot.has_board:
            from boebot.record import figures
            from boebot.running.board_driver import BoardDriver

            board = cast(BoardSession, self.session)
            try:
                driver = BoardDriver(board, self.task)
            except BoebotError as error:
                for sentence in (*board.notes(), *figures.hang_sentences(board.watchdog_resets())):
                    error.add_note(sentence)
                raise
        else:
            from boebot.running.direct_driver import DirectDriver

            driver = DirectDriver(cast(VehicleSession, self.session), self.task)
        driver.robot.showing.is_kept = True
        return driver

    def _result(self, driver: Driver) -> RunResult:
        task, brain, status = self.task, self.task.brain, driver.status()
        said = [*status.notices, *brain.notices, *driver.robot.showing.notices]
        if self._times.long and slips.sleeps(brain.step if brain.main is None else brain.main.function):
            said.append(slips.of_sign("sleep"))
        if not is_live(task.on):
            said += notices(task.board.robot, task.board.without)
        elif task.board.arena is not None:
            said.append(f"arena {task.board.arena} changes nothing: the robot at {task.on} is where it stands")
        if task.request.notes and not status.notices:
            said.append("--notes: there is nothing to note")
        if task.unrealisable is not None:
            said.append(f"forced: {task.unrealisable}")
        ending: dict[str, Any] = {
            **status._asdict(),
            "notices": said,
            "steps": task.record.count("command"),
            "counters": dict(driver.session.counters()),
            "odometry_source": brain.odometry,
            "faults": {one: fired() for one, fired in self.hands.faults.items()} if self.hands else {},
            "longest_step": self._times.longest,
            "long_steps": self._times.long,
        }
        return RunResult(**about(driver, task), **ending)

    def go_on(self) -> str:
        """Goes on until its brain is to step, it waits for time to pass (one of several), or is done. In
        unpaced simulation Ctrl-C does not cut what the board has sent.

        Raises:
            KeyboardInterrupt: Ctrl-C.
        """
        if self.thread is not None:
            return self.thread.resume()
        if is_live(self.task.on) or self.task.board.realtime:
            return next(self._stretches, DONE) or _STEP
        with interrupts.uncut():
            return next(self._stretches, DONE) or _STEP

    def step(self, watch: StepWatch) -> None:
        """A step of its brain.

        Raises:
            BrainError: an error in the brain.
        """
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

    def keep_due(self) -> None:
        """Hands what has happened over to be kept, where it is time. Rows on their way are not lost by Ctrl-C.

        Raises:
            KeyboardInterrupt: Ctrl-C.
        """
        if self.task.record.is_due() and self.driver is not None and not self._is_ending:
            with interrupts.uncut():
                gather_rows(self.driver, self.task)
                self.task.record.keep(self.time_s)

    def stop(self, error: BoebotError) -> None:
        """Begins to end it, if it has not ended."""
        if self.thread is None:
            self._stretches.close()
        elif not self._is_ending:
            self.thread.resume(error)

    @property
    def is_done(self) -> bool:
        """Nothing of it runs any more."""
        return self.thread is None or self.thread.is_done

    @property
    def failure(self) -> BaseException | None:
        """Why it ended before its time."""
        return self.error or (None if self.thread is None else self.thread.error)


class _Loop:
    """All robots of a run."""

    def __init__(
        self,
        world: World,
        request: Request,
        tasks: Sequence[Task],
        progress: Progress | None,
        recording: Recording,
        folder: RunFolder | None,
        onlooker: Onlooker | None,
    ) -> None:
        self._world, self._request, self._tasks = world, request, tasks
        self._recording, self._folder, self._is_recorded = recording, folder, False
        self._progress, self._next_progress, self._onlooker = progress, 0.0, onlooker
        self._robots = [
            _Robot(session, task, number, alone=len(tasks) == 1)
            for number, (session, task) in enumerate(zip(world.sessions, tasks, strict=True), 1)
        ]
        world.on_wait(self._pause)

    def _pause(self, index: int) -> None:
        thread = self._robots[index].thread
        assert thread is not None
        thread.pause(PAUSED)

    def run(self) -> Result:
        """The whole run, from the first hello to the last stop."""
        started = wall.perf_counter()
        error: BaseException | None = None
        try:
            with StepWatch(AT_LEISURE) as watch:
                self._turn_all(watch)
        except (BoebotError, KeyboardInterrupt) as caught:
            error = caught
        finally:
            with interrupts.held():
                self._stop_all(error)
        with interrupts.held():
            return self._result(error, wall.perf_counter() - started)

    def _turn_all(self, watch: StepWatch) -> None:
        """Turns the clock until all are done.

        Raises:
            BoebotError: one of them ended before its time.
        """
        awake = self._robots
        while True:
            for robot in awake:
                try:
                    self._turn(robot, watch)
                except BoebotError as error:
                    if robot.failure is None:  # it is not the robot's: `progress` has raised it, or who watches
                        raise
                    raise of_robot(error, robot.number, len(self._robots)) from error
                if (failure := robot.failure) is not None:
                    raise of_robot(failure, robot.number, len(self._robots)) from failure
            if all(robot.is_done for robot in self._robots):
                return
            awake = [self._robots[index] for index in self._world.advance()]

    def _turn(self, robot: _Robot, watch: StepWatch) -> None:
        """Goes on until it waits for time to pass, or is done; the brain steps meanwhile."""
        while robot.go_on() == _STEP:
            if not self._is_recorded and all(one.driver is not None for one in self._robots):
                self._begin_record()
            if self._is_recorded:
                robot.keep_due()
            if self._progress is not None and wall.perf_counter() >= self._next_progress:
                self._next_progress = wall.perf_counter() + PROGRESS_S
                self._progress(min(one.time_s for one in self._robots))
            robot.step(watch)
            if self._onlooker is not None and self._is_recorded:
                self._onlooker.look(max(one.time_s for one in self._robots))

    def _begin_record(self) -> None:
        self._is_recorded = True
        drivers = [robot.driver for robot in self._robots if robot.driver is not None]
        begun = [
            Run(**about(driver, task), **driver.status()._asdict())
            for driver, task in zip(drivers, self._tasks, strict=True)
        ]
        files: Mapping[str, bytes] = {}
        if self._folder is not None:
            from boebot.running.sources import sources

            files = sources(self._request, self._tasks)
        waits = begun[0].world is not None and not self._request.realtime
        self._recording.begin(self._folder, begun, files, self._request.said(self._tasks), waits=waits)
        if self._onlooker is not None:
            from boebot.running.hands import Hands

            for robot, driver in zip(self._robots, drivers, strict=True):
                robot.hands = Hands(driver, robot.task, robot.number - 1, self._onlooker)
            self._onlooker.begin([robot.hands for robot in self._robots if robot.hands is not None], begun)

    def _stop_all(self, error: BaseException | None) -> None:
        """Ends every robot that still runs, and lets time pass until all of them have stopped."""
        why = "Ctrl-C" if isinstance(error, KeyboardInterrupt) else str(error)
        for robot in self._robots:
            robot.stop(StoppedError(f"the run has ended: {why}"))
        try:
            while not all(robot.is_done for robot in self._robots):
                for index in self._world.advance():
                    self._robots[index].go_on()
        except BoebotError as broken:  # no time passes any more: nothing moves either
            while not all(robot.is_done for robot in self._robots):
                for robot in self._robots:
                    if robot.thread is not None:
                        robot.thread.resume(broken)

    def _result(self, error: BaseException | None, elapsed_s: float) -> Result:
        """Raises the error of a run that never began."""
        results: list[RunResult] = []
        for robot in self._robots:
            if (result := robot.result) is None:
                raise error if error is not None else BoebotError(f"robot {robot.number} did not begin")
            result.error = error if isinstance(error, KeyboardInterrupt) else robot.failure
            if len(self._robots) == 1:
                result.error = result.error or error  # also what is not the robot's
            if result.error is None and (quiet := unfired(result.faults)) is not None:
                result.error = quiet
                error = error or of_robot(quiet, robot.number, len(self._robots))
            result.wall_time = elapsed_s
            results.append(result)
        if not self._is_recorded:
            self._begin_record()
        if self._onlooker is not None:
            self._onlooker.look(max(result.run_time for result in results), is_over=True)
        unkept = self._recording.end(results)
        if len(results) == 1:
            results[0].error = unkept or results[0].error
            return results[0]
        return TogetherResult(robots=results, error=unkept or error)
