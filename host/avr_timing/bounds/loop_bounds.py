"""Which bound belongs to which loop of the machine code, and which of its blocks it counts.

Where the code itself shows how often a loop runs (loop_counts.py), that holds. Else a row of `.boebot.loops` does: it
counts how often its address runs for each entry of the innermost loop around it. Copies of one row have the same line
of the source, and rows at one address are of different loops, the outer one first: where nothing is to be done in the
outer loop's body before the inner loop, both bodies begin at the inner loop's header. Copies of one row that run one
after the other in one pass are of a loop within, which the compiler unrolled, and bound nothing around it.

A loop that waits asleep is counted by its time alone: what wakes it comes from outside.

A loop whose body is empty may have its row at its test, which runs once more than the body; count it there.
"""

from __future__ import annotations

from collections.abc import Hashable

from avr_timing.bounds import loop_counts
from avr_timing.flow.constants import Known
from avr_timing.flow.loops import Loop, with_parents
from avr_timing.flow.paths import Mark
from avr_timing.program import Block, Function, Program
from boebot.errors import AnalysisError

_Marks = dict[int, list[Mark]]
_Found = list[tuple[Loop[int], Loop[int] | None]]


def marks_of(program: Program, function: Function, known: Known) -> _Marks:
    """The bounds of a function's loops, by the blocks whose runs they count, in the context of `known`."""
    result = _said(program, function)
    whole = with_parents(function)
    for loop, parent in whole:
        if parent is not None:
            _move_out(result, loop, parent)
    for loop, _ in whole:
        _drop_unrolled(result, loop, function)
    loops = with_parents(known.function)
    _drop_others(result, whole, loops)
    for loop, _ in loops:
        shown = loop_counts.by_counter(loop, known, program)
        if shown is None:
            shown = loop_counts.by_execution(loop, known)
        if shown is not None and not any(sleeps(function.blocks[node]) for node in _own(loop)):
            for node in _own(loop):
                result.pop(node, None)
            result[loop.header] = [Mark(loop.header, shown, None)]
    return result


def sleeps(block: Block) -> bool:
    """Whether the CPU waits asleep in it, until an interrupt wakes it."""
    return any(instruction.mnemonic == "sleep" for instruction in block.instructions)


def check_sleep(program: Program, function: Function, marks: _Marks) -> None:
    """Raises AnalysisError where a function waits asleep, which takes no time that its instructions show, but for a
    loop of which the source says the time."""
    timed: set[int] = set()
    for loop, _ in with_parents(function):
        rows = [mark for node in _own(loop) for mark in marks.get(node, ())]
        if rows and all(mark.passes is None for mark in rows):
            timed |= _own(loop)
    for block in function.blocks.values():
        if block.start not in timed and sleeps(block):
            raise AnalysisError(
                f"{function.name} waits asleep at {program.where(block.start)}, so it has no bound; "
                "expected a loop around it with its time in the source (LOOP_CYCLES)"
            )


def _drop_unrolled(marks: _Marks, loop: Loop[int], function: Function) -> None:
    """Rows of which a copy runs after another one in the same pass of a loop."""
    places: dict[Hashable, list[int]] = {}
    for node in _own(loop):
        for mark in marks.get(node, ()):
            places.setdefault(mark.loop, []).append(node)
    for name, found in places.items():
        nodes = set(found)
        if len(nodes) < len(found) or any(_next(node, nodes, loop, function) for node in nodes):
            for node in nodes:
                marks[node] = [mark for mark in marks[node] if mark.loop != name]


def _next(start: int, nodes: set[int], loop: Loop[int], function: Function) -> bool:
    """Whether another of the nodes comes after this one before the loop's header."""
    seen = {start, loop.header}
    work = [start]
    while work:
        for edge in function.blocks[work.pop()].edges:
            if edge.to in loop.nodes and edge.to not in seen:
                if edge.to in nodes:
                    return True
                seen.add(edge.to)
                work.append(edge.to)
    return False


def _drop_others(marks: _Marks, whole: _Found, left: _Found) -> None:
    """Rows of loops that are none in this context: they bound nothing around them."""
    before, now = _innermost(whole), _innermost(left)
    for node in marks:
        if before.get(node) != now.get(node):
            marks[node] = []


def _innermost(loops: _Found) -> dict[int, int]:
    """Of each block in a loop, the header of the innermost one."""
    result: dict[int, int] = {}
    for loop, _ in loops:  # inner ones first
        for node in loop.nodes:
            result.setdefault(node, loop.header)
    return result


def _said(program: Program, function: Function) -> _Marks:
    result: _Marks = {}
    at: dict[int, int] = {}
    for bound in program.bounds:
        nth = at[bound.address] = at.get(bound.address, 0) + 1
        source = (program.lines.get(bound.address, bound.address), nth, bound.passes, bound.cycles)
        for block in function.blocks.values():
            last = block.instructions[-1]
            if block.instructions[0].address <= bound.address < last.address + last.size:
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
