"""The parameters that a brain's processes declare, as a person may change them while it runs: numbers, each with its
meaning from the process's own documentation and with bounds that the process takes."""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
from typing import TYPE_CHECKING, Any

from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.brain import Process
    from boebot.brains import LoadedBrain

_ARGUMENT = re.compile(r"^    (\w+): (.*(?:\n     +\S.*)*)", re.MULTILINE)  # of "Args:" in a docstring


def parameters(brain: LoadedBrain) -> dict[str, float]:
    """The numbers that its processes declare, by name, as "avoid.turn"."""
    return {f"{process.name}.{name}": getattr(process, name) for process, name in _declared(brain)}


def _declared(brain: LoadedBrain) -> list[tuple[Process, str]]:
    if brain.brain is None:
        return []
    found = []
    for process in brain.brain.processes:
        for one in dataclasses.fields(process):
            value = getattr(process, one.name)
            is_number = isinstance(value, float | int) and not isinstance(value, bool) and math.isfinite(value)
            if one.name != "period" and one.init and is_number:
                found.append((process, one.name))
    return found


def set_parameter(brain: LoadedBrain, name: str, value: float) -> None:
    """Gives a parameter another value, if its process takes it.

    Raises:
        BrainError: there is no such parameter, or the process refuses the value.
    """
    process, field = _find(brain, name)
    kind = type(getattr(process, field))
    check_parameter(process, field, kind(value))
    setattr(process, field, kind(value))


def _find(brain: LoadedBrain, name: str) -> tuple[Process, str]:
    for process, field in _declared(brain):
        if f"{process.name}.{field}" == name:
            return process, field
    raise BrainError(f"the brain has no parameter {name!r}; expected one of {', '.join(parameters(brain)) or 'none'}")


def check_parameter(process: Process, field: str, value: float) -> None:
    """Raises BrainError where the process would refuse that value when it is made, in whichever way."""
    changed: dict[str, Any] = {field: value}
    try:
        dataclasses.replace(process, **changed)
    except BrainError:
        raise
    except Exception as error:
        raise BrainError(f"{process.name} does not take {field} = {value!r}: {error}") from None


def bounds(brain: LoadedBrain, name: str) -> tuple[float, float]:
    """Between which values a slider for a parameter lies: about three times its present value, and within what its
    process takes."""
    process, field = _find(brain, name)
    value = getattr(process, field)
    far = 3.0 * abs(value) or 1.0
    most = next(one for one in (far, 2 / 3 * far, 1.0, value) if one >= value and _takes(process, field, one))
    low = (-far, value) if value < 0 else (0.0, value / 10, value)
    least = next(one for one in low if _takes(process, field, one))
    return round(float(least), 9), round(float(most), 9)


def _takes(process: Process, field: str, value: float) -> bool:
    try:
        check_parameter(process, field, type(getattr(process, field))(value))
    except BrainError:
        return False
    return True


def meaning(brain: LoadedBrain, name: str) -> str:
    """Of a parameter, as the documentation of its process's class says it; "" where it does not."""
    process, field = _find(brain, name)
    for kind in type(process).__mro__:
        arguments = inspect.getdoc(kind) or ""
        for found, text in _ARGUMENT.findall(arguments.partition("Args:")[2].partition("Attributes:")[0]):
            if found == field:
                return " ".join(text.split())
    return ""
