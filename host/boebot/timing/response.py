"""How long work takes at most when interrupts come on top of it: response-time analysis.

M. Joseph, P. Pandya, "Finding response times in a real-time system", The Computer Journal 29 (1986); N. Audsley et al.,
"Applying new scheduling theory to static priority pre-emptive scheduling", Software Engineering Journal 8 (1993). Work
of C cycles that begins together with the first request of every interrupt is done after the least R with

    R = C + sum over interrupts i of ceil((R + J_i) / T_i) C_i

and at no other moment does it take longer. Where R does not exist the interrupts alone are too much: overload.

What an interrupt itself waits is in blocked.py. All times are in cycles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

HORIZON = 1 << 24  # a second of 16 MHz: what has not ended by then is overload


@dataclass(frozen=True, slots=True)
class Source:
    """What requests an interrupt, and what each time costs.

    In any window of w cycles it comes at most ceil((w + jitter) / interval) times; and for each (n, period) of `bursts`
    at most n times in each period, as the bytes of one frame a tick do.
    """

    name: str
    cycles: int
    interval: int
    jitter: int = 0
    bursts: tuple[tuple[int, int], ...] = ()

    def __post_init__(self) -> None:
        limits = (number for burst in self.bursts for number in burst)
        if self.cycles < 0 or self.interval <= 0 or self.jitter < 0 or any(number <= 0 for number in limits):
            raise ValueError(f"{self.name}: no source of interrupts: {self}")

    def requests(self, window: int) -> int:
        """The most that can come in a window of so many cycles."""
        if window <= 0:
            return 0
        limits = ((1, self.interval), *self.bursts)
        return min(most * _ceil(window + self.jitter, period) for most, period in limits)

    @property
    def load(self) -> Fraction:
        """Its share of all cycles in the long run."""
        return min(Fraction(most * self.cycles, period) for most, period in ((1, self.interval), *self.bursts))


def _ceil(a: int, b: int) -> int:
    return -(-a // b)


def load(sources: Iterable[Source]) -> Fraction:
    """Share of all cycles that interrupts take in the long run."""
    return sum((source.load for source in sources), Fraction(0))


def response(work: int, sources: Sequence[Source]) -> int | None:
    """After how many cycles such work is done at the latest; None: overload."""
    if work <= 0:
        return 0
    if load(sources) >= 1:
        return None
    return _least(lambda time: work + sum(source.cycles * source.requests(time) for source in sources), work)


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
    """Bounds of all pieces, slots and of the tick; None: overload, or later than the schedule holds.

    A slot's work waits for that of earlier slots. So each slot is taken as the one that found the processor idle, and
    its busy period is followed through the slots after it for as long as they find it busy.
    """
    if load(sources) + schedule.mean_load >= 1:
        return None
    count = len(schedule.slots)
    pieces: dict[str, int] = {}
    slots = [0] * count
    for first in range(count):
        work, slot, due = schedule.blocking, first, 0
        while True:
            done = due
            for piece in schedule.slots[slot % count]:
                work += piece.cycles
                ended = response(work, sources)
                if ended is None or 0 < schedule.latest < ended - due:
                    return None
                done = max(due, ended)
                pieces[piece.name] = max(pieces.get(piece.name, 0), done - due)
            slots[slot % count] = max(slots[slot % count], done - due)
            slot, due = slot + 1, due + schedule.slot_cycles
            if (response(work, sources) or 0) <= due:  # idle before the next slot begins: that one is another case
                break
    fullest = max(map(schedule.tick_work, range(schedule.ticks)))
    tick = response(schedule.blocking + fullest, sources)
    return None if tick is None else Responses(pieces, tuple(slots), tick)


def misses(schedule: Schedule, slots: Sequence[int]) -> list[int]:
    """Slots whose work may end only when the next tick has begun: the firmware counts that as an overrun."""
    left = [schedule.slots_per_tick - slot % schedule.slots_per_tick for slot in range(len(slots))]
    return [slot for slot, cycles in enumerate(slots) if cycles > left[slot] * schedule.slot_cycles]


def background(schedule: Schedule, sources: Sequence[Source]) -> Fraction:
    """The share of all cycles that slots and interrupts leave to other work at least, in the long run; 0: none."""
    return max(Fraction(0), 1 - load(sources) - schedule.mean_load)


def longest_gap(schedule: Schedule, sources: Sequence[Source], before: int, after: int) -> int | None:
    """The longest time for which the main loop does nothing but slots, with so many cycles of other work before them,
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
