"""Bounds of response times: worked examples of textbooks, and simulations cycle by cycle of small sets of work."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boebot.timing.response import (
    Piece,
    Schedule,
    Source,
    misses,
    poll_gap,
    receive_backlog,
    response,
    responses,
)

QUICK = settings(max_examples=60, deadline=None)


def test_example_of_burns_and_wellings() -> None:
    """Real-Time Systems and Programming Languages, section 11.5: (T, C) = (7, 3), (12, 3), (20, 5) gives 3, 6, 20."""
    a, b = Source("a", 3, 7), Source("b", 3, 12)
    assert [response(3, []), response(3, [a]), response(5, [a, b])] == [3, 6, 20]


def test_example_with_release_jitter() -> None:
    """By hand: work 5 under C 2, T 10, J 3: with jitter a second request comes 7 after the first: 5 + 2 + 2 = 9."""
    assert response(5, [Source("a", 2, 10)]) == 7
    assert response(5, [Source("a", 2, 10, jitter=3)]) == 7
    assert response(6, [Source("a", 2, 10, jitter=3)]) == 10


def test_overload_is_said() -> None:
    assert response(1, [Source("a", 5, 10), Source("b", 5, 10)]) is None, "interrupts alone take all"
    full = Schedule(((Piece("task", 60),),), slot_cycles=100, slots_per_tick=1)
    assert responses(full, [Source("a", 4, 10)]) is None
    assert receive_backlog(full, [Source("a", 4, 10)], Source("a", 4, 10), 20, 0) is None
    assert responses(full, [Source("a", 3, 10)]) is not None


def test_no_source_without_an_interval() -> None:
    with pytest.raises(ValueError, match="no source"):
        Source("a", 1, 0)
    with pytest.raises(ValueError, match="no source"):
        Source("a", 1, 10, burst=3)


def test_bursts_have_both_bounds() -> None:
    """Frames of 3 bytes every 100 cycles, a byte every 10: 3 in each window up to 100, 6 up to 200."""
    frames = Source("bytes", 1, 10, burst=3, period=100)
    assert [frames.requests(w) for w in (0, 1, 10, 11, 30, 100, 101, 1000)] == [0, 1, 1, 2, 3, 3, 6, 30]
    assert frames.load == Fraction(3, 100)


# ---- simulation: one cycle after another ---------------------------------------------------------------------------

sources = st.lists(
    st.builds(
        lambda cycles, more, jitter: Source("i", cycles, cycles * 4 + more, min(jitter, 3 * cycles)),
        st.integers(1, 3),
        st.integers(0, 30),
        st.integers(0, 9),
    ),
    min_size=0,
    max_size=3,
)
work = st.integers(0, 12)


def times(source: Source, until: int, late: list[int]) -> list[int]:
    """Requests as early as can be after the first, which came late by all its jitter; each then `late` by so much."""
    found = [0]
    for number in range(1, until // source.interval + 3):
        found.append(max(0, number * source.interval - source.jitter) + late[number % len(late)] * (number > 0))
    return sorted(found)


def simulate(schedule: Schedule, first: int, requested: list[tuple[Source, list[int]]], end: int) -> list[int]:
    """The longest time from the beginning of each slot of the cycle to the end of its work, interrupts first."""
    longest = [0] * len(schedule.slots)
    slot, left, waiting = first, schedule.blocking, 0
    queue: list[tuple[int, int, int]] = []  # slot of the cycle, due, cycles left
    for now in range(end):
        waiting += sum(source.cycles * moments.count(now) for source, moments in requested)
        if now % schedule.slot_cycles == 0:
            queue.append((slot % len(schedule.slots), now, schedule.work(slot)))
            slot += 1
        while queue and left == 0 and queue[0][2] == 0:
            longest[queue[0][0]] = max(longest[queue[0][0]], now - queue[0][1])
            queue.pop(0)
        if waiting:
            waiting -= 1
        elif left:
            left -= 1
        elif queue:
            queue[0] = (queue[0][0], queue[0][1], queue[0][2] - 1)
    return longest


@QUICK
@given(sources, st.lists(work, min_size=1, max_size=4), st.integers(0, 5), st.lists(st.integers(0, 9), min_size=1))
def test_no_simulation_exceeds_the_bound_and_the_worst_meets_it(
    found: list[Source], works: list[int], blocking: int, late: list[int]
) -> None:
    schedule = Schedule(tuple((Piece(f"t{n}", cycles),) for n, cycles in enumerate(works)), 20, 1, blocking)
    bound = responses(schedule, found)
    if bound is None:
        return
    end = 20 * 14
    reached = [0] * len(works)
    for first in range(len(works)):
        worst = simulate(schedule, first, [(source, times(source, end, [0])) for source in found], end)
        other = simulate(schedule, first, [(source, times(source, end, late)) for source in found], end)
        assert all(one <= most for one, most in zip(other, bound.slots, strict=True))
        reached = [max(pair) for pair in zip(reached, worst, strict=True)]
    busy = [cycles > 0 for cycles in works]
    assert all(one <= most for one, most in zip(reached, bound.slots, strict=True))
    if all(busy) and max(bound.slots) <= 20:  # each slot then begins a busy period of its own
        assert tuple(reached) == bound.slots, "there is a run in which it takes just so long"


def test_a_late_slot_delays_the_next() -> None:
    """By hand: slots of 10 with work 14 and 4: the second begins 4 late, ends 8 after it was due."""
    schedule = Schedule(((Piece("long", 14),), (Piece("short", 4),)), slot_cycles=10, slots_per_tick=2)
    bound = responses(schedule, [])
    assert bound is not None and (bound.slots, bound.pieces, bound.tick) == ((14, 8), {"long": 14, "short": 8}, 18)
    assert misses(schedule, bound.slots) == []
    assert misses(schedule, (14, 11)) == [1], "the second slot has no other slot of its tick to spare"
    assert misses(schedule, (21, 8)) == [0]


@QUICK
@given(st.lists(st.integers(1, 60), min_size=1, max_size=6), st.integers(1, 3), st.integers(3, 6), st.integers(2, 9))
def test_ring_holds_what_comes_between_polls(cycles: list[int], each: int, every: int, frame: int) -> None:
    """Pieces back to back for one cycle, a poll after each that takes one frame: what waits never exceeds the bound."""
    bytes_ = Source("receive", each, every + each)
    pieces = tuple(Piece(f"t{n}", some, polls=1) for n, some in enumerate(cycles))
    schedule = Schedule((pieces,), 4000, 1)
    bound = receive_backlog(schedule, [bytes_], bytes_, frame, frame - 1)
    assert bound is not None
    held, interrupt, now = frame - 1, 0, 0
    most = held
    for piece in pieces:
        left = piece.cycles
        while left:
            if now % bytes_.interval == 0:
                held, interrupt = held + 1, interrupt + bytes_.cycles
            most = max(most, held)
            if interrupt:
                interrupt -= 1
            else:
                left -= 1
            now += 1
        if held >= frame:
            held -= frame
    assert most <= bound


def test_ring_and_gap_by_hand() -> None:
    """Tasks of 100 and 40 cycles, a poll after each, a byte of 2 cycles every 10: 100 and 13 bytes take 126, the
    fourteenth comes at 130."""
    schedule = Schedule(((Piece("a", 100, polls=1), Piece("b", 40, polls=1)),), 1000, 1)
    receive = Source("receive", 2, 10)
    assert poll_gap(schedule, [receive]) == response(100, [receive]) == 126
    assert receive_backlog(schedule, [receive], receive, frame_least=20, idle_most=0) == 13
