"""What a run is asked for, checked: of one robot or of several, before anything is opened."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral, Real
from pathlib import Path
from typing import Any, NamedTuple

from boebot import brains
from boebot.boards import DIRECT, BoardRequest, default_board, is_live
from boebot.brains import LoadedBrain
from boebot.description.equipment import Equipment, check_setting, with_board_led
from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import BoebotError, BrainError, CallError, NotRealisableError
from boebot.guests import CHECKS, guests
from boebot.imperfections import checked
from boebot.record.brain_record import MadeOf
from boebot.record.interventions import TEXT_MAXIMUM, Fault
from boebot.record.record import Record
from boebot.running.driver import check_time_to_live
from boebot.running.faults import AT_A_PORT, read

DEFAULT_ROBOT = "shieldbot"
DEFAULT_PERIOD = 0.05  # s
PROGRAM_BOARD = "avr"  # the only emulated one that runs any program
AS_ASKED = ("on", "seed", "realtime", "force_timing", "pins", "notes", "strict", "expect_text", "fail_text")
"""Of a request, what its record says as it is"""
_OF_ONE = {"pose", "period", "without", "parameters", "imperfections"}


class Finding(NamedTuple):
    """What does not go together in time."""

    why: str
    """A sentence without its end."""
    see: str
    """What shows more of it."""


Check = Callable[[RobotDescription, float], Finding | None]
"""Whether a robot can keep a brain's period (s); None: it can."""


class _NamesFiles:
    """Its paths of files still name them in another folder, which a brain may change to."""

    def __post_init__(self) -> None:
        for name in vars(self).keys() & {"arena", "brain", "robot"}:
            value = getattr(self, name)
            is_name = not isinstance(value, str | Path) or Path(value).suffix not in (brains.PYTHON, brains.TOML)
            is_program = name == "brain" and brains.names_program(value)
            if is_program or (not is_name and os.path.isfile(value)):  # noqa: PTH113 (no error where it is too long)
                object.__setattr__(self, name, Path(value).absolute())


@dataclass(frozen=True, kw_only=True)
class Member(_NamesFiles):
    """One robot of a run.

    Attributes:
        brain: bundled name ("wander"), Python or TOML file, a `boebot.brain.Brain`, function `step(robot)`, or object
            or class with `step(robot)`.
        robot: bundled name, .toml file, or a description; with a board or without. None: the brain's ROBOT, or
            "shieldbot".
        pose: where it starts: x (m), y (m), heading (rad). None: the arena's start for the first such robot, then free
            places near it.
        seed: of the brain's chance. None: the run's seed for the first robot, one more for each further one.
        period: seconds from step to step of the brain. None: the brain's PERIOD, or 0.05.
        without: imperfections of the simulated robot that are switched off, such as ("slip", "bounce");
            docs/reference/imperfections.md names them.
        parameters: of its brain of processes, by name, for this run, such as {"avoid.turn": 0.4}
            (docs/how-to/several-behaviors.md).
        imperfections: magnitudes of others by name, such as {"servo_lag_s": 0.08}; that page has names and units.
    """

    brain: object = "wander"
    robot: str | Path | RobotDescription | None = None
    pose: tuple[float, float, float] | None = None
    seed: int | None = None
    period: float | None = None
    without: Sequence[str] = ()
    parameters: Mapping[str, Any] | None = None
    imperfections: Mapping[str, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Request(_NamesFiles):
    """What to run: one value, from the command line to the last step.

    Attributes:
        members: the robots; several share one simulated world.
        arena, on, seconds, seed, realtime, step_timeout, force_timing, pins, expect_text, fail_text, typed,
            inputs, faults: as of `boebot.run`.
        record: what happens is recorded.
        notes, strict: of a program's board, as of `BoardRequest`.
        gdb: TCP port for avr-gdb at the one emulated ATmega328P, which waits for it; no record says of it.
    """

    members: Sequence[Member]
    arena: str | Path | None = None
    on: str | None = None
    seconds: float = 60.0
    seed: int = 1
    realtime: bool = False
    step_timeout: float | None = None
    force_timing: bool = False
    record: bool = True
    pins: bool = False
    notes: bool = False
    strict: bool = False
    gdb: int | None = None
    expect_text: str = ""
    fail_text: str = ""
    typed: Sequence[tuple[str, float]] = ()
    inputs: Sequence[tuple[str, float, float]] = ()
    faults: Sequence[str | Fault] = ()

    @classmethod
    def single(
        cls,
        brain: object = "wander",
        robot: str | Path | RobotDescription | None = None,
        **others: Any,
    ) -> Request:
        """Of one robot: what a `Member` has but its seed, and `others` of the attributes above."""
        own = {name: others.pop(name) for name in _OF_ONE & others.keys()}
        return cls(members=[Member(brain=brain, robot=robot, **own)], **others)

    def check(self) -> None:
        """Raises BoebotError where one of them is wrong."""
        expect("arena", self.arena, "a name, a .toml file or None", str, Path, type(None))
        expect("on", self.on, "the name of a board or a port", str, type(None))
        expect("seconds", self.seconds, "a number", Real)
        expect("seed", self.seed, "a whole number", Integral)
        if not self.seconds > 0:
            raise BoebotError(f"a run cannot last {self.seconds:g} s; expected more than 0")
        expect("step_timeout", self.step_timeout, "seconds or None", Real, type(None))
        if self.step_timeout is not None and not self.step_timeout > 0:
            raise BoebotError(f"a step cannot last {self.step_timeout:g} s; expected a step_timeout of more than 0")
        for name in ("realtime", "force_timing", "record", "pins", "notes", "strict"):
            switch = getattr(self, name)
            if not isinstance(switch, bool):
                raise BoebotError(f"{name} is {switch!r}; expected True or False")
        expect("gdb", self.gdb, "a TCP port or None", int, type(None))
        if self.gdb is not None and not 0 <= self.gdb <= 65535:
            raise BoebotError(f"gdb is {self.gdb}; expected a TCP port, 1 to 65535, or 0: any that is free")
        expect("expect_text", self.expect_text, "a text", str)
        expect("fail_text", self.fail_text, "a text", str)
        for each in self.typed:
            if not isinstance(each, tuple | list) or [type(one) for one in each] not in ([str, float], [str, int]):
                raise BoebotError(f"typed has {each!r}; expected texts, each with its time in s")
            if len(each[0]) > TEXT_MAXIMUM:
                raise CallError(f"{len(each[0])} letters cannot be typed at once; expected {TEXT_MAXIMUM} at most")
        for one in self.inputs:
            kinds = tuple(type(value) for value in one) if isinstance(one, tuple | list) else ()
            if len(kinds) != 3 or kinds[0] is not str or not {float, int}.issuperset(kinds[1:]):
                raise BoebotError(f"inputs has {one!r}; expected devices, each with a number and its time in s")
        for what, time_s in (*self.typed, *((part, time_s) for part, _, time_s in self.inputs)):
            if not 0 <= time_s < self.seconds:
                expected = f"expected a time from 0 s on, and before the run's end at {self.seconds:g} s"
                raise CallError(f"{what!r} at {time_s:g} s is never; {expected}")
        expect("faults", self.faults, 'a list, as in ["ping.missing@3s..5s"]', list, tuple)
        for fault in self.faults:
            expect("faults", fault, "faults, as in 'ping.missing@3s..5s'", str, Fault)
        expect("members", self.members, "a list of boebot.Member", list, tuple)
        if not self.members:
            raise BoebotError("there is no robot to run; expected at least one Member")
        for member in self.members:
            expect("members", member, "a list of boebot.Member", Member)

    def said(self, tasks: Sequence[Task]) -> dict[str, Any]:
        """What a record says of it, as values of JSON, so that the run can be repeated (boebot.running.again); `tasks`:
        those of its robots."""
        return {
            "arena": None if tasks[0].board.arena is None else Path(tasks[0].board.arena).as_posix(),
            "seconds": self.seconds if math.isfinite(self.seconds) else None,
            **{name: getattr(self, name) for name in AS_ASKED},
            "members": [
                {
                    "brain": _brain_file(task.brain),
                    "pose": task.board.pose,
                    "seed": task.seed,
                    "period": task.period_s,
                    "without": list(task.board.without),
                    "imperfections": dict(task.board.imperfections),
                }
                for task in tasks
            ],
        }

    def tasks(self) -> list[Task]:
        """The runs of its robots, checked.

        Raises:
            BoebotError: in one sentence; where there are several robots, it says which one it is about.
        """
        self.check()
        tasks = []
        for number, member in enumerate(self.members, 1):
            try:
                tasks.append(_task(member, self, number))
            except BoebotError as error:
                raise of_robot(error, number, len(self.members)) from None
        kind = default_board([task.board.robot for task in tasks]) if self.on is None else self.on
        programs = [task for task in tasks if task.brain.is_program]
        _check_options(self, len(programs))
        if programs:
            kind = _board_of_programs(self, tasks)
        for part, value, _ in self.inputs:
            try:
                check_setting(programs[0].board.robot, part, value)
            except BoebotError as error:
                raise CallError(str(error)) from None
        if self.pins and (is_live(kind) or not any(task.board.robot.has_board for task in tasks)):
            raise BoebotError(f"the pins of {kind!r} cannot be recorded; expected an emulated board")
        if self.gdb is not None and (kind != PROGRAM_BOARD or len(tasks) > 1):
            got = f"{len(tasks)} robots" if len(tasks) > 1 else repr(kind)
            raise CallError(f"--gdb is of one robot on the emulated ATmega328P (--on {PROGRAM_BOARD}); got {got}")
        for task in tasks:
            task.on = kind if len(tasks) == 1 or task.board.robot.has_board else DIRECT
            task.faults = _faults(self, task)
        return tasks


@dataclass(kw_only=True)
class Task:
    """The run of one robot: its `Member` of a request, checked and found."""

    request: Request
    brain: LoadedBrain
    board: BoardRequest
    on: str = ""
    """the board, as the user named it"""
    period_s: float
    seed: int
    """of the brain's chance"""
    record: Record = field(default_factory=Record)
    """where what happens goes"""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """of the brain that were set for this run, by name"""
    made_of: MadeOf | None = None
    """the brain, if it is one of processes"""
    number: int = 1
    """of the robot"""
    program: str | None = None
    """SHA-256 of the program's file, if one drives the robot, in hexadecimal digits"""
    faults: Sequence[Fault] = ()
    unrealisable: str | None = None
    """why sensors, period and line do not go together in time, where the run was forced all the same"""


def _brain_file(loaded: LoadedBrain) -> str | None:
    """A bundled brain's name, or the path of the file that it came from, as every system reads it; None: it came from
    no file."""
    if loaded.path is None:
        return None
    return next((name for name, path in brains.bundled_files().items() if path == loaded.path), loaded.path.as_posix())


def of_robot(error: BaseException, number: int, count: int) -> BaseException:
    """The error, saying which robot it is about, where there are several."""
    if count == 1 or not isinstance(error, BoebotError):
        return error
    named = type(error)(f"robot {number}: {error}")
    for note in getattr(error, "__notes__", ()):
        named.add_note(note)
    return named


def _check_options(request: Request, programs: int) -> None:
    """Raises CallError where an option is of a program's monitor or of a brain, and the run has none, or several."""
    for name in ("expect_text", "fail_text", "typed", "inputs"):
        if getattr(request, name) and programs != 1:
            option = {"typed": "--type", "inputs": "--input"}.get(name, _option(name))
            raise CallError(f"{option} goes to the one program of a run; there are {programs} in this one")
    for name in ("step_timeout", "force_timing"):
        if getattr(request, name) and programs == len(request.members):
            raise CallError(f"{_option(name)} is of a brain; expected none where a program drives")


def _faults(request: Request, task: Task) -> list[Fault]:
    """Those of the run that are of this robot: all that name no other as in "2:NAME@START".

    Raises:
        CallError: one is none, never begins or comes twice; or the robot, or the board, cannot have it.
    """
    found: list[Fault] = []
    count = len(request.members)
    for one in request.faults:
        whose, _, what = ("", "", one) if isinstance(one, Fault) else one.rpartition(":")
        if whose and whose not in map(str, range(1, count + 1)):
            raise CallError(f"fault {one!r}: there is no robot {whose} in the run; expected 1 to {count}")
        if whose not in ("", str(task.number)):
            continue
        fault = read(what, task.board.robot)
        if fault in found:
            raise CallError(f"fault {fault} is there twice; expected each once")
        if fault.begin_s >= request.seconds:
            raise CallError(f"fault {fault} is never: the run ends at {request.seconds:g} s; expected an earlier START")
        if fault.name == "host.stopped" and (fault.end_s or 0.0) > request.seconds:
            raise CallError(f"fault {fault} outlasts the run of {request.seconds:g} s; expected an earlier END")
        if task.brain.is_program and fault.name.startswith(("host.", "serial.rate")):
            has = "no host" if fault.name.startswith("host.") else "the bit rate that it sets"
            raise CallError(f"fault {fault} is of a brain's link; {task.brain.name} is a program, which has {has}")
        if is_live(task.on) and fault.name not in AT_A_PORT:
            raise CallError(f"fault {fault} is of a simulated robot; {task.on!r} is a port")
        found.append(fault)
    return found


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _board_of_programs(request: Request, tasks: Sequence[Task]) -> str:
    """What programs run on.

    Raises:
        CallError: something else is asked for.
    """
    for task in tasks:
        name, robot = task.brain.name, task.board.robot
        if task.brain.is_program and not robot.has_board:
            raise CallError(f"{name} is a program for a board, and robot {robot.name!r} has none")
    if request.on not in (None, PROGRAM_BOARD):
        raise CallError(f"a program runs on the emulated ATmega328P, {PROGRAM_BOARD!r}; got {request.on!r}")
    return PROGRAM_BOARD


def _task(member: Member, request: Request, number: int) -> Task:
    """The run of the `number`-th robot, from 1."""
    expect("seed", member.seed, "a whole number or None", Integral, type(None))
    expect("parameters", member.parameters, 'values by name, as in {"avoid.turn": 0.4}', Mapping, type(None))
    given = member.parameters or {}
    loaded, description, period_s = prepare(member.brain, member.robot, member.period)
    is_named = request.arena is not None or member.robot is not None or (request.on is not None and is_live(request.on))
    arena = request.arena if is_named else loaded.arena
    for option, value in (("--period", member.period), ("--set", member.parameters)):
        if value and loaded.is_program:
            raise CallError(f"{option} is of a brain; {loaded.name} is a program, which has none")
    finding = None if loaded.is_program else check_timing(description, period_s)
    if finding is not None and not request.force_timing:
        raise NotRealisableError(f"{finding.why} ({finding.see}; --force-timing runs it all the same)")
    now: Mapping[str, Any] = {}
    made_of: Any = None
    if given or loaded.brain is not None:
        from boebot.brain.composition import described
        from boebot.running.brain_parameters import in_force, parameters

        with in_force(loaded, given):
            now = parameters(loaded)
            made_of = None if loaded.brain is None else described(loaded.brain)
    board = BoardRequest(
        robot=description,
        arena=None if arena is None else str(arena),
        seed=int(request.seed),
        realtime=request.realtime,
        record=request.record,
        pins=request.pins,
        pose=_pose(member.pose),
        without=_names("without", member.without),
        imperfections={} if member.imperfections is None else checked(member.imperfections),
        image=str(loaded.path) if loaded.is_program else None,
        gdb=request.gdb,
        notes=request.notes,
        strict=request.strict,
    )
    return Task(
        brain=loaded,
        request=request,
        number=number,
        board=board,
        period_s=period_s,
        parameters={name: now[name] for name in given},
        made_of=made_of,
        seed=int(request.seed) + number - 1 if member.seed is None else int(member.seed),
        program=hashlib.sha256(loaded.path.read_bytes()).hexdigest() if loaded.is_program and loaded.path else None,
        unrealisable=None if finding is None else finding.why,
    )


def check_timing(robot: RobotDescription, period_s: float) -> Finding | None:
    """The first finding of the installed checks, or that one of them is broken."""
    for guest in guests(CHECKS).values():
        try:
            check: Check = guest.load()
        except BoebotError as error:
            return Finding(str(error), "mend that package, or uninstall it")
        if (finding := check(robot, period_s)) is not None:
            return finding
    return None


def prepare(
    brain: object, robot: str | Path | RobotDescription | None, period: float | None
) -> tuple[LoadedBrain, RobotDescription, float]:
    """Brain, robot and the brain's period (s), found and checked to fit each other.

    Raises:
        BoebotError: in one sentence.
    """
    expect("robot", robot, "a name, a .toml file, a description or None", str, Path, RobotDescription, type(None))
    expect("period", period, "seconds or None", Real, type(None))
    loaded = brains.load_program(brain)
    if robot is None:
        loaded = loaded or brains.load_brain(brain)
        robot = loaded.robot or DEFAULT_ROBOT
    description = robot if isinstance(robot, RobotDescription) else load_robot(robot)
    if loaded is not None and loaded.is_program:
        description = with_board_led(description)
    else:
        description.expect_kit()
        loaded = loaded or brains.load_brain(brain)
    period_s = float(period if period is not None else loaded.period or DEFAULT_PERIOD)
    if description.has_board:
        check_time_to_live(period_s)
    missing = Equipment(description, tick_s=1.0).missing(loaded.needs)
    if missing:
        raise BrainError(
            f"brain {loaded.name!r} needs {' and '.join(missing)}, which robot {description.name!r} does not have"
        )
    return loaded, description, period_s


def expect(name: str, value: object, expected: str, *kinds: type) -> None:
    """Raises a BoebotError if an argument of `run` is of no such kind."""
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise BoebotError(f"{name} is {value!r}; expected {expected}")


def check_progress(progress: object) -> None:
    """Raises a BoebotError if that is nothing to report progress to."""
    if progress is not None and not callable(progress):
        raise BoebotError(f"progress is {progress!r}; expected a function of the seconds that have passed, or None")


def _names(argument: str, names: object) -> tuple[str, ...]:
    """Each once."""
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise BoebotError(f'{argument} is {names!r}; expected a list of names, as in ("slip", "bounce")')
    return tuple(dict.fromkeys(names))


def _pose(pose: object) -> tuple[float, float, float] | None:
    if pose is None:
        return None
    if isinstance(pose, tuple | list) and len(pose) == 3 and all(isinstance(value, Real) for value in pose):
        x, y, heading = pose
        return float(x), float(y), float(heading)
    raise BoebotError(f"pose is {pose!r}; expected (x in m, y in m, heading in rad)")
