"""Where an interrupt reads received bytes, and how long it may run until it has read a number of them.

A byte that waits is read by the code that reads the UART's data register: the receive interrupt, or one that keeps it
waiting and looks after the line meanwhile. Where it does shows in its machine code: a load of UDR0. While a byte waits,
a test of RXC (bit 7 of a register just loaded from UCSR0A, or its sign) goes one way only, so the other one is left
out: the bit is set when unread data exist in the receive buffer (data sheet, 20.11). Who finds a byte takes it before
he looks again or returns, as long as the receive ring is not full; that it is not is for others to show (budget.py).

Of an interrupt's run, from its acceptance (entry: 4 cycles) to the end of its RETI, these times are found, in cycles,
for bytes that wait all the time: with at most n bytes taken the longest whole run (`run`); from acceptance to the end
of the load that takes byte n + 1 (`until`); and of a run that has just found none, or taken the last, likewise the
longest rest (`rest`, `next`). None: there is no such run. `charged` is for sums over many runs.
"""

from __future__ import annotations

from dataclasses import dataclass

from avr_timing.bounds.wcet import WorstCase
from avr_timing.flow.paths import Graph, Mark, Way, longest
from avr_timing.flow.registers import ZERO, written
from avr_timing.interrupts.interrupts_off import ENTRY
from avr_timing.program import Block, Instruction

RECEIVE = 18  # vector of the receive interrupt (data sheet, table 12-6)
LOAD = 2  # cycles of such a load, within which it sees the byte or not
STATUS, SWITCH, DATA = 0xC0, 0xC1, 0xC6  # UCSR0A, UCSR0B, UDR0: addresses in data space
BIT = 7  # RXC0 in UCSR0A, RXCIE0 in UCSR0B

# A function, the calls that led there (each by its caller and the block behind it; None: a tail call), a block, and how
# many loads of the data register in it have been passed.
_Calls = tuple[tuple[int, int | None], ...]
_Place = tuple[int, _Calls, int, int]
_Node = tuple[int, bool, _Place]  # bytes taken, whether one was found that is not yet taken, place
SIGN = {"brlt": True, "brmi": True, "brge": False, "brpl": False}  # whether a branch is taken where bit 7 is set
MANY = 8  # bytes in one run: it takes them in a loop


@dataclass(frozen=True, slots=True)
class _Step:
    """From a place to the next one (None: the end), whether a byte is taken, whether one can wait then, and whether one
    was found by a look."""

    to: _Place | None
    cycles: int
    takes: bool
    waits: bool = True
    finds: bool = False
    is_on: bool = False  # the receive interrupt was found switched on


class ByteReads:
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
        """The longest whole run in which at most that many bytes are read."""
        return self._once("run", most)

    def until(self, taken: int) -> int | None:
        """The longest time from acceptance until one byte more than that is read."""
        return self._once("until", taken)

    def rest(self, most: int) -> int | None:
        """The longest rest of a run behind a look that found none, with at most that many read in it."""
        return self._once("rest", most)

    def next(self, taken: int) -> int | None:
        """The longest time from a look that found none until one byte more than that is read, in the same run."""
        return self._once("next", taken)

    @property
    def heeds_switch(self) -> bool:
        """Whether it takes a byte only where it has found the receive interrupt switched on since the one before."""
        seen: set[tuple[_Place, bool]] = set()
        work = [(self.start, False)]
        while work:
            place, is_on = work.pop()
            if (place, is_on) in seen:
                continue
            seen.add((place, is_on))
            for step in self._ways[place]:
                if step.takes and not is_on:
                    return False
                if step.to is not None:
                    work.append((step.to, step.is_on or (is_on and not step.takes)))
        return True

    def charged(self, each: int) -> int:
        """The longest run less `each` cycles a byte that it reads: what it costs where bytes are charged apart.

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
        """The longest way on which at most `most` bytes are read, ended with a number in `exits`, or (`until`) by the
        load of one more; `waiting`: bytes wait all the time."""
        ways: dict[_Node, list[Way[_Node]]] = {}
        first: _Node = (0, False, start)
        work = [first]
        while work:
            node = work.pop()
            if node in ways:
                continue
            ways[node] = []
            count, found, place = node
            for step in self._ways[place]:
                if waiting and (not step.waits or (found and (step.finds or (step.to is None and not step.takes)))):
                    continue
                if step.takes and count == most:
                    if until:
                        ways[node].append(Way(node, None, step.cycles))
                    continue
                after = count + step.takes
                if step.to is not None:
                    to = (after, waiting and (step.finds or (found and not step.takes)), step.to)
                    ways[node].append(Way(node, to, step.cycles))
                    work.append(to)
                elif after in exits:
                    ways[node].append(Way(node, None, step.cycles))
        walk = longest(Graph(first, ways, lambda node: self.program.where(node[2][2]), self._marks(ways)))
        return None if walk is None else before + walk.cycles

    def _marks(self, ways: dict[_Node, list[Way[_Node]]]) -> dict[_Node, list[Mark]]:
        """Bounds of loops, by the nodes in front of any load of their blocks."""
        found: dict[_Node, list[Mark]] = {}
        for node in ways:
            function, _, block, part = node[2]
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
        kept, switched = _behind_test(block, STATUS), _behind_test(block, SWITCH)  # of a look: where one waits
        found = []
        for to, cycles, edge in self._behind(place, block):
            waits = edge is None or kept is None or edge == kept
            is_on = edge is not None and edge == switched
            found.append(_Step(to, before + cycles, takes, waits, waits and kept is not None, is_on))
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
            callee = block.callee
            if callee is not None and self._contains(callee):
                found.append(((callee, (*calls, (function, to)), callee, 0), cycles, None))
                continue
            if callee is not None:
                cycles += self.worst_case.callee(callee, block, self.worst_case.inside(function)).cycles
            behind = self._returned(calls) if to is None else (function, calls, to, 0)
            found.append((behind, cycles, to if callee is None else None))
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
            self._reads[entry] = any(map(_takes, self.program.instructions(self.program.below(entry))))
        return self._reads[entry]


def _takes(instruction: Instruction) -> bool:
    return instruction.mnemonic == "lds" and instruction.operands[1] == DATA


def _behind_test(block: Block, address: int) -> int | None:
    """The block behind a test of bit 7 of a register of the UART, if that is set; None: the block ends with none.

    A test is a skip on the bit of a register that holds it, or a branch on its sign, which `tst` (`and` of a register
    with itself) or a comparison with zero has shown.
    """
    last, before = block.instructions[-1], list(block.instructions[:-1])
    ways = {edge.to for edge in block.edges}
    if len(ways) != 2:
        return None
    if last.mnemonic in ("sbrc", "sbrs") and last.operands[1] == BIT:
        register, is_set = last.operands[0], max(ways) if last.mnemonic == "sbrs" else min(ways)
    elif last.mnemonic in SIGN and before and _tells_sign(before[-1]):
        register, taken = before.pop().operands[0], last.operands[-1]
        is_set = taken if SIGN[last.mnemonic] else (ways - {taken}).pop()
    else:
        return None
    load = next((one for one in reversed(before) if register in written(one)), None)
    return is_set if load is not None and load.mnemonic == "lds" and load.operands[1] == address else None


def _tells_sign(instruction: Instruction) -> bool:
    name, operands = instruction.mnemonic, instruction.operands
    return (name in ("and", "or") and operands[0] == operands[1]) or (name == "cp" and operands[1] == ZERO)
