"""The ring of changes: what it must hold by closed form, and against a main loop cycle by cycle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avr_timing.interrupts.response import Piece, Schedule, Source, load
from boebot_timing import budget, loads
from boebot_timing.changes import most_waiting
from boebot_timing.costs import Costs
from boebot_timing.loads import LOADS
from boebot_timing.table import Constants, InterruptRow
from boebot_timing.tests import timing_program

ROUND, LOOP, FRAME, CHANGE = 100, 20, 2000, 10
COSTS = Costs(
    tasks={},
    unbounded={},
    interrupts={},
    charged={},
    heeding=frozenset(),
    latencies={},
    loop=LOOP,
    round=ROUND,
    around=0,
    frame=FRAME,
    edges=5,
    change=CHANGE,
    changes_due=8,
)
LINE = Source("line", 0, 1000)


def slots(*cycles: int, every: int = 40_000) -> Schedule:
    return Schedule(tuple((Piece("all", one),) for one in cycles), every, 1)


def test_frame_comes_upon_changes_that_were_not_due() -> None:
    """By hand: 7 stay, and 20 + 2000 + 100 + 10 cycles pass until the first is worked off: 3 come in 2130."""
    assert most_waiting(COSTS, slots(ROUND), [], [LINE], 0) == COSTS.changes_due - 1 + 3
    assert most_waiting(COSTS, slots(ROUND), [], [LINE], 870) == COSTS.changes_due - 1 + 4  # at 3000 a fourth
    assert most_waiting(COSTS, slots(ROUND), [], [LINE, LINE], 0) == COSTS.changes_due - 1 + 6


@pytest.mark.parametrize(
    ("slot", "most"),
    [
        (11_660, 12),  # 12 found, 100 more, one worked off: 11,890; 12 lines have come, at 0, 1000, ... 11,000
        (11_790, 13),  # 10 found, as after a frame: just 12,000, when one more comes; 13 found: 12,030
    ],
)
def test_slot_lies_between_two_polls(slot: int, most: int) -> None:
    """By hand; that other slots wait does not matter, for each of them begins with a poll."""
    assert most_waiting(COSTS, slots(ROUND, slot), [], [LINE], 0) == most
    assert most_waiting(COSTS, slots(slot, slot, slot, every=1), [], [LINE], 0) == most


@pytest.mark.parametrize(
    ("slot", "most"),
    [
        (11_375, 48),  # 48 found: 11,375 + 480 + 100 + 10 = 11,965; four are worked off before, at 12,005, four come
        (11_405, 52),  # 11,995: but one is worked off when four come, 51; then 12,025, and it is 52 before any is
    ],
)
def test_four_lines_change_while_the_ring_is_worked_off(slot: int, most: int) -> None:
    """By hand: all four at once, each 1000 cycles; 48 until 12,000."""
    assert most_waiting(COSTS, slots(slot), [], [LINE] * 4, 0) == most


def test_interrupts_lengthen_what_lies_between() -> None:
    """By hand: 2130 cycles under 50 in each 100 take 4280, for 43 * 50 = 2150: 5 changes."""
    assert most_waiting(COSTS, slots(ROUND), [Source("i", 50, 100)], [LINE], 0) == COSTS.changes_due - 1 + 5


class Loop:
    """The main loop, cycle by cycle: slots before changes that are due before a frame, of which there is always one."""

    def __init__(self, found: Costs, works: list[int], every: int) -> None:
        self.found, self.works, self.every = found, works, every
        self.ring = self.most = self.slots_waiting = self.slot = 0

    def poll(self) -> Iterator[None]:
        for _ in range(self.ring):
            yield from [None] * self.found.change
            self.ring -= 1

    def run(self) -> Iterator[None]:
        while True:
            if self.slots_waiting:
                before = self.found.round // 2
                yield from [None] * before
                yield from self.poll()
                yield from [None] * (self.works[self.slot % len(self.works)] - before)
                self.slots_waiting -= 1
                self.slot += 1
            elif self.ring >= COSTS.changes_due:
                yield from [None] * self.found.loop
                yield from self.poll()
            else:
                yield from [None] * (self.found.loop + self.found.frame)

    def simulate(self, interrupts: list[Source], lines: list[Source], phases: list[int], end: int) -> int:
        main, stolen = self.run(), 0
        for now in range(end):
            stolen += sum(one.cycles for one in interrupts if now % one.interval == 0)
            coming = sum((now + phase) % one.interval == 0 for one, phase in zip(lines, phases, strict=False))
            self.ring += coming
            self.most = max(self.most, self.ring)
            self.slots_waiting += now % self.every == 0
            if stolen:
                stolen -= 1
            else:
                next(main)
        return self.most


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(8, 110), min_size=1, max_size=4),
    st.integers(0, 80),
    st.integers(1, 3),
    st.lists(st.integers(12, 40), min_size=1, max_size=4),
    st.lists(st.integers(0, 39), min_size=4, max_size=4),
    st.integers(0, 3),
)
def test_no_simulation_holds_more(
    works: list[int], frame: int, change: int, intervals: list[int], phases: list[int], stolen: int
) -> None:
    found = replace(COSTS, loop=3, round=8, frame=frame, change=change)
    lines, interrupts = [Source("line", 0, one) for one in intervals], [Source("i", stolen, 10)]
    schedule = slots(*works, every=200)
    worked_off = [replace(one, cycles=change) for one in lines]
    if load([*interrupts, *worked_off]) + schedule.mean_load >= 1:
        return
    bound = most_waiting(found, schedule, interrupts, lines, 0)
    assert bound is not None
    assert Loop(found, works, 200).simulate(interrupts, lines, phases, 2000) <= bound


# ---- of an image ---------------------------------------------------------------------------------------------------


def test_image_without_encoders_has_no_changes(tmp_path: Path) -> None:
    report = budget.prove(timing_program.build(tmp_path), LOADS["figures"])
    assert report.changes is None and report.notes == []


def test_requests_come_closer_than_in_the_long_run() -> None:
    """38 periods of 42.1 kHz in a burst, two bursts in a tick, up to 4,000 cycles late, 190 cycles from edge to edge;
    five changes of the encoders at once where a line is noisy."""
    constants, overload = Constants(**timing_program.CONSTANTS), LOADS["overload"]
    (carrier,) = overload.requests(InterruptRow("carrier", loads.CARRIER, 0, 0, 952), constants)
    assert [carrier.requests(w) for w in (1, 190, 191, 1900, 156_000)] == [1, 1, 2, 10, 2 * 76]
    (changes,) = overload.requests(InterruptRow("changes", loads.ENCODERS, 0, 0, 1000), constants)
    assert [changes.requests(w) for w in (1, 1000, 1001)] == [5, 5, 6]
