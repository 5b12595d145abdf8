"""Runs a brain on a robot: `boebot.run(...)` does from a script or a notebook what the command `boebot run` does.

One loop serves every robot, with a board or without (boebot.driving). On a robot in this process time stands still
while the brain thinks, so that a run is a function of brain, robot, arena and seed.

However a run ends (time up, an error in the brain, Ctrl-C, a port that vanishes, a low supply, a stop from elsewhere),
the motors are stopped and the record is complete up to there.
"""

from __future__ import annotations

import time as wall
from collections.abc import Sequence
from numbers import Integral, Real
from pathlib import Path

from boebot import brains, interrupts, report
from boebot.boards import BoardRequest, default_board, open_board, open_vehicle
from boebot.brains import LoadedBrain
from boebot.driving import Driver, Progress, Task
from boebot.driving.board import BoardDriver, check_time_to_live
from boebot.driving.direct import DirectDriver
from boebot.errors import BoebotError, BrainError
from boebot.result import RunResult
from boebot.robot import Equipment, Robot
from boebot.robots import RobotDescription, load_robot

DEFAULT_PERIOD = 0.05  # s


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
) -> RunResult:
    """Runs a brain and returns what happened.

    Args:
        brain: bundled name ("wander"), Python file, function `step(robot)`, or object or class with
        `step(robot)`. robot: bundled name, .toml file, or a description. arena: bundled name or .toml file;
        None: the simulator's own choice. Of no meaning on a real robot. on: "native", "avr", or a port:
        "/dev/ttyACM0", "serial:PORT", "socket://HOST:PORT"; "direct" for a robot without a board. None: native or
        direct. seconds: length of the run by the board's clock;
        may be infinite. seed: of the brain's chance, and of the noise of the simulated world. realtime: slow
        a simulated run down to the wall clock. out: folder for run.csv, run.png, replay.html and the raw
        bytes. period: seconds from step to step of the brain; None: the brain's PERIOD, or 0.05. progress:
        called with the seconds that have passed, about ten times a second. without: imperfections of a simulated
        robot that are switched off, such as ("slip", "bounce"); docs/reference/imperfections.md names them.

    Raises:
        BoebotError: whatever the user can mend: bad input, an error in the brain (with its place), a board
        that is not
            there or that vanishes. The record up to there is written to `out` all the same.
        KeyboardInterrupt: Ctrl-C; motors stopped and record written.
    """
    if out is not None:
        expect("out", out, "a folder or None", str, Path)
        report.make_folder(Path(out))
    result = execute(brain, robot, arena, on, seconds, seed, realtime, period, progress, without)
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


def execute(
    brain: object,
    robot: str | Path | RobotDescription = "shieldbot",
    arena: str | Path | None = None,
    on: str | None = None,
    seconds: float = 60.0,
    seed: int = 1,
    realtime: bool = False,
    period: float | None = None,
    progress: Progress | None = None,
    without: Sequence[str] = (),
) -> RunResult:
    """As `run`, but once the run has begun every end of it, even by an error, is a result: see
    `RunResult.error`.

    Raises:
        BoebotError: the run could not begin.
    """
    expect("arena", arena, "a name, a .toml file or None", str, Path, type(None))
    expect("on", on, "the name of a board or a port", str, type(None))
    expect("seed", seed, "a whole number", Integral)
    loaded, description, period_s = prepare(brain, robot, seconds, period)
    on = default_board(description) if on is None else on
    request = BoardRequest(
        robot=description,
        arena=None if arena is None else str(arena),
        seed=seed,
        realtime=realtime,
        without=switched_off(without),
    )
    task = Task(brain=loaded, request=request, on=on, seconds=seconds, period_s=period_s, progress=progress)
    if not description.has_board:
        vehicle = open_vehicle(on, request)
        try:
            return _drive(DirectDriver(vehicle, task), loaded)
        finally:
            vehicle.close()
    session = open_board(on, request)
    try:
        return _drive(BoardDriver(session, task), loaded)
    finally:
        session.close()


def prepare(
    brain: object, robot: str | Path | RobotDescription, seconds: float, period: float | None
) -> tuple[LoadedBrain, RobotDescription, float]:
    """Brain, robot and the brain's period (s), found and checked to fit each other.

    Raises:
        BoebotError: in one sentence.
    """
    expect("robot", robot, "a name, a .toml file or a description", str, Path, RobotDescription)
    expect("seconds", seconds, "a number", Real)
    expect("period", period, "seconds or None", Real, type(None))
    if not seconds > 0:
        raise BoebotError(f"a run cannot last {seconds:g} s; expected more than 0")
    description = robot if isinstance(robot, RobotDescription) else load_robot(robot)
    loaded = brains.load_brain(brain)
    period_s = period if period is not None else loaded.period or DEFAULT_PERIOD
    if description.has_board:
        check_time_to_live(period_s)
    missing = Equipment(description, tick_s=1.0).missing(loaded.needs)
    if missing:
        raise BrainError(
            f"brain {loaded.name!r} needs {' and '.join(missing)}, which robot {description.name!r} does not have"
        )
    return loaded, description, period_s


def _drive(driver: Driver, brain: LoadedBrain) -> RunResult:
    """The whole run, from the robot made ready to its result."""
    error: BaseException | None = None
    started = wall.perf_counter()
    try:
        driver.begin()
        started = wall.perf_counter()
        _loop(driver, brain)
    except (BoebotError, KeyboardInterrupt) as caught:
        error = caught
    finally:
        elapsed_s = wall.perf_counter() - started
        with interrupts.ignored():  # a second Ctrl-C must not keep the motors running
            driver.end()
    return driver.result(error, elapsed_s)


def _loop(driver: Driver, brain: LoadedBrain) -> None:
    robot = driver.robot
    for _ in driver.steps():
        step_once(robot, brain)


def step_once(robot: Robot, brain: LoadedBrain) -> None:
    """One step of the brain.

    Raises:
        BrainError: whatever goes wrong in it, with its place.
    """
    try:
        brain.step(robot)
    except (Exception, SystemExit) as error:
        raise BrainError(brains.explain(error, brain.path)) from error


def switched_off(without: object) -> tuple[str, ...]:
    """The names in the argument `without` of `run`, each once.

    Raises:
        BoebotError: it is no list of names.
    """
    if not isinstance(without, list | tuple) or not all(isinstance(name, str) for name in without):
        raise BoebotError(f'without is {without!r}; expected a list of names, as in ("slip", "bounce")')
    return tuple(dict.fromkeys(without))


def expect(name: str, value: object, expected: str, *kinds: type) -> None:
    """Raises a BoebotError if an argument of `run` is of no such kind."""
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise BoebotError(f"{name} is {value!r}; expected {expected}")
