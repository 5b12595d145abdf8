"""What a sweep is to run: sweep.toml, read and checked. Which rows there are is arithmetic: nothing lists them.

A row is one run. Its number counts, from the slowest to the fastest: arena, brain, robot, point of the design, faults,
start, seed. Brains are compared at equal seeds and starts, so their differences are paired.
"""

from __future__ import annotations

import math
import uuid
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self, TypeVar

import msgspec
import numpy as np

from boebot.arenas import Arena, load_arena
from boebot.boards import DIRECT_ARENA, is_live
from boebot.brains import load_brain
from boebot.description import toml_files
from boebot.description.robots import idle
from boebot.errors import BoebotError, CallError
from boebot.imperfections import checked, imperfections
from boebot.record.figures import counted
from boebot.record.interventions import Deed
from boebot.running.brain_parameters import in_force
from boebot.running.hands import Onlooker
from boebot.running.loop import execute
from boebot.running.tasks import Request, prepare
from boebot.system import folder_kept
from boebot_campaign import designs
from boebot_campaign.designs import Design

MOST_RUNS = 10_000_000
TRAIN, TEST = "train", "test"
Pose = tuple[float, float, float]


class Range(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename={"low": "from", "high": "to"}
):
    """Numbers from `low` to `high`; in a grid that many `steps`, both ends among them."""

    low: float
    high: float
    steps: int = 0

    def __post_init__(self) -> None:
        if self.low == self.high:
            raise ValueError(f"from and to are {self.low:g}; expected two numbers")


Seed = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]  # of a column


class Whole(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename={"low": "from", "high": "to"}
):
    """Whole numbers from `low` to `high`."""

    low: Seed
    high: Seed

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ValueError(f"from is {self.low}, to is {self.high}; expected no less than from")


SOME = msgspec.Meta(min_length=1)
Axis = Annotated[list[bool | int | float | str], SOME] | Range
AnyAxis = list[Any] | Range | Whole
Seeds = Annotated[list[Seed], SOME] | Whole
Starts = list[Pose] | Annotated[int, msgspec.Meta(ge=0)]


class Case(NamedTuple):
    """One row of the plan."""

    row: int
    set: str
    """TRAIN or TEST, by its arena"""
    arena: str | None
    brain: str
    robot: str | None
    parameters: Mapping[str, Any]
    imperfections: Mapping[str, float]
    faults: tuple[str, ...]
    start: int
    """number of the start"""
    pose: Pose | None
    """None: the arena's start, or a free place by chance"""
    seed: int


class Plan(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True):
    """The keys of sweep.toml (docs/how-to/sweeps.md)."""

    brains: Annotated[list[str], SOME]
    seconds: float
    seeds: Seeds
    robots: list[str] = []
    arenas: list[str] = []
    test_arenas: list[str] = []
    on: str | None = None
    starts: Starts = []
    design: Design = "grid"
    points: int = 0
    parameters: dict[str, Axis] = {}
    imperfections: dict[str, Axis] = {}
    faults: list[list[str]] = []
    limit_s: Annotated[float, msgspec.Meta(gt=0, le=1e9)] = 60.0

    @cached_property
    def axes(self) -> list[tuple[str, AnyAxis]]:
        """Parameters, then imperfections, by name; in a saltelli design the seed, too."""
        seed = [("seed", self.seeds)] if self.design == "saltelli" else []
        return [*self.parameters.items(), *self.imperfections.items(), *seed]

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """How many there are of each that a row's number counts, the slowest first."""
        points = designs.length(self.design, self.points, len(self.axes))
        if self.design == "grid":
            points = math.prod(length(axis) for _, axis in self.axes)
        starts = self.starts if isinstance(self.starts, int) else len(self.starts)
        return (
            len(self.all_arenas),
            len(self.brains),
            len(self.all_robots),
            points,
            max(len(self.faults), 1),
            max(starts, 1),
            1 if self.design == "saltelli" else length(self.seeds),
        )

    @cached_property
    def all_arenas(self) -> list[str | None]:
        """Those of training, then those of tests; None: as the brain has it."""
        return [*self.arenas, *self.test_arenas] or [None]

    @cached_property
    def all_robots(self) -> list[str | None]:
        """None: as the brain has it."""
        return [*self.robots] or [None]

    @property
    def count(self) -> int:
        """How many rows there are."""
        return math.prod(self.sizes)

    @property
    def most_runs(self) -> int:
        """How many runs all of it is, at most."""
        return self.count

    @property
    def first_seed(self) -> int:
        """The design's, too."""
        return self.seeds.low if isinstance(self.seeds, Whole) else self.seeds[0]

    def as_sweep(self, **changes: Any) -> Plan:
        """The plan alone, without what a campaign of another kind has beside it, and with those keys."""
        keys = {name: getattr(self, name) for name in Plan.__struct_fields__}
        return msgspec.convert(msgspec.to_builtins(keys | changes), Plan)

    def completed(self, at: str) -> Self:
        """With what the file leaves to be found. Raises CallError, which begins with `at`."""
        del at
        return self

    def case(self, row: int, points: np.ndarray) -> Case:
        """The row of that number; `points`: of `designs.points`."""
        rest, place = row, []
        for size in reversed(self.sizes):
            rest, index = divmod(rest, size)
            place.append(index)
        seed, start, faults, point, robot, brain, arena = place
        values = self._values(point, points)
        return Case(
            row=row,
            set=TRAIN if arena < max(len(self.arenas), 1) else TEST,
            arena=self.all_arenas[arena],
            brain=self.brains[brain],
            robot=self.all_robots[robot],
            parameters={name: values[name] for name in self.parameters},
            imperfections={name: values[name] for name in self.imperfections},
            faults=tuple(self.faults[faults]) if self.faults else (),
            start=start,
            pose=self.starts[start] if isinstance(self.starts, list) and self.starts else None,
            seed=values["seed"] if self.design == "saltelli" else _at(self.seeds, seed),
        )

    def _values(self, point: int, points: np.ndarray) -> dict[str, Any]:
        """Of each axis at that point of the design."""
        values = {}
        for column, (name, axis) in enumerate(self.axes):
            if self.design == "grid":
                point, index = divmod(point, length(axis))
                share = index / max(length(axis) - 1, 1)
            else:
                share = float(points[point, column])
                index = min(int(share * length(axis)), length(axis) - 1)
            values[name] = axis.low + share * (axis.high - axis.low) if isinstance(axis, Range) else _at(axis, index)
        return values

    def request(self, case: Case, stamp: str) -> Request:
        """The run of a case; `stamp`: another one where its files may be others."""
        pose = case.pose
        if pose is None and isinstance(self.starts, int) and self.starts:
            arena, reach_m = _where(stamp, case.brain, case.robot, case.arena)
            pose = arena.free_start(reach_m, ((self.first_seed << 32) + case.start) % 2**64)
        return Request.single(
            case.brain,
            case.robot,
            pose=pose,
            parameters=dict(case.parameters) or None,
            imperfections=heard(case.imperfections) or None,
            arena=case.arena,
            on=self.on,
            seconds=self.seconds,
            seed=case.seed,
            step_timeout=self.limit_s,
            faults=list(case.faults),
        )


@lru_cache(maxsize=8)
def _where(stamp: str, brain: str, robot: str | None, arena: str | None) -> tuple[Arena, float]:
    """The arena of such runs, and the radius of their robot (m)."""
    del stamp
    board = Request.single(brain, robot, arena=arena).tasks()[0].board
    default = None if board.robot.has_board else DIRECT_ARENA
    return load_arena(board.arena or default), board.robot.body.reach_m


def heard(given: Mapping[str, float]) -> dict[str, float]:
    """Without those that another one needs, which is 0 here: of a run alone they are refused."""
    table = imperfections()
    return {name: value for name, value in given.items() if given.get(table[name].needs, 1)}


class Single(Plan, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True):
    """Of one brain, on one robot or on its own."""

    brains: Annotated[list[str], msgspec.Meta(min_length=1, max_length=1)]
    robots: Annotated[list[str], msgspec.Meta(max_length=1)] = msgspec.field(default_factory=list)


_P = TypeVar("_P", bound=Plan)


def read(path: Path, kind: type[_P]) -> _P:
    """The plan in a file; what it names is found beside it. Raises CallError, with file, line and key."""
    if not path.is_file():
        raise CallError(f"there is no file {path}; expected a TOML file")
    return _made(toml_files.read(path, CallError), kind, path.name, path.parent)


def made(keys: Mapping[str, Any], kind: type[_P], name: str) -> _P:
    """The plan of these keys, as a file here could have them; `name`: of it, for errors. Raises CallError."""
    try:
        plain = msgspec.to_builtins(dict(keys))
    except TypeError as error:
        raise CallError(f"{name} is made of what TOML can have: {error}; brains are names or files") from None
    return _made(plain, kind, name, Path())


def _made(table: dict[str, Any], kind: type[_P], name: str, folder: Path) -> _P:
    plan, at = _found(toml_files.convert(table, kind, name, CallError), folder), f"{name}: "
    _check_once(plan, at)
    with folder_kept():
        return valid(plan.completed(at), at)


def _found(plan: _P, folder: Path) -> _P:
    """With whole paths of files."""
    kinds = ("brains", "robots", "arenas", "test_arenas")
    return msgspec.structs.replace(
        plan, **{kind: [_whole(one, folder) for one in getattr(plan, kind)] for kind in kinds}
    )


def _whole(name: str, folder: Path) -> str:
    """The whole path of a file that is named in a folder; a bundled name as it is."""
    return str((folder / name).absolute()) if Path(name).suffix in (".py", ".toml") else name


def length(axis: AnyAxis) -> int:
    """How many values an axis has."""
    if isinstance(axis, Whole):
        return axis.high - axis.low + 1
    return len(axis) if isinstance(axis, list) else axis.steps


def _at(axis: list[Any] | Whole, index: int) -> Any:
    return axis[index] if isinstance(axis, list) else axis.low + index


def valid(plan: _P, at: str) -> _P:
    """Raises CallError or another BoebotError, in one sentence, before anything is made."""
    if plan.test_arenas and not plan.arenas:
        raise CallError(f"{at}there are test_arenas and no arenas; expected arenas, too, to train in")
    if plan.on is not None and is_live(plan.on):
        raise CallError(f"{at}on is {plan.on!r}, a port; expected an emulated board, native or avr, or direct")
    _check_design(plan, at)
    if plan.most_runs > MOST_RUNS:
        raise CallError(f"{at}these are {plan.most_runs:,} runs; expected at most {MOST_RUNS:,}")
    _check_runs(plan, at)
    return plan


def _check_once(plan: Plan, at: str) -> None:
    """Raises CallError where a list has one twice; of files the name counts."""
    lists = {name: getattr(plan, name) for name in plan.__struct_fields__} | plan.parameters | plan.imperfections
    files = {name: lists[name] for name in ("brains", "robots", "arenas")}
    files["arenas and test_arenas"] = [*plan.arenas, *plan.test_arenas]
    lists |= {name: [Path(one).name for one in given] for name, given in files.items()}
    lists["faults"] = [str(sorted(one)) for one in plan.faults]
    for name, values in lists.items():
        if isinstance(values, list) and len(set(values)) < len(values):
            one = Counter(values).most_common(1)[0][0]
            raise CallError(f"{at}{one} is there twice, in {name}; expected each once")


def _check_design(plan: Plan, at: str) -> None:
    for name, axis in plan.axes:
        if isinstance(axis, Range) and plan.design == "grid" and axis.steps < 2:
            raise CallError(f"{at}{name} has {counted(axis.steps, 'step', 'steps')}; expected 2 or more in a grid")
        if isinstance(axis, Range) and plan.design != "grid" and axis.steps:
            raise CallError(f"{at}{name} has steps, which only a grid takes; expected from and to")
        if isinstance(axis, list) and plan.design == "two-level" and len(axis) != 2:
            raise CallError(f"{at}{name} lists {len(axis)}; expected two values in a two-level design")
    is_counted = plan.design in ("grid", "two-level")
    axes = len(plan.parameters) + len(plan.imperfections)
    what = f"a {plan.design} design has {counted(plan.points, 'point', 'points')}"
    if is_counted and plan.points:
        raise CallError(f"{at}{what}; it has as many as its values make: expected no points")
    if plan.design in ("sobol", "saltelli") and plan.points & (plan.points - 1):
        raise CallError(f"{at}{what}; expected a power of two, such as {1 << plan.points.bit_length()}")
    if plan.design != "grid" and (plan.points < 1 - is_counted or not axes):
        expected = f"expected {'' if is_counted else 'both points and '}values of parameters or imperfections"
        raise CallError(f"{at}{what} over {counted(axes, 'axis', 'axes')}; {expected}")


def _check_runs(plan: Plan, at: str) -> None:
    """Each value that is listed is one that can be, and at the first point of the design and the first seed a run can
    begin: of each brain with each robot in each arena, from each start and with each choice of faults."""
    for one, axis in plan.imperfections.items():
        for value in listed(axis):
            checked({one: value})
        if isinstance(axis, Range) and imperfections()[one].whole:
            raise CallError(f"{at}{one} takes whole numbers; expected a list of them, no range")
    for brain in plan.brains:
        loaded = load_brain(brain)
        for name, axis in plan.parameters.items():
            for value in listed(axis):
                with in_force(loaded, {name: value}):
                    pass
        for robot in plan.all_robots:
            description = prepare(loaded, robot, None)[1]
            for one in plan.imperfections:
                if imperfections()[one].needs not in plan.imperfections and (fault := idle(one, description)):
                    raise CallError(f"{at}imperfections: {one} changes nothing: {fault}")
    *most, points, faults, starts, seeds = plan.sizes
    each, stamp = 1 if isinstance(plan.starts, int) else starts, uuid.uuid4().hex
    for number in range(math.prod(most)):
        for one in sorted({*range(each), *range(0, faults * starts, starts)}):
            row = (number * points * faults * starts + one) * seeds
            _begin(plan.request(plan.case(row, np.zeros((1, len(plan.axes)))), stamp))


def _begin(request: Request) -> None:
    """Begins a run, and ends it before the first step of its brain. Raises BoebotError: it cannot begin."""
    error = execute(request, onlooker=_NoStep()).error
    if error is not None and not isinstance(error, _BegunError):
        raise error


class _BegunError(BoebotError):
    """The run has begun."""


class _NoStep(Onlooker):
    """Ends a run with that."""

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        raise _BegunError


def listed(axis: AnyAxis) -> list[Any]:
    """The values that are named."""
    return axis if isinstance(axis, list) else [axis.low, axis.high]
