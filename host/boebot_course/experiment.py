"""What an experiment is: a function of a seed that gives measured against expected figures, a picture, and data."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:  # matplotlib takes a while, and only what draws imports it
    Axes = Figure = Any

Floats = NDArray[np.float64]


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
    def word(self) -> str:
        """The verdict in a word."""
        return "met" if self.is_met else "missed"

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


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment on one robot, to be run by `boebot experiment NAME`; with another one too by `--on`."""

    name: str
    """such as "E22"; on another robot or board than the first one "E22-avr\""""
    on: str = ""
    """what `--on` calls the robot or board, where there are several"""
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
    run: Callable[[int], Outcome]
    """runs it with a seed"""

    @property
    def bare_name(self) -> str:
        """Without the robot, as `boebot experiment` takes it."""
        return self.name.removesuffix(f"-{self.on}")

    @property
    def section(self) -> str:
        """The first section or chapter of the notes that `source` names; "" where it names none."""
        found = re.search(r"(?:sections?|chapter) (\d+(?:\.\d+)*)\b(?!\.\d)", self.source)
        return found[1] if found else ""


class Variant:
    """A robot on which an experiment runs: in words, what its function is given before the seed, and whether
    it is slow there."""

    def __init__(self, robot: str, *given: Any, slow: bool = False) -> None:
        self.robot, self.given, self.slow = robot, given, slow


EXPERIMENTS: dict[str, Experiment] = {}


def experiment(
    name: str, *, robot: str = "none", slow: bool = False, on: Mapping[str, Variant] | None = None
) -> Callable[[Callable[..., Outcome]], Callable[..., Outcome]]:
    """Marks a function as an experiment: on one robot, or on several by the names that `--on` takes.

    Its docstring says what it is, in paragraphs: the title; "In the notes: ..."; "Figure: ...", the caption;
    "Expected: ...", where the criterion comes from, or "Expected on NAME: ..." where it differs on that robot.
    """

    def register(run: Callable[..., Outcome]) -> Callable[..., Outcome]:
        if name in EXPERIMENTS:
            raise ValueError(f"there are two experiments {name}")
        title, *paragraphs = (" ".join(part.split()) for part in (inspect.getdoc(run) or "").split("\n\n"))
        texts = {head: text for head, _, text in (part.partition(": ") for part in paragraphs)}
        for number, (key, variant) in enumerate((on or {"": Variant(robot, slow=slow)}).items()):
            label = f"{name}-{key}" if number else name
            EXPERIMENTS[label] = Experiment(
                name=label,
                on=key,
                title=title,
                source=texts["In the notes"],
                caption=texts["Figure"],
                robot=variant.robot,
                criterion=texts[f"Expected on {key}" if f"Expected on {key}" in texts else "Expected"],
                slow=variant.slow,
                run=partial(run, *variant.given),
            )
        return run

    return register
