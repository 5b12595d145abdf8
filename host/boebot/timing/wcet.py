"""Worst-case execution time of a function of an image, interrupts not counted, and the path that takes it.

From the function's first instruction to the end of its return, with all that it calls; the call itself is the
caller's. Every path of the graph counts as possible; loops are bounded by what the image says of them, by their own
code (counted.py), or, in library routines, by what they are called with (ARGUMENTS).
"""

from __future__ import annotations

from dataclasses import dataclass

from boebot.errors import TimingError
from boebot.timing.marks import marks_of
from boebot.timing.paths import Graph, Mark, Walk, Way, longest
from boebot.timing.program import Block, Function, Program
from boebot.timing.registers import before, constant, halted

# Library routines with a loop that runs by an argument: its lower register (avr-gcc's calling convention, 16 bits), and
# how often the loop's header runs more than the argument says.
ARGUMENTS: dict[str, tuple[int, int]] = {
    "memcpy": (20, 1),  # third argument; `subi, sbci, brcc` at the header borrows in the pass after the last byte
    "memcpy_P": (20, 1),  # the same
    "memset": (20, 1),  # the same
}


@dataclass(frozen=True, slots=True)
class Visit:
    """A block on the worst path: how often it runs in one call of the function, and what that takes in all."""

    block: int
    times: int
    cycles: int  # with callees


@dataclass(frozen=True, slots=True)
class Bound:
    """Cycles that a function takes at most; the path, in the order of first visits; and how much of it is whose."""

    cycles: int
    path: tuple[Visit, ...]
    callees: dict[int, int]  # entry of a function that this one calls -> its share of the cycles


class WorstCase:
    """Bounds of the functions of a program, each worked out once."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self._bounds: dict[tuple[int, int | None], Bound] = {}
        self._under_way: list[int] = []
        self._marks: dict[int, dict[int, list[Mark]]] = {}

    def of(self, function: str | int) -> Bound:
        """The bound of a function, by name or entry.

        Raises:
            TimingError: no such function; a loop without a bound; recursion; it never returns.
        """
        if isinstance(function, str):
            if function not in self.program.by_name:
                raise TimingError(f"{self.program.path} has no function {function}")
            function = self.program.by_name[function]
        return self.bound(function)

    def bound(self, entry: int, argument: int | None = None) -> Bound:
        """The same by entry; `argument` is what a routine of ARGUMENTS is called with."""
        key = (entry, argument)
        if key not in self._bounds:
            if entry in self._under_way:
                names = [self.program.functions[each].name for each in self._under_way]
                chain = " calls ".join([*names[self._under_way.index(entry) :], self.program.functions[entry].name])
                raise TimingError(
                    f"recursion at {self.program.where(entry)}: {chain}; expected functions that do not call themselves"
                )
            self._under_way.append(entry)
            try:
                self._bounds[key] = self._bound(self.program.functions[entry], argument)
            finally:
                self._under_way.pop()
        return self._bounds[key]

    def _bound(self, function: Function, argument: int | None) -> Bound:
        ways = {start: self.ways(block, function) for start, block in function.blocks.items()}
        graph = Graph(function.entry, ways, self.program.where, self.marks(function, argument))
        walk = longest(graph)
        if walk is None:
            raise TimingError(f"{function.name} at {self.program.where(function.entry)} never returns; no bound")
        return _told(walk)

    def ways(self, block: Block, function: Function) -> list[Way[int]]:
        """The ways out of a block, with what is called at its end."""
        callee, callee_cycles = None, 0
        for entry in block.calls:
            cycles = self.callee(entry, block, function).cycles
            if callee is None or cycles > callee_cycles:
                callee, callee_cycles = entry, cycles
        own = block.body_cycles + sum(map(halted, block.instructions)) + callee_cycles
        if not block.edges:
            return [Way(block.start, None, own + block.last_cycles, callee, callee_cycles)]
        edges: dict[int, int] = {}
        for edge in block.edges:
            edges[edge.to] = max(edges.get(edge.to, 0), edge.cycles)
        return [Way(block.start, to, own + cycles, callee, callee_cycles) for to, cycles in edges.items()]

    def callee(self, entry: int, block: Block, function: Function) -> Bound:
        """Of what a block calls, with the argument that it hands over, where that matters."""
        called = self.program.functions[entry]
        if called.name not in ARGUMENTS:
            return self.bound(entry)
        register = ARGUMENTS[called.name][0]
        came_from = before(function)
        call_itself = len(block.instructions) - 1
        low = constant(register, block, came_from, call_itself)
        high = constant(register + 1, block, came_from, call_itself)
        if low is None or high is None:
            call = self.program.where(block.instructions[-1].address)
            raise TimingError(
                f"{called.name} is called at {call} with a number of bytes that is not a constant; "
                "expected a constant, or a bounded loop in its place"
            )
        return self.bound(entry, high << 8 | low)

    def marks(self, function: Function, argument: int | None = None) -> dict[int, list[Mark]]:
        """What is known of the function's loops, at the blocks whose runs it counts."""
        if argument is not None:
            return marks_of(self.program, function, argument + ARGUMENTS[function.name][1])
        if function.entry not in self._marks:
            self._marks[function.entry] = marks_of(self.program, function)
        return self._marks[function.entry]


def _told(walk: Walk[int]) -> Bound:
    times: dict[int, int] = {}
    cycles: dict[int, int] = {}
    callees: dict[int, int] = {}
    for way, count in walk.ways():
        times[way.node] = times.get(way.node, 0) + (0 if way.waits else count)
        cycles[way.node] = cycles.get(way.node, 0) + count * way.cycles
        if way.callee is not None:
            callees[way.callee] = callees.get(way.callee, 0) + count * way.callee_cycles
    path = tuple(Visit(block, times[block], cycles[block]) for block in times)
    return Bound(walk.cycles, path, callees)
