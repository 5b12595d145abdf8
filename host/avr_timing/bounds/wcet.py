"""Worst-case execution time of a function of an image, interrupts not counted, and the path that takes it.

From the function's first instruction to the end of its return, with all that it calls; the call itself is the
caller's. A function is bounded once for each set of constants that calls hand to it (constants.py). Every path that
these leave counts as possible; loops are bounded by what the image says of them and by their own code (loop_counts.py).
`main` never returns and so has no bound: one pass of its endless loop is taken apart in costs.py, and what comes before
that loop is the start-up, of which only the stretches with interrupts off count (interrupts_off.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from avr_timing.bounds.loop_bounds import check_sleep, marks_of
from avr_timing.bounds.stack import Stack
from avr_timing.flow.constants import Context, Known, known, root
from avr_timing.flow.paths import Graph, Mark, Walk, Way, longest
from avr_timing.program import Block, Program
from boebot.errors import AnalysisError

# Library routines with a loop that runs by an argument, of 16 bits: its lower register (avr-gcc's calling convention).
COUNTS = {"memcpy": 20, "memcpy_P": 20, "memset": 20}


@dataclass(frozen=True, slots=True)
class Visit:
    """A block on the worst path: how often it runs in one call of the function, and what that takes in all."""

    block: int
    times: int
    cycles: int  # with callees


@dataclass(frozen=True, slots=True)
class Bound:
    """Cycles that a function takes at most, and the path, in the order of first visits."""

    cycles: int
    path: tuple[Visit, ...]


class WorstCase:
    """Bounds of the functions of a program, each worked out once."""

    def __init__(self, program: Program, given: Mapping[int, int] | None = None) -> None:
        """`given`: cycles of functions, by entry, whatever they do: the rest is accounted for elsewhere."""
        self.program = program
        self._given = given or {}
        self._bounds: dict[tuple[int, Context], Bound] = {}
        self._inside: dict[tuple[int, Context], Known] = {}
        self._marks: dict[tuple[int, Context], dict[int, list[Mark]]] = {}
        self._stack = Stack(program, self._given)
        self._under_way: list[int] = []

    def of(self, function: str | int) -> Bound:
        """The bound of a function, by name or entry.

        Raises:
            AnalysisError: no such function; a loop without a bound; recursion; it never returns, waits asleep, or may
                return to elsewhere than where it was called (stack.py).
        """
        return self.bound(self.program.entry(function))

    def bound(self, entry: int, context: Context | None = None) -> Bound:
        """The same by entry; `context`: registers that hold constants there, else those of any call."""
        if entry in self._given:
            return Bound(self._given[entry], ())
        if entry in self.program.unproven:
            raise AnalysisError(self.program.unproven[entry])
        key = self._key(entry, context)
        if key not in self._bounds:
            with self.program.entered(entry, self._under_way):
                self._bounds[key] = self._bound(*key)
        return self._bounds[key]

    def _key(self, entry: int, context: Context | None) -> tuple[int, Context]:
        return entry, root(self.program.functions[entry]) if context is None else context

    def inside(self, entry: int, context: Context | None = None) -> Known:
        """A function as such a call finds it: what is known in it, and the ways that this leaves."""
        key = self._key(entry, context)
        if key not in self._inside:
            self._inside[key] = known(self.program.functions[entry], key[1])
        return self._inside[key]

    def marks(self, entry: int, context: Context | None = None) -> dict[int, list[Mark]]:
        """What is known of the loops in it, at the blocks whose runs it counts."""
        key = self._key(entry, context)
        if key not in self._marks:
            self._marks[key] = marks_of(self.program, self.program.functions[entry], self.inside(*key))
        return self._marks[key]

    def _bound(self, entry: int, context: Context) -> Bound:
        function, inside = self.program.functions[entry], self.inside(entry, context)
        ways = {start: self.ways(block, inside) for start, block in inside.function.blocks.items()}
        marks = self.marks(entry, context)
        check_sleep(self.program, inside.function, marks)
        graph = Graph(function.entry, ways, self.program.where, marks)
        walk = longest(graph)
        if walk is None:
            raise AnalysisError(f"{function.name} at {self.program.where(function.entry)} never returns; no bound")
        self._stack.bound(function.entry, context)  # refuses what may return to elsewhere than its call
        return _told(walk)

    def ways(self, block: Block, inside: Known) -> list[Way[int]]:
        """The ways out of a block, with what is called at its end."""
        own = block.body_cycles
        if block.callee is not None:
            own += self.callee(block.callee, block, inside).cycles
        if not block.edges:
            return [Way(block.start, None, own + block.last_cycles)]
        edges: dict[int, int] = {}
        for edge in block.edges:
            edges[edge.to] = max(edges.get(edge.to, 0), edge.cycles)
        return [Way(block.start, to, own + cycles) for to, cycles in edges.items()]

    def callee(self, entry: int, block: Block, inside: Known) -> Bound:
        """Of what a block calls, with the constants that it hands over."""
        name = self.program.functions[entry].name
        if name in COUNTS and inside.before_last(block).word(COUNTS[name]) is None:
            call = self.program.where(block.instructions[-1].address)
            raise AnalysisError(
                f"{name} is called at {call} with a number of bytes that is not a constant; "
                "expected a constant, or a bounded loop in its place"
            )
        return self.bound(entry, inside.handed(block))


def _told(walk: Walk[int]) -> Bound:
    times: dict[int, int] = {}
    cycles: dict[int, int] = {}
    for way, count in walk.ways():
        times[way.node] = times.get(way.node, 0) + (0 if way.waits else count)
        cycles[way.node] = cycles.get(way.node, 0) + count * way.cycles
    return Bound(walk.cycles, tuple(Visit(block, times[block], cycles[block]) for block in times))
