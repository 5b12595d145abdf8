"""Brains composed in TOML: which processes, with which parameters and utilities, and which state variables.

    period_s = 0.05
    robot = "shieldbot-charging"     # the bundled ones of a run that names neither;
    arena = "station"                # boebot.brains reads both

    [variable.near]                  # by its kind,
    [variable.tired]
    of = "battery_level"             # or of a process that offers one,

    [variable.charging]
    of = "battery_level"
    kind = "charging"                # and which, where it offers several

    [process.wander]                 # kind = "wander" unless it says otherwise
    turn_probability = 0.002
    utility = { b = 0.5 }

    [process.dodge]
    kind = "avoid"                   # or the class's whole name, boebot.behaviors.avoid.Avoid
    utility = { b = -1.0, w = { near = 3.0 } }

Kinds are the classes of boebot.behaviors and boebot.cognition, in lower case with underscores. `described` is the way
back: what a brain was made of, as the record of a run has it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import json
import re
import typing
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import MappingProxyType, UnionType
from typing import Any

import msgspec

from boebot import arguments
from boebot.brain.brain import Brain
from boebot.brain.process import Process, snake_case
from boebot.brain.utility import Utility
from boebot.brain.variables import StateVariable
from boebot.description import toml_files
from boebot.errors import BrainError
from boebot.robot import Robot

_NO_PARAMETERS = {"name", "utility"}


class _Utility(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """As boebot.brain.Utility."""

    b: float = 0.0
    w: dict[str, float] = {}
    tau: float = 0.2
    c: float = 1.0
    tau_gamma: float = 0.5


class _Variable(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One state variable: of a kind, by default its name, or of a process, which may offer others besides."""

    kind: str | None = None
    of: str | None = None


@cache
def process_kinds() -> MappingProxyType[str, type[Process]]:
    """The classes of processes that a file may name."""
    from boebot import behaviors, cognition

    found = [getattr(module, name) for module in (behaviors, cognition) for name in module.__all__]
    classes = [one for one in found if inspect.isclass(one) and issubclass(one, Process)]
    return MappingProxyType({snake_case(one.__name__): one for one in classes})


@cache
def variable_kinds() -> MappingProxyType[str, Callable[[], StateVariable]]:
    """What makes the state variables that a file may name without a process."""
    from boebot.cognition import contact, near

    return MappingProxyType({"contact": contact, "near": near})


def load(path: Path) -> Brain:
    """The brain that a file describes.

    Raises:
        BrainError: one sentence with the file, the line, the key and what was expected.
    """
    return composed(toml_files.read(path, BrainError), path.name)


def composed(table: dict[str, Any], file: str) -> Brain:
    """The brain that a file's table describes; `file`: its name, for errors. Raises as `load`."""
    processes = table.get("process")
    if isinstance(processes, dict):
        for name, process in processes.items():
            if isinstance(process, dict):
                kind = process.setdefault("kind", name)
                process["kind"] = next((key for key, one in process_kinds().items() if class_name(one) == kind), kind)
    described: Any = toml_files.convert(table, _file_type(), file, BrainError)
    places = _Places(table, file)
    variables: dict[str, StateVariable] = {}
    made: dict[str, Process] = {}
    for name, one in described.process.items():
        with places.at(f"process.{name}"):
            made[name] = _process(name, one, variables)
    for name, one in described.variable.items():
        with places.at(f"variable.{name}"):
            variables[name] = _variable(name, one, made)
    for name, process in made.items():
        with places.at(f"process.{name}"):
            _check_names(name, process, variables)
    with places.at(""):
        return Brain(made.values(), variables.values(), period=described.period_s, margin=described.margin)


def described(brain: Brain) -> dict[str, Any]:
    """What a brain is made of (`MadeOf` of boebot.record.brain_record), as it is now, as JSON has it; without functions
    that a class has unless it is given others."""
    variables = {one.name: _source(one, brain) for one in brain.variables}
    odd = [] if type(brain) is Brain else [f"the brain is a {class_name(type(brain))}"]
    odd += [f"state variable {name!r} is read by a function" for name, one in variables.items() if one is None]
    processes: dict[str, Any] = {}
    for process in brain.given:
        table = processes[process.name] = {"kind": class_name(type(process))}
        if type(process) not in process_kinds().values():
            odd.append(f"process {process.name!r} is a {table['kind']}")
        for field in dataclasses.fields(process):
            value = getattr(process, field.name)
            is_usual = callable(value) and value is field.default
            if field.init and field.name not in _NO_PARAMETERS and not is_usual:
                try:
                    table[field.name] = _plain(value, brain)
                except (TypeError, ValueError):
                    odd.append(f"{process.name}.{field.name} is {arguments.shown(value)}")
        numbers = {field.name: getattr(process.utility, field.name) for field in dataclasses.fields(Utility)}
        table["utility"] = numbers | {"w": dict(process.utility.w)}
    table = {"period_s": brain.PERIOD, "margin": brain.margin, "variable": variables, "process": processes}
    return table | {"undescribed": odd}


def class_name(kind: type) -> str:
    """With its module's."""
    return f"{kind.__module__}.{kind.__qualname__}"


def _source(variable: StateVariable, brain: Brain) -> dict[str, str] | None:
    """The table of a state variable; None: a function of somebody's own reads it."""
    sources = [({"kind": kind}, make) for kind, make in variable_kinds().items()]
    for process in brain.given:
        if type(process) in process_kinds().values():
            for kind, make in _offered(process).items():
                sources.append(({"of": process.name} | ({"kind": kind} if kind else {}), make))
    return next((table for table, make in sources if dataclasses.replace(make(), name=variable.name) == variable), None)


def _plain(value: Any, brain: Brain) -> Any:
    """A parameter as JSON has it: what reads a state variable is its name. Raises TypeError or ValueError where it is
    neither, as a number that is not finite."""
    named = [one.name for one in brain.variables if callable(value) and value in (one.read, _Reading(one.name, {}))]
    value = named[0] if named else value.tolist() if hasattr(value, "tolist") else value  # numpy's
    return json.loads(json.dumps(msgspec.to_builtins(value), allow_nan=False))


class _Places:
    """Puts file and line before the sentences of what a file describes."""

    def __init__(self, table: dict[str, Any], file: str) -> None:
        self._table, self._file = table, file

    @contextlib.contextmanager
    def at(self, place: str) -> Iterator[None]:
        """Errors about the table at that place get the line of the key that the sentence names first."""
        try:
            yield
        except BrainError as error:
            keys = toml_files.table_at(self._table, place)
            key = next((word for word in re.findall(r"[\w]+", str(error)) if word in keys), "")
            found = ".".join(part for part in (place, key) if part) or "period_s"
            raise BrainError(f"{toml_files.where(self._table, self._file, found)}: {error}") from None


@cache
def _file_type() -> type[msgspec.Struct]:
    """The type of a whole file."""
    choices = tuple(_table_type(kind, one) for kind, one in process_kinds().items())
    return msgspec.defstruct(
        "BrainFile",
        [
            ("process", dict[str, typing.Union[choices]]),  # type: ignore[valid-type]  # noqa: UP007
            ("variable", dict[str, _Variable], msgspec.field(default_factory=dict)),
            ("period_s", float, 0.05),
            ("margin", float, 0.0),
            ("robot", str | None, None),
            ("arena", str | None, None),
        ],
        forbid_unknown_fields=True,
    )


def _table_type(tag: str, process: type[Process]) -> type[msgspec.Struct]:
    """The type of the table of one process: its parameters with their types and defaults."""
    types = typing.get_type_hints(process, localns={"Robot": Robot})
    fields: list[Any] = [("utility", _Utility, msgspec.UNSET)]
    for field in dataclasses.fields(process):
        if field.init and field.name not in _NO_PARAMETERS:
            kind = _named(types[field.name])
            required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
            fields.append((field.name, kind) if required else (field.name, kind, msgspec.UNSET))
    return msgspec.defstruct(
        process.__name__, fields, kw_only=True, forbid_unknown_fields=True, tag=tag, tag_field="kind"
    )


def _is_function(kind: Any) -> bool:
    """Parameters that are functions of the robot: a file names a state variable there."""
    return typing.get_origin(kind) is Callable or any(typing.get_origin(one) is Callable for one in _choices(kind))


def _choices(kind: Any) -> tuple[Any, ...]:
    """The types that a parameter may have, if there are several."""
    return typing.get_args(kind) if typing.get_origin(kind) in (typing.Union, UnionType) else ()


def _named(kind: Any) -> Any:
    """The type that a parameter has in a file."""
    if not _is_function(kind):
        return kind
    return str | None if type(None) in _choices(kind) else str


def _process(name: str, table: msgspec.Struct, variables: dict[str, StateVariable]) -> Process:
    given = msgspec.structs.asdict(table)
    utility = given.pop("utility")
    given = {key: value for key, value in given.items() if value is not msgspec.UNSET}
    if utility is not msgspec.UNSET:
        given["utility"] = Utility(**msgspec.structs.asdict(utility))
    process = process_kinds()[str(table.__struct_config__.tag)]
    for key, hint in typing.get_type_hints(process, localns={"Robot": Robot}).items():
        if given.get(key) is not None and _is_function(hint):
            given[key] = _Reading(given[key], variables)
    return process(name=name, **given)


@dataclasses.dataclass(frozen=True)
class _Reading:
    """What the state variable of that name reads; processes are made before the state variables are."""

    variable: str
    variables: dict[str, StateVariable] = dataclasses.field(compare=False)

    def __call__(self, robot: Robot) -> float | None:
        return self.variables[self.variable].read(robot)


def _check_names(name: str, process: Process, variables: dict[str, StateVariable]) -> None:
    """Refuses names of state variables that the file does not have."""
    readings = {key: value.variable for key, value in vars(process).items() if isinstance(value, _Reading)}
    named = readings | {f"utility.w.{weight}": weight for weight in process.utility.w}
    for key, variable in named.items():
        if variable not in variables:
            known = ", ".join(variables) or "none"
            raise BrainError(f"process.{name}.{key} names the state variable {variable!r}; this brain has {known}")


def _variable(name: str, table: _Variable, processes: dict[str, Process]) -> StateVariable:
    if table.of is not None:
        process = processes.get(table.of)
        if process is None or not _offered(process):
            offering = [each.name for each in processes.values() if _offered(each)]
            raise BrainError(
                f"variable.{name}.of is {table.of!r}; expected a process that has a state variable: "
                f"{', '.join(offering) or 'there is none'}"
            )
        offered = _offered(process)
        if table.kind not in offered:
            known = ", ".join(repr(kind) for kind in offered if kind is not None)
            raise BrainError(
                f"variable.{name}.kind is {table.kind!r}; {table.of} has {known or 'one alone: expected no kind'}"
            )
        make = offered[table.kind]
    else:
        kind = table.kind or name
        if kind not in variable_kinds():
            raise BrainError(
                f"variable.{name}: there is no kind {kind!r}; expected {', '.join(variable_kinds())}, or of ="
            )
        make = variable_kinds()[kind]
    return dataclasses.replace(make(), name=name)


def _offered(process: Process) -> dict[str | None, Callable[[], StateVariable]]:
    """The state variables that a process offers: its `variable()`, which needs no kind, and each `KIND_variable()`."""
    found: dict[str | None, Callable[[], StateVariable]] = {}
    for method in dir(process):
        if method == "variable":
            found[None] = process.variable  # type: ignore[attr-defined]
        elif method.endswith("_variable") and not method.startswith("_"):
            found[method.removesuffix("_variable")] = getattr(process, method)
    return found
