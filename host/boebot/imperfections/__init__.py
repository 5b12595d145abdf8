"""Imperfections of simulated robots, by name and magnitude: their table, and what may be asked of it.

The rows are in table.toml, with units, values and sources; docs/reference/imperfections.md shows them. What a magnitude
does is the simulator's; here is what a user may say of it, in a run or in a robot's file.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from numbers import Real
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import msgspec

from boebot.arguments import shown
from boebot.errors import BoardError, did_you_mean

LARGEST = 1e12  # of any magnitude: products of some of them stay finite
FILE = Path(__file__).with_name("table.toml")


class Imperfection(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One number of what a simulated robot is like; table.toml says what each key means.

    Attributes:
        name: lower case, with its unit where it has one: "servo_lag_s".
        of: types of devices, or "body" or "supply", that it belongs to.
    """

    name: str = ""
    of: tuple[str, ...] = ()
    value: float | None = None
    unit: str = ""
    what: str
    source: str
    switch: str = ""
    neutral: float = 0.0
    drawn: Literal["", "unit", "reading"] = ""
    least: float = 0.0
    most: float = LARGEST
    whole: bool = False
    needs: str = ""
    key: str = ""

    def fault(self, value: Any) -> str:
        """What is wrong with that magnitude, as the end of a sentence that begins with its place; "": nothing."""
        is_number = isinstance(value, Real) and not isinstance(value, bool)
        if is_number and self.least <= value <= self.most and not (self.whole and value % 1):
            return ""
        kind = "a whole number" if self.whole else "a finite number"
        least = "" if self.least == -self.most else f", at least {self.least:g}"
        most = "" if self.most == LARGEST else f", at most {self.most:g}"
        return f" is {shown(value)}; expected {kind}{self.unit and f' ({self.unit})'}{least}{most}"


@cache
def _file() -> Mapping[str, Mapping[str, Any]]:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


@cache
def imperfections() -> Mapping[str, Imperfection]:
    """The whole table, by name."""
    return MappingProxyType(
        {
            name: msgspec.convert(row | {"name": name, "of": of.split(", ")}, Imperfection)
            for of, rows in _file().items()
            if of != "switches"
            for name, row in rows.items()
        }
    )


def switches() -> Mapping[str, str]:
    """Names in `without`, and what is ideal without each."""
    return MappingProxyType(_file()["switches"])


def unknown(name: str) -> str:
    """The end of a sentence about a name that no imperfection has."""
    expected = "; `boebot list imperfections` has the names"
    return f"there is no imperfection {shown(name)}{expected}{did_you_mean(name, imperfections())}"


def checked(given: Any, place: str = "imperfections") -> dict[str, float]:
    """Magnitudes by name, each a number, in the order of the names.

    Raises:
        BoardError: it is no such mapping; there is no such name; or the magnitude is out of its range.
    """
    table = imperfections()
    if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
        raise BoardError(f'{place} is {shown(given)}; expected magnitudes by name, as in {{"servo_lag_s": 0.08}}')
    for name, value in given.items():
        if name not in table:
            raise BoardError(f"{place}: {unknown(name)}")
        if fault := table[name].fault(value):
            raise BoardError(f"{place}: {name}{fault}")
    return {name: float(given[name]) for name in sorted(given)}


def switched_off(without: Iterable[str]) -> dict[str, float]:
    """Neutral values by name, of switches or of single imperfections that have one.

    Raises:
        BoardError: there is no such switch.
    """
    values: dict[str, float] = {}
    for name in without:
        rows = [row for row in imperfections().values() if row.switch and name in (row.switch, row.name)]
        if not rows:
            raise BoardError(
                f"there is no imperfection {name!r} to switch off; `boebot list switches` has the names"
                + did_you_mean(name, switches())
            )
        values |= {row.name: row.neutral for row in rows}
    return values
