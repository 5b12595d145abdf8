"""What drives the lines of a board while its times are measured: which edges at which cycles, however time passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import cast

import pytest

from boebot_timing.emulated.loads import Bursts, Contact
from sim_bridge.bench.bench import Bench, Source
from sim_bridge.boards.board import Level


@dataclass
class Pins:
    """In place of a bench: keeps what is driven."""

    edges: list[tuple[int, Level]] = field(default_factory=list)

    def drive(self, pin: int, level: Level, at: int = 0) -> None:
        assert pin == 7
        self.edges.append((at, level))

    def wave(self, pin: int, cycles: Sequence[int], level: Level) -> None:
        for number, cycle in enumerate(cycles):
            self.drive(pin, Level(int(level) ^ number & 1), cycle)


def driven(source: Source, until: int, step: int) -> list[tuple[int, Level]]:
    """Its edges when the time up to `until` passes in slices of `step` cycles."""
    pins = Pins()
    for now in range(step, until + 1, step):
        source.queue(cast(Bench, pins), now)
    return pins.edges


@pytest.mark.parametrize("step", [50, 100, 1000])
def test_bursts(step: int) -> None:
    """Three edges, 10 cycles apart, every 300: each burst begins with the level that the last one did not leave."""
    low, high = Level.LOW, Level.HIGH
    assert driven(Bursts(7, 3, 10, 300, 5), 1000, step)[:9] == [
        *((5, high), (15, low), (25, high)),
        *((305, low), (315, high), (325, low)),
        *((605, high), (615, low), (625, high)),
    ]


def test_an_even_burst_leaves_the_level_as_it_was() -> None:
    edges = driven(Bursts(7, 4, 10, 300, 0), 600, 100)
    assert [level for _, level in edges] == [Level.HIGH, Level.LOW] * 4


@pytest.mark.parametrize("step", [50, 100, 1000])
def test_contact(step: int) -> None:
    assert driven(Contact(7, 500, 40, 20), 1000, step) == [
        *((20, Level.LOW), (60, Level.HIGH)),
        *((520, Level.LOW), (560, Level.HIGH)),
    ]
