"""Checks of a process's fields: a wrong one is one sentence when the process is made, not a fault in the run."""

from __future__ import annotations

import dataclasses
import math
from numbers import Real
from typing import TYPE_CHECKING, Any

from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.brain.variables import Read
    from boebot.robot import Robot

_NUMBERS = {"float": False, "float | None": True, float: False}  # as fields say their types; may it be None?


def check_numbers(process: Any) -> None:
    """Refuses whatever is no number in a field that a dataclass declares as float; it may be infinite.

    Raises:
        BrainError: process, field, what it is.
    """
    for field in dataclasses.fields(process):
        may_be_none = _NUMBERS.get(field.type)
        if may_be_none is None:
            continue
        value = getattr(process, field.name)
        if value is None and may_be_none:
            continue
        if not isinstance(value, Real) or isinstance(value, bool) or math.isnan(value):
            raise refused(process, field.name, "a number")


def positive(process: Any, *keys: str) -> None:
    """Refuses fields that are not above 0 and finite."""
    for key in keys:
        if not 0 < getattr(process, key) < math.inf:
            raise refused(process, key, "more than 0")


def not_negative(process: Any, *keys: str) -> None:
    """Refuses fields that are below 0, or not finite."""
    for key in keys:
        if not 0 <= getattr(process, key) < math.inf:
            raise refused(process, key, "0 or more")


def signals(process: Any, *keys: str) -> None:
    """Refuses fields that are no motor signals."""
    for key in keys:
        if not -1 <= getattr(process, key) <= 1:
            raise refused(process, key, "a motor signal from -1 to 1")


def shares(process: Any, *keys: str) -> None:
    """Refuses fields that are no shares or probabilities."""
    for key in keys:
        if not 0 <= getattr(process, key) <= 1:
            raise refused(process, key, "0 to 1")


def reading(process: Any, read: Read, robot: Robot) -> float | None:
    """What a function that the process was given reads: a finite number, or None, nothing is known.

    Raises:
        BrainError: it is neither.
    """
    value = read(robot)
    if value is None or (isinstance(value, Real) and math.isfinite(value)):
        return value
    raise BrainError(f"{process.name}: a signal of {value!r}; expected a finite number or None")


def refused(process: Any, key: str, expected: str) -> BrainError:
    """The sentence about a field."""
    return BrainError(f"{process.name}: {key} is {getattr(process, key)!r}; expected {expected}")
