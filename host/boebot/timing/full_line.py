"""Whether a line full of one kind of message can be worked off, and how many bytes wait meanwhile in the receive ring.

Frames are background work: the main loop takes one in each pass in which neither a slot nor changes of the encoders are
due. While a whole frame waits, each poll of the link ends one: the delimiter before it is taken by the same poll. So n
frames are worked off after the least R with

    R = B + n (L + C) + sum over slots and interrupts that come in R of their cycles

where C is the poll's bound for that message (frames.py), L a pass of the main loop around it, and B what was under way
when all began: at a moment at which no slot, no changes and no whole frame waited. Until then the bytes of one frame
but its last may have come; from then on the line brings a byte each 320 cycles. The n-th frame leaves the ring before
its R. When no other is whole by then, the link is idle, and all begins anew.

Where the long run leaves less time than the line's frames take, R grows without end: such a line is not worked off.
What the board answers goes out through the send ring; a message waits until there is room for its answer, and so for
the line in the other direction. The interrupts that send an answer are counted with its message: in place of a full
line back there is what the board says by itself, and the answers to what comes.

Of a mix of messages, none of which costs more than r cycles for each of its bytes, S bytes are worked off after the R
with r (S + the longest frame) in place of n (L + C): the last frame of these may have begun behind the S-th byte.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil
from typing import Any

from boebot.timing.costs import Costs
from boebot.timing.frames import FrameCost
from boebot.timing.loads import RECEIVE, SEND, Load
from boebot.timing.program import InterruptRow, Program
from boebot.timing.response import HORIZON, Schedule, Source, background

SINGLE = 1  # of a source whose cycles do not count


@dataclass(frozen=True, slots=True)
class FullLine:
    """A line full of one message. `cycles` of each at most, with a pass of the main loop and the sending of its answer.

    Frames in a tick, in the long run: so many the line carries, so many are worked off at least, so many can be
    answered by a line that carries what the board says by itself, too (None: it answers nothing).
    """

    cost: FrameCost
    cycles: int
    carried: float
    worked_off: float
    answered: float | None
    ring: int | None  # bytes that wait at most; None: no bound

    @property
    def least(self) -> float:
        """Frames in a tick that are worked off and answered at least."""
        return self.worked_off if self.answered is None else min(self.worked_off, self.answered)

    @property
    def margin(self) -> float:
        """What is worked off and answered, more than comes, as a share of that; negative: less."""
        return self.least / self.carried - 1

    def is_proven(self, ring_holds: int | None) -> bool:
        """Of such a line nothing is lost."""
        return self.ring is not None and ring_holds is not None and self.ring <= ring_holds

    def as_dict(self) -> dict[str, Any]:
        """For programs; units in the keys."""
        return {
            "message": self.cost.name,
            "id": self.cost.id,
            "frame_bytes": self.cost.bytes,
            "frame_bound_cycles": self.cycles,
            "poll_bound_cycles": self.cost.poll,
            "answer_bytes": self.cost.answer,
            "carried_per_tick": round(self.carried, 2),
            "worked_off_per_tick": round(self.worked_off, 2),
            "answered_per_tick": None if self.answered is None else round(self.answered, 2),
            "margin_percent": round(100 * self.margin, 1),
            "receive_ring_needed_bytes": self.ring,
        }


@dataclass(frozen=True, slots=True)
class FullLines:
    """A line full of each message; none: the load's line is not full, or the image does not say enough.

    `mixed`: those of which a line can be full in any mix, and with what in the receive ring at most.
    """

    lines: tuple[FullLine, ...] = ()
    mixed: tuple[str, ...] = ()
    ring: int | None = None

    def is_proven(self, ring_holds: int | None) -> bool:
        """Of a line full of any mix of these nothing is lost."""
        return self.ring is not None and ring_holds is not None and self.ring <= ring_holds

    def says(self, ring_holds: int | None) -> str:
        """In a sentence what is proven of which messages."""
        good = [line for line in self.lines if line.cost.name in self.mixed and self.is_proven(ring_holds)]
        others = ", ".join(
            f"{line.cost.name} {line.least:.1f} of {line.carried:.1f}" for line in self.lines if line not in good
        )
        rest = f"of a line full of others so many are worked off per tick: {others}" if others else ""
        if not good:
            return rest
        worst = min(good, key=lambda line: line.margin)
        return (
            f"a line full of any mix of {', '.join(line.cost.name for line in good)} is proven to lose nothing: "
            f"{self.ring} of {ring_holds} bytes wait in the receive ring, and {worst.least:.1f} {worst.cost.name} are "
            f"worked off per tick, where {worst.carried:.1f} come" + (f"; {rest}" if rest else "")
        )

    def as_dict(self, ring_holds: int | None) -> dict[str, Any]:
        """For programs; units in the keys."""
        return {
            "messages": [line.as_dict() for line in self.lines],
            "any_mix_of": list(self.mixed),
            "any_mix_receive_ring_needed_bytes": self.ring,
            "any_mix_is_proven": self.is_proven(ring_holds),
        }


def _bytes(row: InterruptRow, load: Load) -> list[Source]:
    return load.sources(row, SINGLE)


def _come(row: InterruptRow, load: Load) -> Callable[[int], int]:
    bytes_ = _bytes(row, load)
    return lambda window: sum(one.requests(window + 1) for one in bytes_)


def begun(found: Costs) -> int:
    """What the main loop may be at when it has neither a slot nor a whole frame to do: it takes some bytes, and has
    left changes that were not due; or it works off those that were."""
    changes = (found.changes_due - 1) * found.change + found.other + found.storm
    return max(found.idle, found.loop + found.partial + changes)


@dataclass(frozen=True, slots=True)
class Waiting:
    """How many bytes wait in the receive ring where frames come without end.

    `sources`: interrupts, and what they leave to the main loop; `begun`: cycles of what is under way when the first
    byte comes; `come`: bytes that can come in a window of so many cycles.
    """

    schedule: Schedule
    sources: Sequence[Source]
    begun: int
    come: Callable[[int], int]

    def most(self, cycles: int, size: int) -> int | None:
        """Of frames of that size, each of which takes so long; None: they are never all worked off, or not within a
        second."""
        return self._most(self.begun, cycles, size, size - 1)

    def most_of_mix(self, frames: Sequence[tuple[int, int]]) -> int | None:
        """The same of frames in any order, each of one of these cycles and sizes."""
        each = max(Fraction(cycles, size) for cycles, size in frames)
        least, longest = (bound(size for _, size in frames) for bound in (min, max))
        return self._most(self.begun + ceil(each * longest), ceil(each * least), least, longest - 1)

    def _most(self, begun: int, each: int, size: int, left: int) -> int | None:
        """With `left` bytes that had come before. Each slot is taken to be the first."""
        most = 0
        for first in range(len(self.schedule.slots)):
            frames, until = 0, 0
            while True:
                frames += 1
                ended = self._ended(first, begun + frames * each, until)
                if ended is None:
                    return None
                until = ended
                here = left + self.come(until)
                most = max(most, here - (frames - 1) * size)
                if here < (frames + 1) * size:
                    break
        return most

    def _slots(self, first: int, count: int) -> int:
        """Cycles of so many slots one after another."""
        works = [self.schedule.work(first + number) for number in range(len(self.schedule.slots))]
        cycles, rest = divmod(count, len(works))
        return cycles * sum(works) + sum(works[:rest])

    def _ended(self, first: int, work: int, time: int) -> int | None:
        """When such work is done at the latest that begins together with that slot, and is not done at that time; None:
        not within the horizon."""
        while time <= HORIZON:
            coming = sum(one.cycles * one.requests(time + 1) for one in self.sources)
            after = work + self._slots(first, time // self.schedule.slot_cycles + 1) + coming
            if after <= time:
                return time
            time = after
        return None


def full_lines(
    program: Program, found: Costs, schedule: Schedule, asked: Load, kinds: Sequence[FrameCost]
) -> FullLines:
    """Of each kind, under a load whose line is full.

    Args:
        program: the image's.
        found: its costs under that load.
        schedule: its slots.
        asked: the load.
        kinds: what each message costs.
    """
    rows = {row.vector: row for row in program.table.interrupts}
    if not asked.is_full or not kinds or RECEIVE not in rows or SEND not in rows:
        return FullLines()
    alone = asked.without_answers()
    sources = (*found.sources(program, alone), *found.between(program, alone))
    left = background(schedule, sources)
    free = 1 - sum(float(one.load) for one in _bytes(rows[SEND], alone)) * asked.byte_interval
    waiting = Waiting(schedule, sources, begun(found), _come(rows[RECEIVE], asked))
    lines = []
    for kind in kinds:
        cycles = found.loop + kind.poll + kind.answer * found.charged[rows[SEND].name]
        carried = schedule.tick_cycles / asked.byte_interval
        line = FullLine(
            cost=kind,
            cycles=cycles,
            carried=carried / kind.bytes,
            worked_off=float(left * schedule.tick_cycles / cycles),
            answered=free * carried / kind.answer if kind.answer else None,
            ring=None,
        )
        lines.append(replace(line, ring=waiting.most(cycles, kind.bytes)) if line.margin >= 0 else line)
    good = [line for line in lines if line.ring is not None]
    ring = waiting.most_of_mix([(line.cycles, line.cost.bytes) for line in good]) if good else None
    return FullLines(tuple(lines), tuple(line.cost.name for line in good), ring)
