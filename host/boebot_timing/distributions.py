"""Jitter and latency as distributions: what was measured, in the emulator or by a board, and what it may be."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

CYCLES_PER_S = 16e6
CYCLES_PER_TICK = 160_000.0


@dataclass(frozen=True, slots=True)
class Distribution:
    """All values of one quantity under one load, in cycles of the board's clock, in the order in which they came.

    `least` and `most` are what it may be, from the notes of the project or derived from the schedule; None: not said.
    """

    quantity: str  # "servo width, left"
    meaning: str  # "of the pulse at pin 13, less what was set"
    load: str
    values: NDArray[np.int64] = field(repr=False)
    least: int | None = None
    most: int | None = None

    @property
    def count(self) -> int:
        """How many values there are."""
        return len(self.values)

    @property
    def minimum(self) -> float:
        """The least value (cycles); NaN where there is none."""
        return float(self.values.min()) if self.count else float("nan")

    @property
    def maximum(self) -> float:
        """The greatest value (cycles); NaN where there is none."""
        return float(self.values.max()) if self.count else float("nan")

    def percentile(self, share: float) -> float:
        """The smallest value that `share` percent of all do not exceed (cycles); NaN where there is none."""
        if not self.count:
            return float("nan")
        return float(np.percentile(self.values, share, method="inverted_cdf"))

    @property
    def broken(self) -> int:
        """How many values are not what they may be."""
        below = 0 if self.least is None else int(np.sum(self.values < self.least))
        above = 0 if self.most is None else int(np.sum(self.values > self.most))
        return below + above

    def summary(self) -> dict[str, Any]:
        """What a program reads of it; units in the keys."""
        numbers = {
            "min": self.minimum,
            "p50": self.percentile(50),
            "p99": self.percentile(99),
            "max": self.maximum,
        }
        said = {name: value if self.count else None for name, value in numbers.items()}
        cycles = {f"{name}_cycles": value for name, value in said.items()}
        seconds = {f"{name}_s": None if value is None else value / CYCLES_PER_S for name, value in said.items()}
        ticks = {"max_ticks": None if said["max"] is None else said["max"] / CYCLES_PER_TICK}
        texts = {name: getattr(self, name) for name in ("quantity", "meaning", "load")}
        limits = {"least_cycles": self.least, "most_cycles": self.most}
        return {**texts, **limits, "count": self.count, **cycles, **seconds, **ticks, "broken": self.broken}


@dataclass(frozen=True, slots=True)
class Losses:
    """What got lost under a load, counted by who knows best; all 0 where nothing was."""

    load: str
    frames: int  # refused at either end, or missing in the sequence numbers
    bytes: int  # that the receiver or its ring had no room for
    edges: int  # of encoders, that the counts lack
    ticks: int  # without telemetry
    late_ticks: int  # whose work went on when the next tick had begun
    masked: int  # telemetries with a masked encoder line
    resets: int

    @property
    def counts(self) -> dict[str, int]:
        """By their names."""
        return {name: value for name, value in asdict(self).items() if name != "load"}

    @property
    def anything(self) -> bool:
        """Whether any of it is not 0."""
        return any(self.counts.values())


@dataclass(frozen=True, slots=True)
class JitterReport:
    """All distributions of an image, and what got lost under each load."""

    distributions: tuple[Distribution, ...]
    losses: tuple[Losses, ...]

    @property
    def broken(self) -> list[Distribution]:
        """Those with a value that may not be."""
        return [one for one in self.distributions if one.broken]

    def as_json(self) -> dict[str, Any]:
        """For `--json`."""
        return {
            "distributions": [one.summary() for one in self.distributions],
            "losses": [asdict(one) for one in self.losses],
        }
