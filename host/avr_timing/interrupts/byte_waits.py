"""The longest time that a received byte waits in the UART, where other interrupts may take it, too
(byte_reads.py).

Bytes queue in the receiver, so they are looked at in their order (after R. Davis, A. Burns, R. Bril, J. Lukkien,
"Controller Area Network (CAN) schedulability analysis: Refuted, revisited and revised", Real-Time Systems 35 (2007)).
Byte 0 comes when none waits; from then until byte q is taken one always does. In that time there run

- the rest of what had begun: an interrupt of lower priority, or of higher; or a step of the main program;
- interrupts of higher priority, each as often as it can have been asked for; they take at most q bytes in all, and
  who takes none, or few, has a shorter run;
- for each of the q bytes that none of these took, the receive interrupt;
- after each of these a step of the main program (steps.py);
- up to the load that takes byte q: the beginning of the receive interrupt, or of one more of higher priority.

W(q) is the least fixed point of the sum of these, as in latency.py, the bytes shared among them so that it is longest.
The request of an interrupt that runs in this time came in it; only the first one's may have waited, or run, already.
The byte waits W(q) less the least time that it comes after byte 0; once byte q is taken before byte q + 1 can come,
the queue is empty and all repeats. Told is the wait up to the acceptance of the receive interrupt that would take the
byte at the same time, so that it can be compared with a latency.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

from avr_timing.interrupts.byte_reads import ByteReads
from avr_timing.interrupts.response import Source

QUEUE_MOST = 16  # bytes without a moment at which none waits: more are overload
WAIT_MOST = 1 << 12  # cycles without such a moment, likewise


@dataclass(frozen=True, slots=True)
class Other:
    """An interrupt of higher priority: what it takes, what asks for it, how long it waits itself, its longest run."""

    taken: ByteReads
    requests: Sequence[Source]
    latency: int
    span: int

    def runs(self, window: int, begun: bool = False) -> int:
        """Most runs that begin in a window of that many cycles; `begun`: behind one that has begun before it.

        The request of the first may have waited already, of the others it came within.
        """
        before = self.latency + (self.span if begun else 0)
        return min(self._requests(window + before) - begun, self._requests(window) + 1)

    def first(self, most: int) -> int | None:
        """The longest rest of a run that has begun, with at most that many bytes read: all of it, or behind a look."""
        found = [each for each in (self.taken.run(most), self.taken.rest(most)) if each is not None]
        return max(found, default=None)

    def _requests(self, window: int) -> int:
        return sum(one.requests(window + 1) for one in self.requests)


@dataclass(frozen=True, slots=True)
class Line:
    """The receive interrupt, what keeps it waiting, and the main program.

    `lower`: the longest time without interrupts of one of lower priority; `steps(n)`: the longest time of n steps.
    """

    own: ByteReads
    bytes_: Sequence[Source]
    others: Mapping[int, Other]
    lower: int
    steps: Callable[[int], int]


def longest_wait(line: Line, horizon: int) -> int:
    """Most cycles that a byte waits; `horizon`: those of higher priority can take all the time."""
    reading = line.own.until(0) or 0
    worst = 0
    for q in range(QUEUE_MOST):
        time = _time(line, q, horizon)
        if time >= min(horizon, WAIT_MOST):
            return horizon
        worst = max(worst, time - _earliest(line.bytes_, q) - reading)
        if time < _earliest(line.bytes_, q + 1):
            return worst
    return horizon


def _earliest(bytes_: Sequence[Source], q: int) -> int:
    """How long after a byte the q-th one after it comes at the soonest."""

    def come(window: int) -> int:
        return sum(one.requests(window + 1) for one in bytes_)

    high = next(1 << n for n in count() if come(1 << n) > q)
    low = 0
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if come(middle) > q else (middle + 1, high)
    return low


def _time(line: Line, q: int, horizon: int) -> int:
    """The least fixed point: from byte 0 to the load that takes byte q."""
    time, longer = -1, 0
    while longer > time:
        if longer >= min(horizon, WAIT_MOST):
            return horizon
        time, longer = longer, _meanwhile(line, q, longer)
    return time


def _meanwhile(line: Line, q: int, time: int) -> int:
    """What runs in that time at most, up to the load that takes byte q."""
    runs = {vector: other.runs(time) for vector, other in line.others.items()}
    lower = max(line.lower, line.own.rest(0) or 0)
    found = [_with(line, q, runs, [lower] * (q + 1))]
    found += [other.taken.next(q) or 0 for other in line.others.values()]  # nothing comes in between
    for vector, other in line.others.items():
        first = [other.first(n) for n in range(q + 1)]
        behind = other.runs(time, begun=True)
        if behind >= 0 and first[q] is not None:
            found.append(_with(line, q, {**runs, vector: behind}, [each or 0 for each in first]))
    return max(found)


def _with(line: Line, q: int, runs: Mapping[int, int], first: Sequence[int]) -> int:
    """The longest of all ways to share q bytes among what has begun (`first`, by bytes that it takes) and the runs, up
    to the load that takes byte q, with a step of the main program first and after each run."""
    longest = _shared(line, q, runs, first)[q] + (line.own.until(0) or 0)
    for vector, number in runs.items():
        taken = line.others[vector].taken
        if number and taken.takes:  # the last one is one of its runs
            before = _shared(line, q, {**runs, vector: number - 1}, first)
            ends = [(taken.until(q - n), before[n]) for n in range(q + 1)]
            longest = max(longest, *(each + until for until, each in ends if until is not None), 0)
    idle = sum(number for vector, number in runs.items() if line.others[vector].taken.run(0) is not None)
    return longest + line.steps(1 + idle + q)


def _shared(line: Line, q: int, runs: Mapping[int, int], first: Sequence[int]) -> list[int]:
    """By bytes taken, the longest time of what has begun, the runs, and receive interrupts."""
    times = list(first)
    for vector, number in runs.items():
        times = _after(times, line.others[vector].taken, number)
    for _ in range(q):
        times = _one_more(times, line.own.run)
    return times


def _after(times: list[int], taken: ByteReads, number: int) -> list[int]:
    """By bytes read, the longest time with more runs of one interrupt."""
    idle = taken.run(0)
    if idle is not None:  # a run that takes none costs no byte
        times = [each + number * idle for each in times]
    for _ in range(min(number, len(times)) if taken.takes else 0):
        times = _one_more(times, lambda n: _more(taken.run(n), idle or 0))
    return times


def _more(cycles: int | None, idle: int) -> int | None:
    return None if cycles is None else cycles - idle


def _one_more(times: Sequence[int], run: Callable[[int], int | None]) -> list[int]:
    """By bytes taken, the longest time with one run more that takes some, or none."""
    result = list(times)
    for n in range(len(times)):
        for of_it in range(1, n + 1):
            cycles = run(of_it)
            if cycles is not None:
                result[n] = max(result[n], times[n - of_it] + cycles)
    return result
