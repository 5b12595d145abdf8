"""Numbers that people give: returned, or refused by a sentence that names them and what was expected."""

from __future__ import annotations

import math
import reprlib
from numbers import Integral, Real
from typing import Any

import numpy as np

from boebot.errors import BoebotError


def shown(value: Any) -> str:
    """The value in a few characters of one line."""
    return " ".join(reprlib.repr(value).split())


def plain(value: Any) -> Any:
    """Numpy's arrays and numbers as Python's; anything else as a text, which no number is."""
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else shown(value)


def real(value: Any) -> float:
    """The number, also numpy's, as a float; NaN: it is none, or too large for one."""
    try:
        return float(value) if isinstance(value, Real) else math.nan
    except OverflowError:  # a whole number of hundreds of digits
        return math.nan


def number(
    what: str, value: Any, error: type[BoebotError], *, least: float = -math.inf, most: float = math.inf
) -> float:
    """A finite number from `least` to `most`, else raises `error`; `what` names it."""
    taken = real(value)
    if math.isfinite(taken) and least <= taken <= most:
        return taken
    raise error(f"{what} is {shown(value)}; expected a finite number{_range(least, most)}")


def duration(seconds: float) -> str:
    """In words: "50 ms", "2 s"."""
    return f"{seconds:.4g} s" if abs(seconds) >= 1.0 else f"{seconds * 1000:.4g} ms"


def switch(what: str, value: Any, error: type[BoebotError]) -> bool:
    """True or False, also numpy's, else raises `error`; `what` names it."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise error(f"{what} is {shown(value)}; expected True or False")


def whole(what: str, value: Any, error: type[BoebotError], *, least: int, most: int) -> int:
    """A whole number from `least` to `most`, else raises `error`; `what` names it."""
    # the first question is the quick one, and nearly always enough
    if (type(value) is int or isinstance(value, Integral)) and least <= (taken := int(value)) <= most:
        return taken
    raise error(f"{what} is {shown(value)}; expected a whole number from {least:,} to {most:,}")


def point(what: str, value: Any, error: type[BoebotError], names: str, limits: tuple[float, ...]) -> tuple[float, ...]:
    """As many numbers as there are limits, each within ± its own; `names` says what they are. Else raises `error`."""
    try:
        entries = () if isinstance(value, (str, bytes)) else tuple(value)
    except TypeError:
        entries = ()
    if len(entries) == len(limits):
        try:
            return tuple(
                number(what, entry, error, least=-limit, most=limit)
                for entry, limit in zip(entries, limits, strict=True)
            )
        except error:
            pass
    bounds = ", ".join(f"±{limit:,.0f}" for limit in limits)
    raise error(f"{what} is {shown(value)}; expected {len(limits)} finite numbers, {names}, within {bounds}")


def _range(least: float, most: float) -> str:
    if math.isfinite(least) and math.isfinite(most):
        return f" from {least:g} to {most:g}"
    if math.isfinite(least):
        return f" of at least {least:g}"
    return f" of at most {most:g}" if math.isfinite(most) else ""
