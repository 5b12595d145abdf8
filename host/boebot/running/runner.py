"""Runs a brain on a robot: `boebot.run(...)` does from a script or a notebook what the command `boebot run` does.

One loop serves every robot, with a board or without (boebot.running.driver). On a robot in this process time stands
still while the brain thinks, so that a run is a function of brain, robot, arena and seed.

However a run ends (time up, an error in the brain, Ctrl-C, a port that vanishes, a low supply, a stop from elsewhere),
the motors are stopped and the record is complete up to there.
"""

from __future__ import annotations

import sys
import time as wall
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, cast

from boebot import slips
from boebot.boards import BoardSession, VehicleSession, is_live, open_board, open_vehicle
from boebot.description.robots import RobotDescription, notices
from boebot.errors import BoebotError
from boebot.record import figures
from boebot.record.recording import Recording
from boebot.record.run_folder import RunFolder
from boebot.result import RunResult, TogetherResult
from boebot.running import interrupts
from boebot.running.board_driver import BoardDriver
from boebot.running.brain_parameters import in_force
from boebot.running.direct_driver import DirectDriver
from boebot.running.driver import Driver, Progress, Task, end_rows, keep_rows
from boebot.running.hands import Hands, Onlooker
from boebot.running.sources import sources
from boebot.running.stepping import StepTimes, StepWatch, step_once
from boebot.running.tasks import Request, check_progress, expect

UNENDED = "the brain went on after Ctrl-C, so the whole program was ended; expected no `except:` that catches it"
Result = TypeVar("Result", RunResult, TogetherResult)


def run(
    brain: object = "wander",
    robot: str | Path | RobotDescription = "shieldbot",
    arena: str | Path | None = None,
    on: str | None = None,
    seconds: float = 60.0,
    seed: int = 1,
    realtime: bool = False,
    out: str | Path | None = None,
    period: float | None = None,
    progress: Progress | None = None,
    without: Sequence[str] = (),
    imperfections: Mapping[str, float] | None = None,
    pose: tuple[float, float, float] | None = None,
    step_timeout: float | None = None,
    force_timing: bool = False,
    record: bool = True,
    pins: bool = False,
    view: bool = False,
    parameters: Mapping[str, Any] | None = None,
) -> RunResult:
    """Runs a brain and returns what happened.

    Args:
        brain: bundled name ("wander"), Python or TOML file, a `boebot.brain.Brain`, function `step(robot)` or
            `main(robot)`, or object or class with `step(robot)`.
        robot: bundled name, .toml file, or a description; with a board or without.
        pose: where it starts: x (m), y (m), heading (rad). None: the arena's start.
        period: s from step to step of the brain. None: the brain's PERIOD, or 0.05.
        without: imperfections of the simulated robot that are switched off, such as ("slip", "bounce");
            docs/reference/imperfections.md names them.
        imperfections: magnitudes of others by name, such as {"servo_lag_s": 0.08}; that page has names and units.
        arena: bundled name or .toml file. None: the simulator's own choice. Of no meaning on a real robot.
        on: what robots with boards run on: "native", "avr", or, for a single one, a port: "/dev/ttyACM0",
            "serial:PORT", "socket://HOST:PORT"; "direct" where no robot has a board. None: native or direct.
        seconds: length of the run by the robots' clocks (s); may be infinite.
        seed: of the simulated world's noise, of the robots' imperfections, and of the first brain's chance.
        realtime: slow a simulated run down to the wall clock.
        step_timeout: s by the wall clock after which a step of a brain that has not ended is an error, which ends the
            run; may be infinite. None: 10 s; in real time, on a board, the time to live of its set-points, after which
            its dead-man stops the motors.
        force_timing: run it even if sensors, period and line are not realisable in time; the record then says so.
        pins: the output edges of emulated boards are recorded, too.
        out: folder for the record, and the files that are made from it (boebot.view).
        record: False: nothing is recorded; a result then has few figures, and `out` is refused.
        view: shows the run in the browser while it goes on, at real time at first; a person may interfere there, or
            begin it afresh: the result is that of the last run (docs/how-to/watch-a-run.md).
        parameters: of a brain of processes, by name, for this run, such as {"avoid.turn": 0.4, "avoid.utility.b": -1.0}
            (docs/how-to/several-behaviors.md).
        progress: called with the run's time so far (s), about ten times a second.

    Raises:
        BoebotError: whatever the user can mend: bad input, an error in the brain (with its place), a board that is not
            there or that vanishes. The record up to there is written to `out` all the same.
        KeyboardInterrupt: Ctrl-C; motors stopped and record written.
    """
    request = Request.single(
        brain,
        robot,
        pose=pose,
        period=period,
        without=without,
        imperfections=imperfections,
        arena=arena,
        on=on,
        seconds=seconds,
        seed=seed,
        realtime=realtime,
        step_timeout=step_timeout,
        force_timing=force_timing,
        record=record,
        pins=pins,
        parameters=parameters,
    )
    return keep(viewed(request, progress, execute, view=view), out)


def viewed(
    request: Request, progress: Progress | None, run_all: Callable[..., Result], *, view: bool
) -> Callable[[RunFolder | None, Callable[[Result], None]], Result]:
    """What `keep` does: the whole of a run, with a live view or without."""
    if not isinstance(view, bool):
        raise BoebotError(f"view is {view!r}; expected True or False")
    if not view:
        return lambda folder, put_away: run_all(request, progress, folder, put_away)
    if not request.record:
        raise BoebotError("a run that is not recorded cannot be viewed; expected record=True with view=True")

    def work(folder: RunFolder | None, put_away: Callable[[Result], None]) -> Result:
        from boebot.live.session import opened, run_viewed

        with opened(lambda url: print(f"watch it: {url}", file=sys.stderr, flush=True)) as page:
            again = lambda wanted: run_all(wanted, progress, folder, put_away, page)  # noqa: E731
            return run_viewed(page, request, again, waits=False)

    return work


def execute(
    request: Request,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
    put_away: Callable[[RunResult], None] | None = None,
    onlooker: Onlooker | None = None,
) -> RunResult:
    """Runs the one robot of a request; its record goes to the folder as it comes. Once the run has begun every end of
    it, even by an error, is a result: see `RunResult.error`. If the brain goes on after Ctrl-C, `put_away` gets the
    result, in another thread, and then the process ends. An `onlooker` watches it, and may interfere.

    Raises:
        BoebotError: the run could not begin.
    """
    check_progress(progress)
    with interrupts.heard(), ExitStack() as stack:
        (task,) = request.tasks()
        stack.enter_context(in_force(task.brain, task.parameters))
        recording = Recording(1, recorded=request.record)
        task = replace(task, progress=progress, record=recording.records[0])
        opening = open_board if task.request.robot.has_board else open_vehicle
        session = opening(task.on, task.request)

        def unended(result: RunResult) -> None:
            recording.end([result])
            result.notices.append(UNENDED)
            if put_away is not None:
                put_away(result)

        try:
            driver = driver_of(session, task)
            waits = session.arena is not None and not request.realtime
            begun = [driver.result(None, 0.0)]
            recording.begin(folder, begun, sources(request, [task]), request.said([task]), waits=waits)
            hands = None if onlooker is None else Hands(driver, task, 0, onlooker)
            if onlooker is not None and hands is not None:
                onlooker.begin([hands], begun)
            result = _drive(driver, task, unended, hands)
            result.error = recording.end([result]) or result.error
            return result
        finally:
            session.close()


def keep(work: Callable[[RunFolder | None, Callable[[Result], None]], Result], out: str | Path | None) -> Result:
    """Does the whole of a run, and writes what came of it to the folder `out`, if there is one. `work` gets the folder,
    and what to do with a result that it cannot return, for the brain goes on after Ctrl-C.

    Raises:
        BoebotError: the folder cannot be written to; else whatever ended the run before its time, once that is written.
    """

    expect("out", out, "a folder or None", str, Path, type(None))
    place = None if out is None else Path(out).absolute()  # a brain may change to another folder

    def put_away(unended: Result) -> None:
        print(f"boebot: interrupted; {UNENDED}", file=sys.stderr)
        if place is not None:
            unended.save(place)

    if place is None:
        return _whole(work(None, put_away))
    with RunFolder(place) as folder:
        result = work(folder, put_away)
        try:
            with interrupts.ignored():
                result.save(folder.path)
        except BoebotError as unsaved:
            if result.error is None:
                raise
            result.error.add_note(str(unsaved))
    return _whole(result)


def _whole(result: Result) -> Result:
    """Raises whatever ended the run before its time."""
    if result.error is not None:
        raise result.error
    return result


def driver_of(session: BoardSession | VehicleSession, task: Task) -> Driver:
    """Who drives that robot: over the link to its board, or direct.

    Raises:
        BoebotError: it cannot be driven so.
    """
    if task.request.robot.has_board:
        driver: Driver = _board_driver(cast(BoardSession, session), task)
    else:
        driver = DirectDriver(cast(VehicleSession, session), task)
    driver.robot.showing.is_kept = True
    return driver


def _board_driver(session: BoardSession, task: Task) -> Driver:
    try:
        return BoardDriver(session, task)
    except BoebotError as error:
        for sentence in (*session.notes(), *figures.hang_sentences(session.watchdog_resets())):
            error.add_note(sentence)
        raise


def _drive(driver: Driver, task: Task, unended: Callable[[RunResult], None], hands: Hands | None) -> RunResult:
    """The whole run, from the robot made ready to its result; `unended` gets one that cannot be returned; `hands`: who
    interferes with it."""
    error: BaseException | None = None
    times = StepTimes()
    time_s = 0.0
    started = wall.perf_counter()

    def keep_due() -> None:
        if task.record.is_due():
            keep_rows(driver, task, time_s)

    def take_over() -> None:
        driver.end()
        end_rows(driver, task)
        unended(result_of(driver, task, times, KeyboardInterrupt(), wall.perf_counter() - started))

    try:
        driver.begin()
        started = wall.perf_counter()
        with StepWatch(driver.step_limit, take_over, keep_due) as watch:
            for time_s in driver.steps():
                keep_due()
                if task.brain.is_over:
                    break
                if hands is not None:
                    hands.before_step(time_s)
                step_once(driver.robot, task.brain, watch, times)
                if hands is not None:
                    hands.after_step()
                    hands.onlooker.look(time_s)
    except (BoebotError, KeyboardInterrupt) as caught:
        error = caught
    finally:
        elapsed_s = wall.perf_counter() - started
        with interrupts.ignored():  # a second Ctrl-C must not keep the motors running
            driver.end()
            unkept = end_rows(driver, task)
            task.brain.end()
    error = error or unkept
    return result_of(driver, task, times, error, elapsed_s)


def result_of(driver: Driver, task: Task, times: StepTimes, error: BaseException | None, elapsed_s: float) -> RunResult:
    """The driver's result, with how long the brain's steps took, what of the run was forced, and what a user should
    know of the brain."""
    result = driver.result(error, elapsed_s)
    result.notices += [*task.brain.notices, *driver.robot.showing.notices]
    main = task.brain.main
    if times.long and slips.sleeps(task.brain.step if main is None else main.function):
        result.notices.append(slips.of_sign("sleep"))
    result.longest_step, result.long_steps = times.longest, times.long
    request = task.request
    if not is_live(task.on):
        result.notices += notices(request.robot, request.without)
    elif request.arena is not None:
        result.notices.append(f"arena {request.arena} changes nothing: the robot at {task.on} is where it stands")
    if task.unrealisable is not None:
        result.notices.append(f"forced: {task.unrealisable}")
    return result
