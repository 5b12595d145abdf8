"""The parameters of a brain's processes by name: set before a run, and as a person may change them while it goes on,
with the meaning from the documentation and within what each process takes.

    avoid.turn              a field of the process avoid: a number, a text, True or False, or a tuple of them
    avoid.utility.b         of its utility (8.4) to (8.6); so are c, tau and tau_gamma
    avoid.utility.w.near    its weight of the state variable near; 0 where the utility does not name it
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from boebot.arguments import shown
from boebot.brain.utility import Utility
from boebot.errors import BrainError, did_you_mean
from boebot.robot import Robot

if TYPE_CHECKING:
    from boebot.brain import Process
    from boebot.brains import LoadedBrain

_PLAIN = bool | int | float | str | tuple[Any, ...] | None  # what a parameter may be


class _Place(NamedTuple):
    """Of one parameter."""

    process: Process
    field: str
    part: str = ""
    """of its utility: "b", "w.near\""""

    @property
    def value(self) -> Any:
        """It now."""
        whole = getattr(self.process, self.field)
        if self.part.startswith("w."):
            return whole.w.get(self.part[2:], 0.0)
        return getattr(whole, self.part) if self.part else whole

    @property
    def declared(self) -> Any:
        """The type of the field, as the class says it."""
        kind = self.process.__dataclass_fields__[self.field].type
        return getattr(kind, "__name__", kind)

    @property
    def is_slider(self) -> bool:
        """A person may move it while a run goes on: a number that need not be whole, not the period, and no weight that
        the utility lacks."""
        is_number = isinstance(self.value, float | int) and not isinstance(self.value, bool)
        is_lacking = self.part.startswith("w.") and self.part[2:] not in self.process.utility.w
        is_free = self.field != "period" and self.declared != "int" and not is_lacking
        return is_free and is_number and math.isfinite(self.value)


def _places(brain: LoadedBrain) -> dict[str, _Place]:
    found = {}
    for process in () if brain.brain is None else brain.brain.processes:
        for one in dataclasses.fields(process):
            is_plain = isinstance(getattr(process, one.name), bool | int | float | str | tuple | list | None)
            if one.init and is_plain and one.name not in ("name", "utility"):
                found[f"{process.name}.{one.name}"] = _Place(process, one.name)
        weights = [f"w.{variable.name}" for variable in brain.brain.variables] if brain.brain else []
        for part in ("b", *weights, "tau", "c", "tau_gamma"):
            found[f"{process.name}.utility.{part}"] = _Place(process, "utility", part)
    return found


def parameters(brain: LoadedBrain) -> dict[str, Any]:
    """All of them, by name."""
    return {name: place.value for name, place in _places(brain).items()}


def sliders(brain: LoadedBrain) -> dict[str, float]:
    """Those that a person may move while a run goes on: numbers."""
    return {name: place.value for name, place in _places(brain).items() if place.is_slider}


def set_parameters(brain: LoadedBrain, values: Mapping[str, Any]) -> list[tuple[Process, dict[str, Any]]]:
    """Gives parameters other values, all or none. Returns processes and their fields as they were, for `Brain.change`.

    Raises:
        BrainError: there is no such parameter, or its process refuses the value.
    """
    places = _places(brain)
    changed: dict[str, tuple[Process, dict[str, Any]]] = {}  # fields, by the process's name
    for name, value in values.items():
        if name not in places:
            raise _unknown(str(name), places, brain.name)
        process, field, _ = places[name]
        _, fields = changed.setdefault(process.name, (process, {}))
        fields[field] = _changed(places[name], value, fields.get("utility", process.utility))
    for process, fields in changed.values():
        _check(process, fields)
    before = [(process, {field: getattr(process, field) for field in fields}) for process, fields in changed.values()]
    _change(brain, changed.values())
    return before


@contextlib.contextmanager
def in_force(brain: LoadedBrain, values: Mapping[str, Any]) -> Iterator[None]:
    """They have these values in the block, and those from before after it: a `Brain` may run again. Raises as
    `set_parameters`."""
    before = set_parameters(brain, values)
    try:
        yield
    finally:
        _change(brain, before)


def _change(brain: LoadedBrain, changed: Iterable[tuple[Process, dict[str, Any]]]) -> None:
    for process, fields in changed:
        assert brain.brain is not None
        brain.brain.change(process, fields)


def _unknown(name: str, known: Collection[str], brain: str) -> BrainError:
    """The sentence about a name that is none of the `known` ones."""
    beginnings = dict.fromkeys(f"{one.partition('.')[0]}." for one in known)
    begun = [one for one in known if one.startswith(f"{name.partition('.')[0]}.")]
    expected = f"one of {', '.join(begun)}" if begun else f"one that begins with {', '.join(beginnings)}"
    if not known:
        expected = "a Brain of processes: others have none by name"
    return BrainError(f"brain {brain!r} has no parameter {name!r}; expected {expected}{did_you_mean(name, known)}")


def _types(kind: type[Process]) -> Mapping[str, Any]:
    """Of the parameters of a class, as it declares them."""
    try:
        return typing.get_type_hints(kind, localns={"Robot": Robot})
    except Exception:  # of a class of somebody's own: names that only type checkers know
        return {}


def _changed(place: _Place, value: Any, utility: Utility) -> Any:
    """The field of the process with that value; of its utility, that one with it."""
    process, field, part = place
    key, _, variable = part.partition(".")
    plain = value.tolist() if hasattr(value, "tolist") else value  # numpy's
    try:
        kind = float if part else _types(type(process)).get(field, _PLAIN)
        fitting = msgspec.convert(json.loads(json.dumps(plain, allow_nan=False)), kind)
        change: dict[str, Any] = {"w": {**utility.w, variable: fitting}} if variable else {key: fitting}
        return dataclasses.replace(utility, **change) if part else fitting
    except (TypeError, ValueError, OverflowError):
        if part:
            raise BrainError(f"{process.name}: utility.{part} is {shown(value)}; expected a finite number") from None
        _check(process, {field: plain})  # its own sentence says more
        raise BrainError(
            f"{process.name}: {field} is {shown(value)}; expected {place.declared}, finite, as a TOML file can have it"
        ) from None
    except BrainError as error:
        raise BrainError(f"{process.name}: {error}") from None


def _check(process: Process, fields: Mapping[str, Any]) -> None:
    """Raises BrainError where the process would refuse these values when it is made, in whichever way."""
    try:
        dataclasses.replace(process, **fields)
    except BrainError:
        raise
    except Exception as error:
        given = ", ".join(f"{key} = {shown(value)}" for key, value in fields.items())
        raise BrainError(f"{process.name} does not take {given}: {error}") from None


def bounds(brain: LoadedBrain, name: str) -> tuple[float, float]:
    """Between which values a slider for a parameter lies: about three times its present value, and within what its
    process takes; a bias and a weight may change their sign."""
    place = _places(brain)[name]
    value = place.value
    far = 3.0 * abs(value) or 1.0
    most = next(one for one in (far, 2 / 3 * far, 1.0, value) if one >= value and _takes(place, one))
    low = (-far, value) if value < 0 or place.part[:1] in ("b", "w") else (0.0, value / 10, value)
    least = next(one for one in low if _takes(place, one))
    return round(float(least), 9), round(float(most), 9)


def _takes(place: _Place, value: float) -> bool:
    try:
        _check(place.process, {place.field: _changed(place, value, place.process.utility)})
    except BrainError:
        return False
    return True
