"""Loads at the pins of a bench: what drives its lines: encoder wheels, echoes, contacts.

A source queues its edges some time ahead, at exact cycles; periods share no factor with the control tick, so that
phases are swept. Bytes are in line.py.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim_bridge.bench.bench import Bench
from sim_bridge.boards.board import Level

CYCLES_PER_US = 16
TICK_CYCLES = 160_000
ECHO_DELAY_CYCLES = 750 * CYCLES_PER_US  # from the trigger's end to the echo (Parallax #28015, hold-off)
ECHO_SHORTEST, ECHO_LONGEST = 2_000, 290_000  # cycles: 0.125 to 18.1 ms (ibid.: 0.115 to 18.5 ms)


NOISE_PERIOD = 159  # cycles from edge to edge: 100,000 a second, in step with nothing


class PulseTrain:
    """A pin, high until then, that changes its level every `period` cycles from `first` on."""

    def __init__(self, pin: int, period: int, first: int) -> None:
        self.pin, self.period, self.first = pin, period, first
        self.edges = range(first, first, period)
        """cycles at which it changed, queued ones included"""

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        due = range(self.edges.stop, until, self.period)
        if due:
            level = Level.HIGH if len(self.edges) % 2 else Level.LOW
            bench.wave(self.pin, due, level)
            self.edges = range(self.first, due[-1] + self.period, self.period)


def coprime_periods(edges_per_s: int, count: int) -> list[int]:
    """That many periods in cycles, none longer than asked for, without a common factor with the tick or each other."""
    found: list[int] = []
    period = 16_000_000 // edges_per_s
    while len(found) < count:
        if all(np.gcd(period, other) == 1 for other in (TICK_CYCLES, *found)):
            found.append(period)
        period -= 1
    return found


def wheels(pins: Sequence[tuple[int, ...]], edges_per_s: int, first: int) -> list[list[PulseTrain]]:
    """The encoder lines of each wheel, one or two a wheel, at `edges_per_s` a line; with two, A leads B by a quarter
    turn of the pattern: forward."""
    periods = coprime_periods(edges_per_s, len(pins))
    return [
        [PulseTrain(pin, period, first + line * (period // 2)) for line, pin in enumerate(lines)]
        for lines, period in zip(pins, periods, strict=True)
    ]


def with_noise(turning: Sequence[Sequence[PulseTrain]], first: int) -> list[PulseTrain]:
    """The lines of wheels, of which the first one's first line is not theirs but noise."""
    (pin, *rest), *others = ([train.pin for train in wheel] for wheel in turning)
    by_pin = {train.pin: train for wheel in turning for train in wheel}
    return [PulseTrain(pin, NOISE_PERIOD, first), *(by_pin[each] for each in (*rest, *(p for o in others for p in o)))]


class Contact:
    """A switch to ground: closed for `closed` cycles every `period`, open between; a pull-up makes it high."""

    def __init__(self, pin: int, period: int, closed: int, first: int) -> None:
        self.pin, self.period, self.closed = pin, period, closed
        self.closings: list[int] = []
        self._next = first

    def queue(self, bench: Bench, until: int) -> None:
        """See Source. Both ends of a closing are queued at once: the later one replaces nothing earlier."""
        while self._next < until:
            bench.drive(self.pin, Level.LOW, at=self._next)
            bench.drive(self.pin, Level.HIGH, at=self._next + self.closed)
            self.closings.append(self._next)
            self._next += self.period


class Bursts:
    """Noise: a pin that every `period` cycles changes its level `count` times, `half` cycles apart."""

    def __init__(self, pin: int, count: int, half: int, period: int, first: int) -> None:
        self.pin, self.count, self.half, self.period = pin, count, half, period
        self._next, self._begun = first, 0

    def queue(self, bench: Bench, until: int) -> None:
        """See Source. A burst is queued at once."""
        while self._next < until:
            level = Level.LOW if self._begun * self.count % 2 else Level.HIGH
            bench.wave(self.pin, range(self._next, self._next + self.count * self.half, self.half), level)
            self._begun += 1
            self._next += self.period


class Ping:
    """A range finder that answers each trigger with an echo; their lengths sweep the sensor's range."""

    def __init__(self, pin: int, step: int = 23_459) -> None:
        """`step`: by which each echo is longer than the one before, in cycles; a prime."""
        self.pin, self.step = pin, step
        self.echoes: list[tuple[int, int]] = []
        """cycles of rise and fall of each"""
        self._seen: int | None = None

    def queue(self, bench: Bench, until: int) -> None:
        """See Source. Triggers from before the first call get no answer."""
        del until
        log = bench.edges[self.pin]
        for i in range(self._seen if self._seen is not None else len(log), len(log)):
            if log[i].level == Level.LOW and i > 0 and log[i - 1].level == Level.HIGH:
                self._answer(bench, log[i].cycle)
        self._seen = len(log)

    def _answer(self, bench: Bench, triggered: int) -> None:
        if self.echoes and triggered < self.echoes[-1][1]:
            return  # the level that the board's pin had before it let go of it
        length = ECHO_SHORTEST + len(self.echoes) * self.step % (ECHO_LONGEST - ECHO_SHORTEST)
        rise = triggered + ECHO_DELAY_CYCLES + len(self.echoes) * 7 % 61
        bench.drive(self.pin, Level.HIGH, at=rise)
        bench.drive(self.pin, Level.LOW, at=rise + length)
        self.echoes.append((rise, rise + length))
