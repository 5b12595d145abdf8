"""Bounds of response times: worked examples of textbooks, and simulations cycle by cycle of small sets of work."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avr_timing.interrupts.response import (
    Piece,
    Schedule,
    Source,
    Spell,
    longest_gap,
    misses,
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
    assert longest_gap(full, [Source("a", 4, 10)], 0, 0) is None
    assert responses(full, [Source("a", 3, 10)]) is not None


def test_no_source_without_an_interval() -> None:
    with pytest.raises(ValueError, match="no source"):
        Source("a", 1, 0)
    with pytest.raises(ValueError, match="no source"):
        Source("a", 1, 10, bursts=((3, 0),))


def test_bursts_have_both_bounds() -> None:
    """Frames of 3 bytes every 100 cycles, a byte every 10: 3 in each window up to 100, 6 up to 200."""
    frames = Source("bytes", 1, 10, bursts=((3, 100),))
    assert [frames.requests(w) for w in (0, 1, 10, 11, 30, 100, 101, 1000)] == [0, 1, 1, 2, 3, 3, 6, 30]
    assert frames.load == Fraction(3, 100)
    pairs = Source("bytes", 1, 10, bursts=((3, 100), (4, 1000)))
    assert [pairs.requests(w) for w in (30, 100, 101, 1000, 1001)] == [3, 3, 4, 4, 8]
    assert pairs.load == Fraction(4, 1000)


def test_source_that_ends_while_the_main_loop_is_busy() -> None:
    """By hand: 3 bytes of 4 cycles, one each 5, and then no more: 20 cycles of work end after 32."""
    ring = Source("receive", 4, 5, most=3)
    assert [ring.requests(w) for w in (0, 5, 6, 11, 1_000_000)] == [0, 1, 2, 3, 3]
    assert response(20, [ring]) == 32 and response(20, [Source("receive", 4, 5)]) == 100
    always = Schedule(((Piece("task", 60),),), slot_cycles=100, slots_per_tick=1)
    bound = responses(always, [ring, Source("b", 3, 10)])
    assert bound is not None and bound.tick == 105, "72 cycles of these, and 33 of 11 others"
    assert responses(always, [Source("receive", 4, 5), Source("b", 3, 10)]) is None


def test_source_that_comes_in_its_spells_only() -> None:
    """By hand: three from 20 to 50 in each 100, one each 10."""
    found = Source("burst", 1, 10, spells=(Spell(20, 50, 3, 10),), period=100)
    assert [found.requests(w, 0) for w in (10, 20, 29, 30, 60, 119, 120, 150)] == [0, 1, 1, 2, 3, 3, 4, 6]
    assert [found.requests(5, start) for start in (0, 20, 46, 60, 115, 146)] == [0, 1, 1, 0, 1, 1]
    assert found.requests(40) == 4, "at any time"


def test_several_frames_on_one_line() -> None:
    """By hand: 3 bytes in each 100 and 2 in each 1000 cycles, one each 10."""
    line = Source("bytes", 1, 10, parts=((3, 100), (2, 1000)))
    assert [line.requests(w) for w in (10, 40, 100, 101, 1001)] == [1, 4, 5, 8, 37]
    assert line.load == Fraction(3, 100) + Fraction(2, 1000)


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
    """Requests as early as can be after the first, which came late by all its jitter; before each, a rest of `late`."""
    found, rest = [0], 0
    for number in range(1, until // source.interval + 3):
        rest += late[number % len(late)]
        found.append(max(0, number * source.interval + rest - source.jitter))
    return found


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
    if all(busy) and max(bound.slots) <= 20:  # each slot then begins another busy period
        assert tuple(reached) == bound.slots, "there is a run in which it takes exactly this long"


def test_a_late_slot_delays_the_next() -> None:
    """By hand: slots of 10 with work 14 and 4: the second begins 4 late, ends 8 after it was due."""
    schedule = Schedule(((Piece("long", 14),), (Piece("short", 4),)), slot_cycles=10, slots_per_tick=2)
    bound = responses(schedule, [])
    assert bound is not None and (bound.slots, bound.pieces, bound.tick) == ((14, 8), {"long": 14, "short": 8}, 18)
    assert misses(schedule, bound.slots) == []
    assert misses(schedule, (14, 11)) == [1], "the second slot has no other slot of its tick to spare"
    assert misses(schedule, (21, 8)) == [0]


LONG = 500


def until_poll(schedule: Schedule, first: int, found: list[Source], before: int, after: int) -> int:
    """A main loop cycle by cycle, interrupts first: other work during which a slot begins, all slots that wait, and
    some more work, which is done before it polls; a slot that begins meanwhile goes before it."""
    requested = [(source, times(source, LONG, [0])) for source in found]
    slot, waiting, queue, left, rest = first, 0, list[int](), before, after
    for now in range(LONG + 1):
        if now and not (waiting or left or sum(queue) or rest):
            return now
        waiting += sum(source.cycles * moments.count(now) for source, moments in requested)
        if now % schedule.slot_cycles == 0:
            queue.append(schedule.work(slot))
            slot += 1
        while left == 0 and queue and queue[0] == 0:
            queue.pop(0)
        if waiting:
            waiting -= 1
        elif left:
            left -= 1
        elif queue:
            queue[0] -= 1
        elif rest:
            rest -= 1
    raise AssertionError("never polled")


@QUICK
@given(sources, st.lists(work, min_size=1, max_size=4), st.integers(1, 9), st.integers(0, 4))
def test_no_poll_comes_later_than_the_gap(found: list[Source], works: list[int], before: int, after: int) -> None:
    schedule = Schedule(tuple((Piece(f"t{n}", cycles),) for n, cycles in enumerate(works)), 20, 1)
    bound = longest_gap(schedule, found, before, after)
    if bound is None or bound > LONG:
        return
    assert max(until_poll(schedule, first, found, before, after) for first in range(len(works))) <= bound


def test_gap_by_hand() -> None:
    """Work of 60, 140 and 20 under a byte of 2 cycles every 10: 220 and 28 bytes take 276. Slots of 10 with work 14 and
    4 after 3: 18 and 22 and 36 cycles end when the next slot has begun, 40 just as it does."""
    slot = Schedule(((Piece("a", 100), Piece("b", 40)),), 1000, 1)
    receive = Source("receive", 2, 10)
    assert longest_gap(slot, [receive], 60, 20) == response(220, [receive]) == 276
    late = Schedule(((Piece("long", 14),), (Piece("short", 4),)), slot_cycles=10, slots_per_tick=2)
    assert longest_gap(late, [], 3, 1) == 40
