"""What a run is asked for, checked: of one robot or of several, before anything is opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path

from boebot import brains
from boebot.boards import BoardRequest
from boebot.brains import LoadedBrain
from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import BoebotError, BrainError
from boebot.robot import Equipment
from boebot.running.board_driver import check_time_to_live
from boebot.running.driver import Progress, Task
from boebot.timing import realisable

DEFAULT_PERIOD = 0.05  # s


@dataclass(frozen=True, kw_only=True)
class Member:
    """One robot of a run.

    Attributes:
        brain: bundled name ("wander"), Python or TOML file, a `boebot.brain.Brain`, function `step(robot)`, or object
            or class with `step(robot)`.
        robot: bundled name, .toml file, or a description; with a board or without.
        pose: where it starts: x (m), y (m), heading (rad). None: the arena's start for the first such robot, then free
            places near it.
        seed: of the brain's chance. None: the run's seed for the first robot, one more for each further one.
        period: seconds from step to step of the brain. None: the brain's PERIOD, or 0.05.
        without: imperfections of the simulated robot that are switched off, such as ("slip", "bounce");
            docs/reference/imperfections.md names them.
    """

    brain: object = "wander"
    robot: str | Path | RobotDescription = "shieldbot"
    pose: tuple[float, float, float] | None = None
    seed: int | None = None
    period: float | None = None
    without: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class Terms:
    """What all robots of a run have in common; as for `boebot.run`."""

    arena: str | Path | None
    on: str | None
    seconds: float
    seed: int
    realtime: bool
    progress: Progress | None
    step_timeout: float | None = None
    force_timing: bool = False

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
        if not isinstance(self.force_timing, bool):
            raise BoebotError(f"force_timing is {self.force_timing!r}; expected True or False")


def task_of(member: Member, terms: Terms, number: int = 1) -> Task:
    """The run of the `number`-th robot, from 1; `on` is what is asked for, or "".

    Raises:
        BoebotError: in one sentence.
    """
    expect("seed", member.seed, "a whole number or None", Integral, type(None))
    loaded, description, period_s = prepare(member.brain, member.robot, member.period)
    verdict = realisable.judge(description, period_s, board=realisable.of_image(description))
    if not terms.force_timing:
        realisable.check(verdict)
    request = BoardRequest(
        robot=description,
        arena=None if terms.arena is None else str(terms.arena),
        seed=terms.seed,
        realtime=terms.realtime,
        start_pose=_pose(member.pose),
        without=_names("without", member.without),
    )
    return Task(
        brain=loaded,
        request=request,
        on=terms.on or "",
        seconds=terms.seconds,
        period_s=period_s,
        progress=terms.progress,
        step_timeout_s=terms.step_timeout,
        brain_seed=terms.seed + number - 1 if member.seed is None else member.seed,
        unrealisable=None if verdict.is_realisable else verdict.sentence,
    )


def prepare(
    brain: object, robot: str | Path | RobotDescription, period: float | None
) -> tuple[LoadedBrain, RobotDescription, float]:
    """Brain, robot and the brain's period (s), found and checked to fit each other.

    Raises:
        BoebotError: in one sentence.
    """
    expect("robot", robot, "a name, a .toml file or a description", str, Path, RobotDescription)
    expect("period", period, "seconds or None", Real, type(None))
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


def expect(name: str, value: object, expected: str, *kinds: type) -> None:
    """Raises a BoebotError if an argument of `run` is of no such kind."""
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise BoebotError(f"{name} is {value!r}; expected {expected}")


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
