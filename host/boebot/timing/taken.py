"""Where an interrupt takes received bytes, and how long it may run until it has taken so many.

A byte that waits is taken by whoever reads the UART's data register: the receive interrupt, or one that keeps it
waiting and looks after the line meanwhile. Where it does shows in its machine code: a load of UDR0. While a byte waits,
a test of RXC (a skip on bit 7 of a register just loaded from UCSR0A) goes one way only, so the other one is left out:
the bit is set when unread data exist in the receive buffer (data sheet, 20.11).

Of an interrupt's run, from its acceptance (entry: 4 cycles) to the end of its RETI, these times are told, in cycles,
for bytes that wait all the time: with at most n bytes taken the longest whole run (`run`); from acceptance to the end
of the load that takes byte n + 1 (`until`); and of a run that has just found none, or taken the last, likewise the
longest rest (`rest`, `next`). None: there is no such run. `charged` is for sums over many runs.
"""

from __future__ import annotations

from dataclasses import dataclass

from boebot.timing.blocked import ENTRY
from boebot.timing.paths import Graph, Mark, Way, longest
from boebot.timing.program import Block, Instruction
from boebot.timing.registers import written
from boebot.timing.wcet import WorstCase

LOAD = 2  # cycles of such a load, within which it sees the byte or not
STATUS, COMPLETE, DATA = 0xC0, 7, 0xC6  # UCSR0A, RXC0 in it, UDR0: addresses in data space

# A function, the calls that led there (each by its caller and the block behind it; None: a tail call), a block, and how
# many loads of the data register in it have been passed.
_Calls = tuple[tuple[int, int | None], ...]
_Place = tuple[int, _Calls, int, int]
_Node = tuple[int, _Place]  # bytes taken, place
MANY = 8  # bytes in one run: it takes them in a loop


@dataclass(frozen=True, slots=True)
class _Step:
    """From a place to the next one (None: the end), whether a byte is taken, and whether one can wait then."""

    to: _Place | None
    cycles: int
    takes: bool
    waits: bool = True


class Taken:
    """Of an interrupt, by the entry of its vector."""

    def __init__(self, worst_case: WorstCase, entry: int) -> None:
        self.worst_case = worst_case
        self.program = worst_case.program
        self.start: _Place = (entry, (), entry, 0)
        self._reads: dict[int, bool] = {}
        self._ways: dict[_Place, list[_Step]] = {}
        self._idle: list[tuple[_Place | None, int]] = []  # where runs go on that have just found none, or taken one
        self._known: dict[tuple[str, int], int | None] = {}
        self._look()

    @property
    def takes(self) -> bool:
        """Whether it takes bytes at all."""
        return self._contains(self.start[0])

    def run(self, most: int) -> int | None:
        """The longest whole run in which at most so many bytes are taken."""
        return self._once("run", most)

    def until(self, taken: int) -> int | None:
        """The longest time from acceptance until one byte more than so many is taken."""
        return self._once("until", taken)

    def rest(self, most: int) -> int | None:
        """The longest rest of a run behind a look that found none, with at most so many taken in it."""
        return self._once("rest", most)

    def next(self, taken: int) -> int | None:
        """The longest time from a look that found none until one byte more than so many is taken, in the same run."""
        return self._once("next", taken)

    def charged(self, each: int) -> int:
        """The longest run less so many cycles for each byte that it takes: what it costs where bytes are charged apart.

        All of it, where it takes bytes in a loop.
        """
        longest = [self._longest(self.start, ENTRY, n, exits=frozenset((n,))) for n in range(MANY + 1)]
        if longest[MANY] is not None:
            return ENTRY + self.worst_case.bound(self.start[0]).cycles
        return max(cycles - n * each for n, cycles in enumerate(longest) if cycles is not None)

    def _once(self, what: str, count: int) -> int | None:
        if not self.takes:
            count = 0
        if (what, count) not in self._known:
            starts = [(self.start, ENTRY)] if what in ("run", "until") else self._idle
            found = [self._waiting(to, cycles, count, until=what in ("until", "next")) for to, cycles in starts]
            self._known[what, count] = max((each for each in found if each is not None), default=None)
        return self._known[what, count]

    def _waiting(self, start: _Place | None, before: int, count: int, until: bool) -> int | None:
        """While bytes wait: to the end of the run, or to the load that takes one more."""
        if start is None:
            return None if until else before
        exits = frozenset[int]() if until else frozenset(range(count + 1))
        return self._longest(start, before, count, exits, until, waiting=True)

    def _longest(
        self,
        start: _Place,
        before: int,
        most: int,
        exits: frozenset[int],
        until: bool = False,
        waiting: bool = False,
    ) -> int | None:
        """The longest way on which at most so many bytes are taken, ended with a number in `exits`, or (`until`) by the
        load of one more; `waiting`: bytes wait all the time."""
        ways: dict[_Node, list[Way[_Node]]] = {}
        work: list[_Node] = [(0, start)]
        while work:
            node = work.pop()
            if node in ways:
                continue
            ways[node] = []
            count, place = node
            for step in self._ways[place]:
                if waiting and not step.waits:
                    continue
                if step.takes and count == most:
                    if until:
                        ways[node].append(Way(node, None, step.cycles))
                    continue
                after = count + step.takes
                if step.to is not None:
                    ways[node].append(Way(node, (after, step.to), step.cycles))
                    work.append((after, step.to))
                elif after in exits:
                    ways[node].append(Way(node, None, step.cycles))
        walk = longest(Graph((0, start), ways, lambda node: self.program.where(node[1][2]), self._marks(ways)))
        return None if walk is None else before + walk.cycles

    def _marks(self, ways: dict[_Node, list[Way[_Node]]]) -> dict[_Node, list[Mark]]:
        """Bounds of loops, by the nodes in front of any load of their blocks."""
        found: dict[_Node, list[Mark]] = {}
        for node in ways:
            _, (function, _, block, part) = node
            marks = self.worst_case.marks(function).get(block) if part == 0 else None
            if marks:
                found[node] = marks
        return found

    # ---- all ways ----

    def _look(self) -> None:
        work = [self.start]
        while work:
            place = work.pop()
            if place not in self._ways:
                self._ways[place] = self._leaving(place)
                work += [step.to for step in self._ways[place] if step.to is not None]

    def _leaving(self, place: _Place) -> list[_Step]:
        function, calls, start, part = place
        block = self.worst_case.inside(function).function.blocks[start]
        loads = [i for i, instruction in enumerate(block.instructions) if _takes(instruction)]
        first = loads[part - 1] + 1 if part else 0
        last = len(block.instructions) - 1
        takes = part < len(loads)
        if takes and loads[part] < last:
            to: _Place | None = (function, calls, start, part + 1)
            cycles = sum(each.cycles for each in block.instructions[first : loads[part] + 1])
            self._idle.append((to, LOAD))
            return [_Step(to, cycles, True)]
        before = sum(each.cycles for each in block.instructions[first:last])
        kept = _while_one_waits(block)
        found = []
        for to, cycles, edge in self._behind(place, block):
            waits = edge is None or edge in kept
            found.append(_Step(to, before + cycles, takes, waits))
            if not waits:
                self._idle.append((to, LOAD + cycles))
            if takes:
                self._idle.append((to, LOAD))
        return found

    def _behind(self, place: _Place, block: Block) -> list[tuple[_Place | None, int, int | None]]:
        """Behind a block's last instruction: the place, cycles with what is called, and the block of the edge."""
        function, calls, _, _ = place
        found: list[tuple[_Place | None, int, int | None]] = []
        edges: list[tuple[int | None, int]] = [(edge.to, edge.cycles) for edge in block.edges]
        edges = edges or [(None, block.last_cycles)]
        for to, cycles in edges:
            if not block.calls:
                found.append((self._returned(calls) if to is None else (function, calls, to, 0), cycles, to))
            for callee in block.calls:
                if self._contains(callee):
                    found.append(((callee, (*calls, (function, to)), callee, 0), cycles, None))
                    continue
                own = cycles + self.worst_case.callee(callee, block, self.worst_case.inside(function)).cycles
                found.append((self._returned(calls) if to is None else (function, calls, to, 0), own, None))
        return found

    def _returned(self, calls: _Calls) -> _Place | None:
        """Where a return leads; None: out of the interrupt."""
        while calls:
            *before, (function, to) = calls
            calls = tuple(before)
            if to is not None:
                return function, calls, to, 0
        return None

    def _contains(self, entry: int) -> bool:
        """Whether a function, or one that it calls, takes bytes."""
        if entry not in self._reads:
            self._reads[entry] = False  # while it is worked out
            blocks = self.program.functions[entry].blocks.values()
            self._reads[entry] = any(
                any(map(_takes, block.instructions)) or any(map(self._contains, block.calls)) for block in blocks
            )
        return self._reads[entry]


def _takes(instruction: Instruction) -> bool:
    return instruction.mnemonic == "lds" and instruction.operands[1] == DATA


def _while_one_waits(block: Block) -> set[int]:
    """The blocks behind a block that can come while a byte waits."""
    ways = {edge.to for edge in block.edges}
    *before, last = block.instructions
    if last.mnemonic not in ("sbrc", "sbrs") or last.operands[1] != COMPLETE or len(ways) != 2:
        return ways
    register = last.operands[0]
    for instruction in reversed(before):
        if register in written(instruction):
            if instruction.mnemonic == "lds" and instruction.operands[1] == STATUS:
                skipped = max(ways)
                return {skipped} if last.mnemonic == "sbrs" else ways - {skipped}
            return ways
    return ways
