"""One pin of a bench, for tests: driven, looked at and waited for, in seconds of the board's time unless it says so.

What is looked at is the level that a logic analyser shows: what the firmware does, and where that has let go of the
pin, what the outside does. Every answer follows from the log of edges and from the bench's `mark`, the last event that
was waited for or that the test made itself; how far the board has run since does not matter. Keep one Pin per pin: it
sorts out the log as it grows.
"""

from __future__ import annotations

import math
import random
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from heapq import merge
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from boebot.arguments import number, shown, whole
from boebot.devices.device import pin_name, pin_number
from boebot.errors import CallError
from boebot.record.record import net_level
from sim_bridge.bench.bench import Bench
from sim_bridge.bench.waiting import LONGEST_S, Cannot, WaitError
from sim_bridge.boards.board import CLOCK_HZ, PINS, Level
from sim_bridge.pins import RXEN0, TXEN0

NET = np.dtype([("cycle", "<u8"), ("level", "u1")])  # RELEASED: it hangs in the air
LEVELS = (Level.LOW, Level.HIGH, Level.RELEASED)
WITHIN_S = 1.0  # that a wait takes at most, unless it says otherwise
EDGES_MAXIMUM = 10_000_000  # of a wave
LINE_PINS = {0: RXEN0, 1: TXEN0}
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Pulse:
    """A stretch of one level, from the edge that began it to the one that ended it."""

    start: int
    """cycle"""
    cycles: int
    level: int

    @property
    def us(self) -> float:
        """How long it is."""
        return self.cycles * 1e6 / CLOCK_HZ


class Square:
    """A square wave without end, as a source: edge k comes k half periods after the first one, to the nearest cycle."""

    def __init__(self, pin: int, half: float, first: int, level: int) -> None:
        self.pin, self._half, self._first, self._level, self._count = pin, half, first, level, 0

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        if (end := max(self._count, math.ceil((until - self._first) / self._half))) > self._count:
            cycles = self._first + np.round(np.arange(self._count, end) * self._half)
            bench.wave(self.pin, cycles, (self._level + self._count) % 2)
            self._count = end


class Pin:
    """A pin by its number, 0..13 or "A0".."A5". Pins 0 and 1 are the serial line's while the program uses that."""

    __slots__ = ("_cycles", "_does", "_fight", "_held", "_is_native", "_levels", "_seen", "bench", "number")

    def __init__(self, bench: Bench, name: int | str) -> None:
        """Raises CallError where there is no such pin."""
        try:
            self.number = name if isinstance(name, int) and 14 <= name < PINS else pin_number(name)
        except ValueError as refused:
            raise CallError(str(refused)) from None
        self.bench = bench
        self._is_native = bench.board.extension("outside log", "board_outside_log") is None
        self._cycles, self._levels = [0], [int(Level.RELEASED)]  # of its changes
        self._does = [int(Level.RELEASED), int(Level.RELEASED)]  # the firmware, the outside
        self._seen = [0, 0]
        self._held, self._fight = math.inf, ""  # from which cycle on the test drives it; against the program: in words

    def __str__(self) -> str:
        return f"pin {pin_name(self.number)}"

    # ---- driven: all of them raise CallError where the program drives it ---------------------------------------------

    def drive(self, level: int, after: float = 0.0) -> None:
        """Drives it to 0 or 1 from `after` seconds from now on, until `release`; no part drives it any more."""
        level = whole(f"{self}: the level", level, CallError, least=0, most=1)
        self._drive(np.array([self._cycle(after)]), np.array([level]))

    def release(self) -> None:
        """Gives it back to the part that drives it; lets go of it where none does."""
        self._begin()
        self.take()
        self.bench.pins.release(self.number)
        self._held = math.inf

    def square(self, hz: float, count: int | None = None, after: float = 0.0) -> None:
        """Drives a square wave: `count` whole periods that begin high, and then low; without end where it is None."""
        hz = number(f"{self}: the frequency", hz, CallError, least=1e-3, most=CLOCK_HZ / 2)
        first, half = self._cycle(after), CLOCK_HZ / hz / 2
        if count is None:
            self._begin(first)
            self.bench.sources.append(Square(self.number, half, first, Level.HIGH))
            return
        count = whole(f"{self}: the count", count, CallError, least=1, most=EDGES_MAXIMUM // 2)
        edges = np.arange(2 * count)
        self._drive(first + np.round(edges * half), (edges + 1) % 2)

    def bounce(self, level: int, count: int = 5, over: float = 2e-3, seed: int = 1, after: float = 0.0) -> None:
        """Drives it to `level` as a contact does: it flicks back `count` times, at random within `over` seconds."""
        level = whole(f"{self}: the level", level, CallError, least=0, most=1)
        cycles = round(number(f"{self}: the bouncing time", over, CallError, least=1e-6, most=10.0) * CLOCK_HZ)
        count = whole(f"{self}: the count", count, CallError, least=0, most=min(EDGES_MAXIMUM, cycles // 4))
        flicks = sorted(random.Random(seed).sample(range(1, cycles + 1), 2 * count))
        edges = np.array([0, *flicks])
        self._drive(self._cycle(after) + edges, (level + np.arange(len(edges))) % 2)

    def wave(self, rows: NDArray[Any] | str | Path, after: float = 0.0, signal: str | None = None) -> None:
        """Drives it as the rows say, shape (n, 2): time (s, counted from `after` seconds from now on, never less than
        before) and level (0, 1, or 2 for let go of); or as a signal of a value change dump (.vcd) does."""
        if isinstance(rows, str | Path):
            from sim_bridge.bench.waves import read_wave

            rows = read_wave(Path(rows), signal)
        try:
            times, levels = np.asarray(rows, float).reshape(-1, 2).T
        except (TypeError, ValueError):
            raise CallError(f"{self}: the wave is {shown(rows)}; expected rows of a time and a level") from None
        in_order = np.all(np.isfinite(times)) and np.all(np.diff(times, prepend=0.0) >= 0)
        if not in_order or not np.all(np.isin(levels, LEVELS)) or not 0 < len(times) <= EDGES_MAXIMUM:
            raise CallError(
                f"{self}: the wave has a time that is less than one before, a level that is not 0, 1 or 2, or no row"
            )
        number(f"{self}: the wave's last time", float(times[-1]), CallError, most=LONGEST_S)
        self._drive(self._cycle(after) + np.round(times * CLOCK_HZ), levels)

    def _cycle(self, after: float) -> int:
        after = number(f"{self}: after", after, CallError, least=0.0, most=LONGEST_S)
        return self.bench.now + round(after * CLOCK_HZ)

    def _drive(self, cycles: NDArray[Any], levels: NDArray[Any]) -> None:
        self._begin(cycles[0])
        self.bench.pins.drive_edges(self.number, cycles.astype(np.uint64), levels.astype(np.uint8))

    def _begin(self, first: float = math.inf) -> None:
        """The test does something to the pin, drives it from that cycle on: a wave ends."""
        self._expect_no_line()
        bench, program = self.bench, self.bench.pins.output(self.number)
        if program <= Level.HIGH and first <= bench.now and bench.board.reacts_at is None:
            raise CallError(f"{self}: the program drives it, to {program}; expected a pin that it reads")
        self._held = min(self._held, first)
        bench.acted()
        bench.sources[:] = [one for one in bench.sources if not (isinstance(one, Square) and one.pin == self.number)]

    # ---- looked at ---------------------------------------------------------------------------------------------------

    @property
    def level(self) -> Level:
        """As it is now: LOW, HIGH, or RELEASED where it hangs in the air."""
        self._look()
        return Level(self._levels[-1])

    def edges(self, since: float = 0.0) -> NDArray[Any]:
        """Its changes (dtype NET: cycle and level from then on) since power-on, or since then (s)."""
        return self._changes(round(number(f"{self}: since", since, CallError) * CLOCK_HZ))

    def _changes(self, since: int) -> NDArray[Any]:
        """Those from a cycle on."""
        self._look()
        first = max(1, bisect_left(self._cycles, since))
        return np.array(list(zip(self._cycles[first:], self._levels[first:], strict=True)), NET)

    def _look(self) -> None:
        """Takes the edges that are new. Raises CallError where the program drives the pin, and the test does."""
        self._expect_no_line()
        if self._is_native and self._held < math.inf:
            raise Cannot(f"what a test does to {self} cannot be looked at{NATIVE}")
        if fight := self.take():
            raise CallError(fight)

    def take(self) -> str:
        """Takes the edges that are new. What comes and goes within one cycle is no change. Returns, in a sentence, that
        program and test have driven it against each other; or ""."""
        logs = [self.bench.edges[self.number], self.bench.driven[self.number]]
        found = merge(*([(e.cycle, who, e.level) for e in logs[who][self._seen[who] :]] for who in (0, 1)))
        self._seen = [len(log) for log in logs]
        for cycle, who, level in found:
            self._does[who] = level
            if not self._fight and cycle >= self._held and {*self._does} == {Level.LOW, Level.HIGH}:
                what = "the program drives it, to {}, and the test to {}".format(*self._does)
                self._fight = f"{self}: {what}, at {cycle / CLOCK_HZ:.6f} s; expected a pin that the program reads"
            if (net := net_level(*self._does)) == self._levels[-1]:
                continue
            if cycle > self._cycles[-1] or len(self._cycles) == 1:
                self._cycles.append(cycle)
                self._levels.append(net)
            else:
                self._levels[-1] = net
                if net == self._levels[-2]:
                    del self._cycles[-1], self._levels[-1]
        return self._fight

    def _expect_no_line(self) -> None:
        if self.number in LINE_PINS and self.bench.pins.uses_line(LINE_PINS[self.number]):
            kind = Cannot if self._is_native else CallError  # which no program there can leave
            raise kind(f"{self} is the serial line's while the program uses that; expected uno.serial, or another pin")

    # ---- waited for --------------------------------------------------------------------------------------------------

    def wait(self, level: int, within: float = WITHIN_S) -> float:
        """Waits until it is at that level, 0 or 1, at the mark or later. That instant is the mark then, and returned: s
        since power-on, exact to the cycle.

        Raises:
            WaitError: it did not come to that, for `within` seconds from now.
        """
        level = whole(f"{self}: the level", level, CallError, least=0, most=1)

        def found(mark: int) -> int | None:
            at = max(0, bisect_right(self._cycles, mark) - 1)
            levels = self._levels[at:]
            return max(mark, self._cycles[at + levels.index(level)]) if level in levels else None

        cycle = self._wait(found, lambda cycle: cycle, within, f"to be {level}", Level.RELEASED)
        return cycle / CLOCK_HZ

    def pulse(self, within: float = WITHIN_S, level: int = 1) -> Pulse:
        """Waits for the first pulse of that level that begins at the mark or later, and for its end, the mark then.

        Raises:
            WaitError: none has come and gone `within` seconds from now.
        """
        return self.pulses(1, within, level)[0]

    def pulses(self, count: int, within: float = WITHIN_S, level: int = 1) -> list[Pulse]:
        """Waits for that many of them, one after another. Raises as `pulse`."""
        count = whole(f"{self}: the count", count, CallError, least=1, most=EDGES_MAXIMUM)
        level = whole(f"{self}: the level", level, CallError, least=0, most=1)

        def found(mark: int) -> list[Pulse] | None:
            some = self.all_pulses(mark, level) if self._has(2 * count, mark) else ()
            return [Pulse(int(at), int(cycles), level) for at, cycles in some[:count]] if len(some) >= count else None

        return self._wait(found, lambda some: some[-1].start + some[-1].cycles, within, _many(count, level), level)

    def all_pulses(self, since: int = 0, level: int = 1) -> NDArray[np.int64]:
        """Start and length, in cycles, of each pulse that has ended and began at `since` or later: shape (n, 2)."""
        return pulses_of(self._changes(since), level)

    def frequency(self, periods: int = 8, within: float = WITHIN_S) -> float:
        """Hz, over that many whole periods, from rise to rise, from the mark on. Raises as `pulse`."""
        return self._over(periods, within)[0]

    def duty(self, periods: int = 8, within: float = WITHIN_S) -> float:
        """Share of the time, 0 to 1, for which it is high, over that many whole periods. Raises as `pulse`."""
        return self._over(periods, within)[1]

    def _over(self, periods: int, within: float) -> tuple[float, float]:
        """Frequency (Hz) and duty."""
        periods = whole(f"{self}: the periods", periods, CallError, least=1, most=EDGES_MAXIMUM)

        def found(mark: int) -> tuple[int, int, int] | None:
            changes = self._changes(mark if self._has(2 * periods + 1, mark) else self.bench.now)
            rises = np.flatnonzero(changes["level"] == Level.HIGH)[: periods + 1]
            if len(rises) <= periods:
                return None
            inside = changes[rises[0] : rises[-1] + 1]
            lengths = np.diff(inside["cycle"].astype(np.int64))
            high = int(lengths[inside["level"][:-1] == Level.HIGH].sum())
            return high, int(lengths.sum()), int(inside["cycle"][-1])

        what = f"for {periods} periods"
        high, in_all, _ = self._wait(found, lambda some: some[2], within, what, Level.HIGH)
        return periods * CLOCK_HZ / in_all, high / in_all

    def _has(self, changes: int, since: int) -> bool:
        """It has had that many changes from that cycle on."""
        return len(self._cycles) - bisect_left(self._cycles, since) >= changes

    def _wait(
        self, found: Callable[[int], T | None], event: Callable[[T], int], within: float, what: str, of: int
    ) -> T:
        """What is found at last; its event's cycle is then the mark. `of`: the level of the pulses that are meant."""
        within = number(f"{self}: within", within, CallError, least=0.0, most=LONGEST_S)
        bench = self.bench
        mark, begin, end = bench.mark, bench.now, bench.now + round(within * CLOCK_HZ)
        self._look()
        while (some := found(mark)) is None or event(some) > end:
            if bench.now >= end:
                raise WaitError(f"{self}: waited {within:g} s {what}; {self._seen_since(begin, of)}")
            bench.run_until(end, edge_of=(self.number,))
            self._look()
        bench.mark = event(some)
        return some

    def _seen_since(self, begin: int, level: int) -> str:
        """In words: what it did since a cycle, and the last pulse of that level that began before the mark."""
        names = {Level.LOW: "0", Level.HIGH: "1", Level.RELEASED: "in the air"}
        count = len(self._cycles) - bisect_right(self._cycles, begin)
        text = f"it had {count} edges meanwhile, and has been {names[Level(self._levels[-1])]} since "
        text += f"{self._cycles[-1] / CLOCK_HZ:.6f} s; now it is {self.bench.now / CLOCK_HZ:.6f} s"
        for at, _ in [row for row in self.all_pulses(0, level).tolist() if row[0] < self.bench.mark][-1:]:
            text += f"; the last one began at {at / CLOCK_HZ:.6f} s, before what was last waited for or done"
        return text + (NATIVE if self._is_native else "")


def pulses_of(changes: NDArray[Any], level: int = 1) -> NDArray[np.int64]:
    """Start and length, in cycles, of the pulses among a pin's changes of level (dtype EDGE): shape (n, 2)."""
    cycles, begins = changes["cycle"].astype(np.int64), np.flatnonzero(changes["level"][:-1] == level)
    return np.column_stack((cycles[begins], cycles[begins + 1] - cycles[begins]))


NATIVE = " (of the native board only what the firmware drives is seen)"


def _many(count: int, level: int) -> str:
    """Pulses, in words."""
    kind = "high" if level else "low"
    return f"for a {kind} pulse" if count == 1 else f"for {count} {kind} pulses"
