"""How long work takes at most when interrupts come on top of it: response-time analysis.

M. Joseph, P. Pandya, "Finding response times in a real-time system", The Computer Journal 29 (1986); N. Audsley et al.,
"Applying new scheduling theory to static priority pre-emptive scheduling", Software Engineering Journal 8 (1993). Work
of C cycles that begins together with the first request of every interrupt is done after the least R with

    R = C + sum over interrupts i of ceil((R + J_i) / T_i) C_i

and at no other moment does it take longer. Where R does not exist the interrupts alone are too much: overload.

What an interrupt itself waits is in interrupts_off.py. All times are in cycles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

BUSY_MOST = 3
HORIZON = 1 << 24  # a second of 16 MHz: what has not ended by then is overload


@dataclass(frozen=True, slots=True)
class Spell:
    """From `begin` to `end`, in each period of the schedule, something comes at most `most` times, one each
    `interval`."""

    begin: int
    end: int
    most: int = 1
    interval: int = 1

    def requests(self, start: int, window: int, period: int) -> int:
        """Of how much comes at most in a window that begins `start` cycles after a period has begun."""
        found = 0
        first = start - start % period - period
        for begun in range(first, start + window + 1, period):
            shared = min(begun + self.end, start + window) - max(begun + self.begin, start)
            if shared >= 0:
                found += min(self.most, shared // self.interval + 1)
        return found


@dataclass(frozen=True, slots=True)
class Source:
    """What requests an interrupt, and what each time costs.

    In any window of w cycles it comes at most ceil((w + jitter) / interval) times; and for each (n, period) of `bursts`
    at most n times in each period, as the bytes of one frame a tick do; and of `parts` so often as these n in their
    periods are in sum, as the bytes of several frames on one line do. `most`: so often at most while slots keep the
    main loop busy, however long that is, as the receive interrupt switches itself off when its ring is full. `spells`:
    it comes in these only, of each `period` cycles from the beginning of slot 0 on.
    """

    name: str
    cycles: int
    interval: int
    jitter: int = 0
    bursts: tuple[tuple[int, int], ...] = ()
    parts: tuple[tuple[int, int], ...] = ()
    most: int | None = None
    spells: tuple[Spell, ...] = ()
    period: int = 1

    def __post_init__(self) -> None:
        limits = (number for burst in (*self.bursts, *self.parts) for number in burst)
        if self.cycles < 0 or self.interval <= 0 or self.jitter < 0 or any(number <= 0 for number in limits):
            raise ValueError(f"{self.name}: no source of interrupts: {self}")

    def requests(self, window: int, start: int | None = None) -> int:
        """The most that can come in a window of `length` cycles, which begins `start` cycles after slot 0; None: at any
        time."""
        if window <= 0:
            return 0
        limits = ((1, self.interval), *self.bursts)
        found = min(most * _ceil(window + self.jitter, period) for most, period in limits)
        if self.parts:
            found = min(found, sum(most * _ceil(window + self.jitter, period) for most, period in self.parts))
        if self.most is not None:
            found = min(found, self.most)
        if start is None or not self.spells:
            return found
        return min(found, sum(spell.requests(start, window, self.period) for spell in self.spells))

    @property
    def load(self) -> Fraction:
        """Its share of all cycles in the long run of a busy main loop."""
        if self.most is not None:
            return Fraction(0)
        limits = [Fraction(most, period) for most, period in ((1, self.interval), *self.bursts)]
        if self.parts:
            limits.append(sum((Fraction(most, period) for most, period in self.parts), Fraction(0)))
        return min(limits) * self.cycles


def _ceil(a: int, b: int) -> int:
    return -(-a // b)


def load(sources: Iterable[Source]) -> Fraction:
    """Share of all cycles that interrupts take in the long run."""
    return sum((source.load for source in sources), Fraction(0))


def response(work: int, sources: Sequence[Source], start: int | None = None) -> int | None:
    """After how many cycles such work is done at the latest that begins at `start` (Source.requests); None:
    overload."""
    if work <= 0:
        return 0
    if load(sources) >= 1:
        return None
    return _least(lambda time: work + sum(source.cycles * source.requests(time, start) for source in sources), work)


@dataclass(frozen=True, slots=True)
class Piece:
    """Work that nothing but interrupts comes in between: a task, and what the main loop does before and after it."""

    name: str
    cycles: int


@dataclass(frozen=True, slots=True)
class Schedule:
    """A cyclic executive: the pieces of each slot of a whole cycle, in their order.

    `blocking` is what the main loop may be at when a slot begins and no other waits: it does not leave it.
    Where a piece ends later than `latest` after its slot began, the executive does something else than this; 0: never.
    """

    slots: tuple[tuple[Piece, ...], ...]
    slot_cycles: int
    slots_per_tick: int
    blocking: int = 0
    latest: int = 0

    def work(self, slot: int) -> int:
        """Cycles of a slot's pieces."""
        return sum(piece.cycles for piece in self.slots[slot % len(self.slots)])

    def tick_work(self, tick: int) -> int:
        """Cycles of all pieces of a tick."""
        first = tick * self.slots_per_tick
        return sum(self.work(slot) for slot in range(first, first + self.slots_per_tick))

    @property
    def ticks(self) -> int:
        """Ticks of the whole cycle."""
        return len(self.slots) // self.slots_per_tick

    @property
    def tick_cycles(self) -> int:
        """Length of a tick."""
        return self.slots_per_tick * self.slot_cycles

    @property
    def mean_load(self) -> Fraction:
        """Share of all cycles that the pieces take."""
        return Fraction(sum(map(self.work, range(len(self.slots)))), len(self.slots) * self.slot_cycles)


@dataclass(frozen=True, slots=True)
class Responses:
    """Bounds in cycles, each counted from the moment at which the work was due."""

    pieces: dict[str, int]  # from the beginning of its slot to its end
    slots: tuple[int, ...]  # of each slot of the whole cycle
    tick: int  # of all work of the fullest tick, as if all of it were due as the tick begins


def responses(schedule: Schedule, sources: Sequence[Source]) -> Responses | None:
    """Bounds of all pieces, slots and of the tick; None: overload, or later than the schedule holds, or the main loop
    may be busy with slots for BUSY_MOST whole cycles of the schedule.

    A slot's work waits for that of earlier slots. So each slot is taken as the one that found the processor idle, and
    its busy period is followed through the slots after it for as long as they find it busy.
    """
    if load(sources) + schedule.mean_load >= 1:
        return None
    count = len(schedule.slots)
    pieces: dict[str, int] = {}
    slots = [0] * count
    for first in range(math.lcm(count, *(source.period // schedule.slot_cycles or 1 for source in sources))):
        start = first * schedule.slot_cycles
        work, slot, due = schedule.blocking, first, 0
        while True:
            done = due
            for piece in schedule.slots[slot % count]:
                work += piece.cycles
                ended = response(work, sources, start)
                if ended is None or 0 < schedule.latest < ended - due:
                    return None
                done = max(due, ended)
                pieces[piece.name] = max(pieces.get(piece.name, 0), done - due)
            slots[slot % count] = max(slots[slot % count], done - due)
            slot, due = slot + 1, due + schedule.slot_cycles
            if slot - first > BUSY_MOST * count:
                return None
            if (
                response(work, sources, start) or 0
            ) <= due:  # idle before the next slot begins: that one is another case
                break
    ticks = [
        response(schedule.blocking + schedule.tick_work(tick), sources, tick * schedule.tick_cycles)
        for tick in range(schedule.ticks * math.lcm(schedule.ticks, 2))
    ]
    known = [tick for tick in ticks if tick is not None]
    return Responses(pieces, tuple(slots), max(known)) if len(known) == len(ticks) else None


def misses(schedule: Schedule, slots: Sequence[int]) -> list[int]:
    """Slots whose work may end only when the next tick has begun: the firmware counts that as an overrun."""
    left = [schedule.slots_per_tick - slot % schedule.slots_per_tick for slot in range(len(slots))]
    return [slot for slot, cycles in enumerate(slots) if cycles > left[slot] * schedule.slot_cycles]


def longest_gap(schedule: Schedule, sources: Sequence[Source], before: int, after: int) -> int | None:
    """The longest time for which the main loop does nothing but slots, with some cycles of other work before them,
    during which the first one begins, and after them; None: overload."""
    if load(sources) + schedule.mean_load >= 1:
        return None
    longest = 0
    for first in range(len(schedule.slots)):
        work, slot, due = before, first, 0
        while True:
            work, slot, due = work + schedule.work(slot), slot + 1, due + schedule.slot_cycles
            ended = response(work + after, sources)
            if ended is None:
                return None
            if ended <= due:
                break
        longest = max(longest, ended)
    return longest


def _least(needed: Callable[[int], int], time: int) -> int | None:
    """The least fixed point from there on; None: none within the horizon."""
    while time <= HORIZON:
        after = needed(time)
        if after == time:
            return time
        time = after
    return None
