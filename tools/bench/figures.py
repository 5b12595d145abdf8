"""What a figure is, and the list of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Peer:
    """Somebody else's figure for the same thing, in the same unit: measured in the same run, or a published one."""

    name: str
    value: float | Callable[[], float]

    def measure(self) -> float:
        return self.value() if callable(self.value) else self.value


@dataclass(frozen=True)
class Figure:
    """One line of the table, still to be measured.

    Attributes:
        name: what is measured, and how.
        unit: of the value, the target and the peers.
        better: which way the target bounds the value.
        target: the bound; None: the figure is shown and no more.
        peers: somebody else's figures.
        measure: measures and returns the value.
        rounds: how often; the peers take turns with it.
        of: which of the rounds counts: the best, as other work on a machine only makes slower, or the median.
    """

    name: str
    unit: str
    better: Literal["more", "less"]
    target: float | None
    peers: tuple[Peer, ...]
    measure: Callable[[], float]
    rounds: int = 1
    of: Literal["best", "median"] = "best"

    def is_met_by(self, value: float) -> bool:
        if self.target is None:
            return True
        return value >= self.target if self.better == "more" else value <= self.target


FIGURES: list[Figure] = []


def figure(
    name: str,
    unit: str,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
    peers: Sequence[Peer] = (),
    rounds: int = 1,
    of: Literal["best", "median"] = "best",
) -> Callable[[Callable[[], float]], Callable[[], float]]:
    """Marks a function as the measurement of a figure with one bound, `at_least` or `at_most`, or none."""
    if at_least is not None and at_most is not None:
        raise ValueError(f"figure {name!r} has two bounds; expected at_least, at_most or neither")
    better: Literal["more", "less"] = "more" if at_most is None else "less"
    target = at_least if at_least is not None else at_most

    def register(measure: Callable[[], float]) -> Callable[[], float]:
        FIGURES.append(Figure(name, unit, better, target, tuple(peers), measure, rounds, of))
        return measure

    return register
