"""What an experiment is: a function of a seed that gives measured against expected figures, a picture, and data."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
Progress = Callable[[float], None]
"""Called now and then with the share that is done, 0 to 1."""
Thing = TypeVar("Thing")


@dataclass(frozen=True)
class Measured:
    """One figure and its criterion: at least `least`, at most `most`."""

    name: str
    value: float
    unit: str = ""
    least: float = -math.inf
    most: float = math.inf

    def __post_init__(self) -> None:
        for name in ("value", "least", "most"):  # numpy's numbers compare to numpy's truths, which JSON does not know
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def is_met(self) -> bool:
        """The value is within its bounds."""
        return self.least <= self.value <= self.most

    @property
    def text(self) -> str:
        """The value in as few digits, four or more, as are within the bounds just where the value is."""
        if not math.isfinite(self.value) or self.value == round(self.value):
            return f"{self.value + 0.0:.0f}"  # + 0.0: no negative zero
        least = max(4, len(f"{abs(self.value):.0f}"))
        texts = (f"{self.value:.{digits}g}" for digits in range(least, 18))
        return next(text for text in texts if (self.least <= float(text) <= self.most) == self.is_met)

    @property
    def expected(self) -> str:
        """The criterion in words."""
        if self.least == self.most:
            return f"{self.least:g}"
        if math.isinf(self.least) and math.isinf(self.most):
            return "no criterion"
        if math.isinf(self.least):
            return f"at most {self.most:g}"
        if math.isinf(self.most):
            return f"at least {self.least:g}"
        if f"{self.least:g}" == f"{self.most:g}":
            return f"{(self.least + self.most) / 2:g} ± {(self.most - self.least) / 2:.1g}"
        return f"{self.least:g} to {self.most:g}"


def about(name: str, value: float, expected: float, tolerance: float, unit: str = "") -> Measured:
    """A figure that should be `expected`, plus or minus `tolerance`."""
    return Measured(name, value, unit, expected - tolerance, expected + tolerance)


def exactly(name: str, value: float, expected: float, unit: str = "") -> Measured:
    """A figure that should be just that."""
    return Measured(name, value, unit, expected, expected)


@dataclass(frozen=True)
class Outcome:
    """What came of an experiment."""

    measured: Sequence[Measured]
    data: Mapping[str, Any]
    """columns of the CSV file, units in their names; all of the same length"""
    draw: Callable[[Figure], None]
    """draws the figure that the notes' caption describes"""

    @property
    def is_met(self) -> bool:
        """All criteria are met."""
        return all(one.is_met for one in self.measured)

    def columns(self) -> dict[str, NDArray[Any]]:
        """The data as arrays.

        Raises:
            ValueError: they are no columns of one length.
        """
        columns = {name: np.asarray(column) for name, column in self.data.items()}
        if len({column.shape for column in columns.values()}) != 1 or any(c.ndim != 1 for c in columns.values()):
            shapes = ", ".join(f"{name} {column.shape}" for name, column in columns.items())
            raise ValueError(f"the data are no columns of one length: {shapes or 'there are none'}")
        return columns


Run = Callable[[int, Progress], Outcome]
"""Runs an experiment with a seed."""


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment, to be run by `boebot experiment NAME`."""

    name: str
    """as in `boebot list experiments`, such as "E22\""""
    title: str
    source: str
    """where in the notes"""
    caption: str
    """of its figure"""
    robot: str = "none"
    """the robot that it runs on, and its board where it has one, such as "shieldbot (native)"; or "none" """
    criterion: str
    """where the expected values come from, in sentences"""
    slow: bool = False
    """takes more than some two seconds"""
    run: Run

    @property
    def section(self) -> str:
        """The first section or chapter of the notes that `source` names; "" where it names none."""
        found = re.search(r"(?:sections?|chapter) (\d+(?:\.\d+)*)\b(?!\.\d)", self.source)
        return found[1] if found else ""


EXPERIMENTS: dict[str, Experiment] = {}


def experiment(name: str, **description: Any) -> Callable[[Run], Run]:
    """Marks a function as an experiment; `description` holds the other fields of `Experiment`."""

    def register(run: Run) -> Run:
        if name in EXPERIMENTS:
            raise ValueError(f"there are two experiments {name}")
        EXPERIMENTS[name] = Experiment(name=name, run=run, **description)
        return run

    return register


def with_progress(things: Sequence[Thing], progress: Progress) -> Iterator[Thing]:
    """Each thing in turn; `progress` is called after each."""
    for number, thing in enumerate(things, 1):
        yield thing
        progress(number / len(things))
