"""What a figure is, and the list of them."""

from __future__ import annotations

from collections.abc import Callable
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
        unit: of the value, the target and the peer.
        better: which way the target bounds the value.
        target: the bound.
        peer: somebody else's figure, or None.
        measure: measures and returns the value.
    """

    name: str
    unit: str
    better: Literal["more", "less"]
    target: float
    peer: Peer | None
    measure: Callable[[], float]

    def is_met_by(self, value: float) -> bool:
        return value >= self.target if self.better == "more" else value <= self.target


FIGURES: list[Figure] = []


def figure(
    name: str,
    unit: str,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
    peer: Peer | None = None,
) -> Callable[[Callable[[], float]], Callable[[], float]]:
    """Marks a function as the measurement of a figure with one bound, `at_least` or `at_most`."""
    if (at_least is None) == (at_most is None):
        raise ValueError(f"figure {name!r} needs either at_least or at_most")
    better: Literal["more", "less"] = "more" if at_least is not None else "less"
    target = at_least if at_least is not None else at_most
    assert target is not None

    def register(measure: Callable[[], float]) -> Callable[[], float]:
        FIGURES.append(Figure(name, unit, better, target, peer, measure))
        return measure

    return register
