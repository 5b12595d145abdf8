"""What was measured of a running image: spans of tasks and interrupts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

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
    latency: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, dtype=np.uint32))
    """of an interrupt: from each request to acceptance, without those of the preparations"""

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
    busiest_tick: int = 0  # most cycles in one control tick in which any instruction ran
    between_polls: int = 0  # most cycles from one poll of the link to the next without sleep
    tick: tuple[Moment, ...] = ()  # a whole one, in the order in which its spans began
    losses: dict[str, int] = field(default_factory=dict)  # what should have come and did not, counted by kind
    by_scenario: dict[str, Measurement] = field(default_factory=dict)  # where there were several


def merged(runs: Sequence[Measurement]) -> Measurement:
    """Runs of several scenarios of one image, one of each, as one: all their spans, the larger of their maxima, the
    mean of their loads by time; and each by itself."""
    seconds = sum(run.seconds for run in runs)
    return Measurement(
        tasks=_together([run.tasks for run in runs]),
        interrupts=_together([run.interrupts for run in runs]),
        lowest_stack=min(run.lowest_stack for run in runs),
        seconds=seconds,
        load=sum(run.load * run.seconds for run in runs) / seconds,
        worst_tick=max(run.worst_tick for run in runs),
        scenarios=tuple(name for run in runs for name in run.scenarios),
        busiest_tick=max(run.busiest_tick for run in runs),
        between_polls=max(run.between_polls for run in runs),
        tick=next((run.tick for run in runs if run.tick), ()),
        losses={name: sum(run.losses.get(name, 0) for run in runs) for run in runs for name in run.losses},
        by_scenario={run.scenarios[0]: run for run in runs},
    )


def _together(parts: list[dict[str, Spans]]) -> dict[str, Spans]:
    return {name: _one([part[name] for part in parts]) for name in parts[0]}


def _one(spans: list[Spans]) -> Spans:
    longest = max(spans, key=lambda one: one.largest)
    return Spans(
        name=longest.name,
        net=np.concatenate([one.net for one in spans]),
        gross=np.concatenate([one.gross for one in spans]),
        worst=longest.worst,
        latency=np.concatenate([one.latency for one in spans]),
    )


def statistics(cycles: NDArray[np.uint32]) -> dict[str, float]:
    """Count, minimum, mean, 99th percentile and maximum; only the count where there is nothing."""
    if not len(cycles):
        return {"count": 0}
    return {
        "count": len(cycles),
        "min": int(cycles.min()),
        "mean": round(float(cycles.mean()), 1),
        "p99": int(np.percentile(cycles, 99, method="inverted_cdf")),
        "max": int(cycles.max()),
    }


def as_json(measurement: Measurement) -> dict[str, Any]:
    """What was measured as plain numbers, for a file; units in the keys."""

    def rows(spans: dict[str, Spans]) -> dict[str, Any]:
        return {
            name: {
                "net_cycles": statistics(one.net),
                "gross_cycles": statistics(one.gross),
                **({"latency_cycles": statistics(one.latency)} if len(one.latency) else {}),
                "worst": {"scenario": one.worst.scenario, "seed": one.worst.seed, "cycle": one.worst.cycle},
            }
            for name, one in spans.items()
        }

    return {
        "tasks": rows(measurement.tasks),
        "interrupts": rows(measurement.interrupts),
        "scenarios": list(measurement.scenarios),
        "seconds": measurement.seconds,
        "load_share": measurement.load,
        "worst_tick_cycles": measurement.worst_tick,
        "busiest_tick_cycles": measurement.busiest_tick,
        "between_polls_cycles": measurement.between_polls,
        "lowest_stack_address": measurement.lowest_stack,
        "losses": measurement.losses,
        "by_scenario": {name: as_json(one) for name, one in measurement.by_scenario.items()},
    }
