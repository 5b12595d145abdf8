"""What the main program runs while an interrupt waits: single steps, as the interrupts of higher priority let it.

When an interrupt returns, one instruction runs before the next one is accepted (data sheet, 7.7). That is a step: an
instruction before which interrupts are on, and if it switches them off, all up to where they can come again. n returns
let n steps run, and these follow each other on some way through the program. `most(n)` is the longest time of n steps
on any such way: from any instruction, into functions and out of them to any of their callers, and from the end of an
interrupt that lets others in to anywhere.

By V(n, x) = max over steps of x to y of (cycles + V(n - 1, y)), V(0, x) = 0; and most(a + b) <= most(a) + most(b).
Where a stretch without interrupts begins in one function and ends in another, every step is taken to be the longest.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avr_timing.flow.flag import Flag
from avr_timing.interrupts.interrupts_off import Begin, Call, Flow, InterruptsOff, Node

LONGEST_INSTRUCTION = 4  # cycles: call, ret, reti
ANYWHERE = -1
KEPT = 64  # steps that are worked out exactly

_Function = tuple[int, bool]  # entry, and whether it is called with interrupts on
_Place = tuple[_Function, Node]


@dataclass(slots=True)
class _Known:
    """Functions, and where their returns lead: places behind their calls, and functions that have jumped to them."""

    flows: dict[_Function, Flow] = field(default_factory=dict)
    behind: dict[_Function, set[_Place]] = field(default_factory=dict)
    jumped: dict[_Function, set[_Function]] = field(default_factory=dict)
    interrupts: set[_Function] = field(default_factory=set)  # whose return is that of an interrupt
    is_regular: bool = True


class _Recurrence:
    """V(n, x) of all places at once, from their ways: cycles, and where each may lead."""

    def __init__(self, ways: list[list[tuple[int, tuple[int, ...]]]], longest: int) -> None:
        nowhere, anywhere = len(ways), len(ways) + 1  # two more values: 0, and that of a step to anywhere
        self._longest = longest
        self._values = np.zeros(len(ways) + 2, dtype=np.int64)
        leads: dict[tuple[int, ...], int] = {}  # each set of places once
        flat = [way for some in ways for way in some or [(0, ())]]
        self._cycles = np.array([cycles for cycles, _ in flat], dtype=np.int64)
        self._leads = np.array([leads.setdefault(to or (nowhere,), len(leads)) for _, to in flat], dtype=np.intp)
        self._begins = _begins(len(some) or 1 for some in ways)
        self._to = np.array([anywhere if at == ANYWHERE else at for to in leads for at in to], dtype=np.intp)
        self._to_begins = _begins(map(len, leads))

    def one_more(self) -> int:
        """The greatest V of the next n."""
        if not len(self._cycles):
            return 0
        self._values[-1] = self._longest + self._values[:-1].max()
        best = np.maximum.reduceat(self._values[self._to], self._to_begins)
        self._values[:-2] = np.maximum.reduceat(self._cycles + best[self._leads], self._begins)
        return int(self._values[:-2].max())


def _begins(sizes: Iterable[int]) -> NDArray[np.intp]:
    """Where each of several stretches begins that lie one behind the other."""
    ends = np.cumsum([0, *sizes])
    return ends[:-1]


class Steps:
    """Of a program with a function `main` and vectors."""

    def __init__(self, blocked: InterruptsOff) -> None:
        self.blocked = blocked
        self._known = _Known()
        self._places: dict[_Place, int] = {}
        self._ways: list[list[tuple[int, tuple[int, ...]]]] = []  # of each place: cycles, and where that may lead
        self._most = [0]
        self._by_jumps: list[list[int]] = []  # of each number of jumps the longest times of 0 to KEPT steps
        self._look()
        self._number()
        steps = [cycles for ways in self._ways for cycles, _ in ways]
        self.longest = max([LONGEST_INSTRUCTION, *self._irregular(), *steps])
        self._recurrence = _Recurrence(self._ways, self.longest)

    def most(self, steps: int, jumps: int = 0) -> int:
        """The longest time of that many steps, cycles; `jumps`: how often the way may break off and begin elsewhere."""
        if not self._known.is_regular:
            return steps * self.longest
        if steps > KEPT:
            return steps // KEPT * self.most(KEPT, jumps) + self.most(steps % KEPT, jumps)
        if jumps:
            return self._broken(steps, jumps)
        while len(self._most) <= steps:
            self._most.append(max(LONGEST_INSTRUCTION, self._most[-1], self._recurrence.one_more()))
        return self._most[steps]

    def _broken(self, steps: int, jumps: int) -> int:
        """The longest time of up to KEPT steps on a way that breaks off; more breaks than steps gain nothing."""
        rows = self._by_jumps
        if not rows:
            rows.append([self.most(n) for n in range(KEPT + 1)])
        while len(rows) <= min(jumps, KEPT):
            fewer = rows[-1]
            rows.append([max(rows[0][k] + fewer[n - k] for k in range(n + 1)) for n in range(KEPT + 1)])
        return rows[min(jumps, KEPT)][steps]

    # ---- all functions that steps can be in ----

    def _look(self) -> None:
        program, known = self.blocked.program, self._known
        work: list[_Function] = [(program.by_name["main"], True)]
        known.interrupts = {(4 * vector, False) for vector in self.blocked.vectors()}
        work += known.interrupts
        while work:
            function = work.pop()
            if function in known.flows:
                continue
            flow = known.flows[function] = self.blocked.flow(*function)
            known.is_regular = known.is_regular and all(begin.source is not None for begin in flow.begins)
            for node, calls in flow.calls.items():
                for call in calls:
                    work += self._called(function, node, call)

    def _called(self, function: _Function, node: Node, call: Call) -> list[_Function]:
        """A call: notes where it returns to; the function to look at, if steps can be in it."""
        known, on = self._known, node[2].flag is not Flag.OFF
        callee = (call.callee, on)
        effect = self.blocked.effect(*callee)
        if not on and effect.head is None and not effect.on:
            return []  # interrupts are off all the way
        if not on and (call.to is not None or function not in known.interrupts):
            known.is_regular = False
            return []
        if not on:
            known.interrupts.add(callee)
        elif effect.tail is not None:
            known.is_regular = False
        if call.to is None:
            known.jumped.setdefault(callee, set()).add(function)
        else:
            known.behind.setdefault(callee, set()).add((function, call.to))
        return [callee]

    # ---- places and ways between them ----

    def _number(self) -> None:
        for function, flow in self._known.flows.items():
            sources = (begin.source for begin in flow.begins if begin.source is not None)
            for node in dict.fromkeys((*flow.steps, *flow.calls, *flow.returns, *sources)):
                if not node[2].flag.blocks:
                    self._places[function, node] = len(self._places)
        self._ways = [[] for _ in self._places]
        for (function, node), number in self._places.items():
            flow = self._known.flows[function]
            ways = self._ways[number]
            for to, cycles in flow.steps.get(node, ()):
                ways.append((cycles, self._numbers([(function, to)])))
            for call in flow.calls.get(node, ()):
                ways.append((call.cycles, self._begun(call)))
            if node in flow.returns:
                ways.append((flow.returns[node], self._returned(function)))
        for function, flow in self._known.flows.items():
            for begin in flow.begins:
                self._stretch(function, flow, begin)

    def _stretch(self, function: _Function, flow: Flow, begin: Begin) -> None:
        if begin.source is None or (function, begin.source) not in self._places:
            return
        ways = self._ways[self._places[function, begin.source]]
        ended, returned = self.blocked.stretch(flow, begin)
        if ended is not None:
            ways += [(ended, to) for to in self._lands(function, flow, begin.node)]
        if returned is not None and function in self._known.interrupts:
            ways.append((returned, (ANYWHERE,)))

    def _lands(self, function: _Function, flow: Flow, first: Node) -> Iterable[tuple[int, ...]]:
        """Where interrupts can come again after a stretch."""
        seen, work, places = {first}, [first], list[_Place]()
        while work:
            node = work.pop()
            if node[2].flag is Flag.JUST_ON:
                places.append((function, node))
                continue
            if node[2].flag is Flag.ONE_MORE:
                for call in flow.calls.get(node, ()):
                    yield self._begun(call)
                if node in flow.returns:
                    yield self._returned(function)
            for to, _ in flow.goes.get(node, ()):
                if to not in seen:
                    seen.add(to)
                    work.append(to)
        yield self._numbers(places)

    def _begun(self, call: Call) -> tuple[int, ...]:
        return self._numbers([((call.callee, True), self.blocked.flow(call.callee, True).entry)])

    def _returned(self, function: _Function) -> tuple[int, ...]:
        """Where a return leads."""
        seen, work, places = {function}, [function], set[_Place]()
        while work:
            at = work.pop()
            if at in self._known.interrupts:
                return (ANYWHERE,)
            places |= self._known.behind.get(at, set())
            more = self._known.jumped.get(at, set()) - seen
            seen |= more
            work += more
        return self._numbers(places)

    def _numbers(self, places: Iterable[_Place]) -> tuple[int, ...]:
        return tuple(self._places[place] for place in places if place in self._places)

    def _irregular(self) -> list[int]:
        """Longest stretches, where steps do not differ."""
        if self._known.is_regular:
            return []
        main = self.blocked.of("main").cycles
        bodies = [second or 0 for _, second in map(self.blocked.interrupt, self.blocked.vectors())]
        return [main + max(bodies, default=0)]
