"""Which bound belongs to which loop of the machine code, and which of its blocks it counts.

A row of `.boebot.loops` counts how often its address runs. It belongs to the innermost loop around that address. Copies
of one loop have the same line of the source, and rows at one address are of different loops, the outer one first: where
nothing is to be done in the outer loop's body before the inner loop, both bodies begin at the inner loop's header.
What the code itself shows of a loop (counted.py) takes the place of what is said. Two things no ELF tells:

* A loop whose body is empty may have its row at its test, which runs once more than the body; count it there.
* Where a loop without a bound has one with a bound in it that the compiler unrolled, the row seems to be its own. So
  every loop of the source needs a bound, not only those in which something is refused.
"""

from __future__ import annotations

from boebot.timing import counted
from boebot.timing.loops import IrreducibleError, Loop, natural_loops, reverse_postorder
from boebot.timing.paths import Mark
from boebot.timing.program import Function, Program

_Marks = dict[int, list[Mark]]


def marks_of(program: Program, function: Function, runs: int | None = None) -> _Marks:
    """The bounds of a function's loops, by the blocks whose runs they count.

    `runs`: how often the header of its only loop runs, for a library routine whose argument is known.
    """
    result = _said(program, function)
    loops = _with_parents(function)
    for loop, parent in loops:
        if parent is not None:
            _move_out(result, loop, parent)
    for loop, _ in loops:
        shown = counted.passes(loop, function)
        if shown is None and not loop.inner:
            shown = runs
        if shown is not None:
            for node in _own(loop):
                result.pop(node, None)
            result[loop.header] = [Mark(loop.header, shown, None)]
    return result


def _said(program: Program, function: Function) -> _Marks:
    result: _Marks = {}
    at: dict[int, int] = {}
    for bound in program.bounds:
        nth = at[bound.address] = at.get(bound.address, 0) + 1
        source = (program.lines.get(bound.address, bound.address), nth, bound.passes, bound.cycles)
        for block in function.blocks.values():
            last = block.instructions[-1]
            if block.start <= bound.address < last.address + last.size:
                result.setdefault(block.start, []).append(Mark(source, bound.passes, bound.cycles))
    return result


def _move_out(marks: _Marks, loop: Loop[int], parent: Loop[int]) -> None:
    """Of several rows at the header of a loop, all but the last to the loop around it, if that has none. Its header
    runs once more than its body."""
    found = marks.get(loop.header, [])
    if len(found) < 2 or len(loop.latches) > 1 or any(node in marks for node in _own(parent)):
        return
    marks[loop.header] = found[-1:]
    marks[parent.header] = [
        Mark(mark.loop, None if mark.passes is None else mark.passes + 1, mark.cycles) for mark in found[:-1]
    ]


def _own(loop: Loop[int]) -> frozenset[int]:
    """Its blocks that are in no loop within it."""
    return loop.nodes.difference(*(inner.nodes for inner in loop.inner))


def _with_parents(function: Function) -> list[tuple[Loop[int], Loop[int] | None]]:
    """All loops, inner ones before those around them."""

    def successors(start: int) -> list[int]:
        return [edge.to for edge in function.blocks[start].edges]

    order = reverse_postorder(function.entry, successors)
    try:
        outermost = natural_loops(order, successors)
    except IrreducibleError:
        return []  # refused by whoever looks for paths
    found: list[tuple[Loop[int], Loop[int] | None]] = [(loop, None) for loop in outermost]
    for loop, _ in found:  # grows meanwhile
        found += [(inner, loop) for inner in loop.inner]
    return found[::-1]
