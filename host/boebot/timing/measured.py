"""What was measured of a running image: spans of tasks and interrupts, whoever measured them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Worst:
    """The circumstances of a maximum: enough to see it again."""

    scenario: str
    seed: int
    cycle: int  # of the board's clock at which the span began


@dataclass(frozen=True, slots=True)
class Spans:
    """All spans of one task or interrupt, in cycles, in the order in which they began.

    `net` leaves out the interrupts that came in between, `gross` counts them. An interrupt's span is from acceptance to
    the end of RETI; a task's from its call to the end of its return.
    """

    name: str
    net: NDArray[np.uint32]
    gross: NDArray[np.uint32]
    worst: Worst

    @property
    def largest(self) -> int:
        """Cycles of the longest, net."""
        return int(self.net.max(initial=0))


@dataclass(frozen=True, slots=True)
class Moment:
    """One span of one tick: `begin` and `end` in cycles since the tick began, interrupts in between counted."""

    name: str
    kind: str  # "task" or "interrupt"
    begin: int
    end: int


@dataclass(frozen=True, slots=True)
class Measurement:
    """Of one or several runs: spans by the names of the timing table, and what the runs were like."""

    tasks: dict[str, Spans]
    interrupts: dict[str, Spans]
    lowest_stack: int  # lowest value of the stack pointer, an address in data memory
    seconds: float  # of the board's time
    load: float  # share of cycles in which instructions ran, 0..1
    worst_tick: int = 0  # most cycles of tasks and interrupts in one control tick
    scenarios: tuple[str, ...] = field(default_factory=tuple)
    tick: tuple[Moment, ...] = ()  # a whole one, in the order in which its spans began
