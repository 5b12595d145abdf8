"""What a figure is, and the list of them.

A bound on what depends on the machine is a ratio: to a peer that is measured in turns with it, or to a plain loop in
Python. What no machine changes, such as a count of cycles in the emulator, and what is a ratio by itself has a bound in
its own unit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from boebot.result import RunResult
from boebot.running.loop import execute
from boebot.running.tasks import Request


@dataclass(frozen=True)
class Peer:
    """Somebody else's figure for the same thing, or a reference, in the same unit."""

    name: str
    measure: Callable[[], float]


@dataclass(frozen=True)
class Figure:
    """One line of the table, still to be measured.

    Attributes:
        name: what is measured, and how.
        unit: of the value and the peers.
        better: which way the target bounds the value.
        target: the bound; None: the figure is shown and no more.
        of_peer: the target is one of the ratio to the first peer.
        peers: others' figures.
        measure: measures and returns the value.
        rounds: how often; the peers take turns with it.
        of: which of the rounds counts: the best, as other work on a machine only makes slower, or the median.
    """

    name: str
    unit: str
    better: Literal["more", "less"]
    target: float | None
    of_peer: bool
    peers: tuple[Peer, ...]
    measure: Callable[[], float]
    rounds: int = 1
    of: Literal["best", "median"] = "best"

    def is_met_by(self, value: float) -> bool:
        """Of the value, or of its ratio to the first peer."""
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
    times_at_least: float | None = None,
    times_at_most: float | None = None,
    peers: Sequence[Peer] = (),
    rounds: int = 1,
    of: Literal["best", "median"] = "best",
) -> Callable[[Callable[[], float]], Callable[[], float]]:
    """Marks a function as the measurement of a figure with one bound at most, on its value or on how many times it is
    the first peer's."""
    bounds = [bound for bound in (at_least, at_most, times_at_least, times_at_most) if bound is not None]
    of_peer = times_at_least is not None or times_at_most is not None
    if len(bounds) > 1 or (of_peer and not peers):
        raise ValueError(f"figure {name!r} has two bounds, or one of a ratio and no peer; expected one at most")
    better: Literal["more", "less"] = "more" if at_most is None and times_at_most is None else "less"
    target = bounds[0] if bounds else None

    def register(measure: Callable[[], float]) -> Callable[[], float]:
        FIGURES.append(Figure(name, unit, better, target, of_peer, tuple(peers), measure, rounds, of))
        return measure

    return register


def ran(request: Request, **terms: Any) -> RunResult:
    """A run that came to its end; `terms` as of `execute`."""
    result: RunResult = execute(request, **terms)
    if result.error is not None:
        raise result.error
    return result


def loop_s(turns: int) -> float:
    """The time (s) of a plain loop in Python."""
    begun, value = time.perf_counter(), 1
    for _ in range(turns):
        value = value * 1103515245 + 12345 & 0x7FFFFFFF
    return time.perf_counter() - begun


def loop(turns: int, per_s: float = 1.0) -> Peer:
    """A plain loop as a reference for a time; `per_s`: of the figure's unit."""
    return Peer(f"a loop of {turns:,} turns in Python", lambda: per_s * loop_s(turns))
