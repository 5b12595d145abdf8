"""Where the cycles of a bound go: the worst path of a function, by functions and lines of the source.

The path is the one that the bound was worked out by (wcet.py); here its blocks are followed into what they call, and
their cycles handed to the lines of their instructions. What a block takes more or less by the way out of it is its last
instruction's, and so is the time that a loop waits.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field

from avr_timing.bounds.wcet import Visit, WorstCase
from avr_timing.flow.constants import Context, root
from avr_timing.program import Block


@dataclass(frozen=True, slots=True)
class PathRow:
    """A line of the source in one function of the image; `line` None: the image does not say which."""

    function: str
    line: str | None  # "file.c:123"
    cycles: int
    runs: int  # how often it runs at most of its instructions
    passes: tuple[int, ...]  # of each loop whose bound counts this line


def worst_path(worst: WorstCase, entry: int) -> tuple[PathRow, ...]:
    """Of one call of a function, in the order in which the path comes to its lines first; their cycles are its bound
    in sum.

    Raises:
        AnalysisError: the function has no bound.
    """
    found = _Lines(worst).of(entry, root(worst.program.functions[entry]))
    return tuple(
        PathRow(function, line, share.cycles, share.runs, tuple(share.passes.values()))
        for (function, line), share in found.items()
    )


@dataclass(slots=True)
class _Share:
    """Of one line in one call of a function."""

    cycles: int = 0
    runs: int = 0
    passes: dict[Hashable, int] = field(default_factory=dict)  # by loop

    def add(self, other: _Share, times: int) -> None:
        """Another call's, a number of times."""
        self.cycles += times * other.cycles
        self.runs += times * other.runs
        for loop, passes in other.passes.items():
            self.passes[loop] = self.passes.get(loop, 0) + times * passes


_Place = tuple[str, "str | None"]


class _Lines:
    def __init__(self, worst: WorstCase) -> None:
        self.worst = worst
        self.program = worst.program
        self._found: dict[tuple[int, Context], dict[_Place, _Share]] = {}

    def of(self, entry: int, context: Context) -> dict[_Place, _Share]:
        """One call of a function, with what it calls; in the order of the path."""
        if (entry, context) not in self._found:
            self._found[entry, context] = self._worked_out(entry, context)
        return self._found[entry, context]

    def _worked_out(self, entry: int, context: Context) -> dict[_Place, _Share]:
        function = self.program.functions[entry]
        inside, marks = self.worst.inside(entry, context), self.worst.marks(entry, context)
        found: dict[_Place, _Share] = {}
        for visit in self.worst.bound(entry, context).path:
            block = inside.function.blocks[visit.block]
            callee_cycles = 0 if block.callee is None else self.worst.callee(block.callee, block, inside).cycles
            ran: set[_Place] = set()
            for address, cycles in _instructions(block, visit, visit.cycles - visit.times * callee_cycles):
                place = (function.name, self.program.lines.get(address))
                share = found.setdefault(place, _Share())
                share.cycles += cycles
                ran.add(place)
            for place in ran:
                found[place].runs = max(found[place].runs, visit.times)
            first = found[function.name, self.program.lines.get(block.instructions[0].address)]
            for mark in marks.get(visit.block, ()):
                first.passes[mark.loop] = first.passes.get(mark.loop, 0) + visit.times
            if block.callee is not None:
                for place, share in self.of(block.callee, inside.handed(block)).items():
                    found.setdefault(place, _Share()).add(share, visit.times)
        return found


def _instructions(block: Block, visit: Visit, cycles: int) -> Iterator[tuple[int, int]]:
    """Address and cycles of each instruction in all runs of a block, `cycles` in sum."""
    for instruction in block.instructions[:-1]:
        yield instruction.address, visit.times * instruction.cycles
        cycles -= visit.times * instruction.cycles
    yield block.instructions[-1].address, cycles
