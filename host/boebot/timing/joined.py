"""Loops of the source of which the compiler made two, one within the other, become one again.

Where a body has several ways back to the test (`continue`), a compiler that optimises for speed may repeat the test at
one of them. Its way back leads to the body then, and makes a loop of its own within that of the other ways; the row of
the source's loop lies in both of them. A loop in which that row lies, but no place at which the source's loop is
entered, is a part of it or the whole: all its passes are passes of the source's loop, entered once. Such a loop is
turned so that it begins at the row: what runs before the row for the first time is there a second time (split.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from boebot.timing.loops import IrreducibleError, Loop, natural_loops, reverse_postorder
from boebot.timing.program import Block, Program
from boebot.timing.split import Blocks, entered_only_at, reached, successors


def joined(blocks: Blocks, entry: int, program: Program) -> Blocks:
    """The same function; each loop that is a loop of the source with a bound begins at one place."""
    rows = {bound.address: bound.line for bound in program.bounds}
    while program.entries:
        following = partial(successors, blocks)
        order = reverse_postorder(entry, following)
        blocks = {start: blocks[start] for start in order}
        try:
            loops = natural_loops(order, following)
        except IrreducibleError:  # refused by whoever looks for paths
            break
        turned = next(_to_turn(blocks, loops, rows, program.entries), None)
        if turned is None:
            break
        loop, start = turned
        blocks = entered_only_at(start, blocks, set(loop.nodes), {loop.header})
    return blocks


def lines_at(block: Block, places: dict[int, int]) -> set[int]:
    """The lines of the loops whose place is in a block."""
    return {places[each.address] for each in block.instructions if each.address in places}


def _to_turn(
    blocks: Blocks, loops: list[Loop[int]], rows: dict[int, int], entries: dict[int, int]
) -> Iterator[tuple[Loop[int], int]]:
    """Loops without a row outside of the loops within them, and the block of a row with which they can begin."""
    for loop in loops:
        inner = frozenset(node for each in loop.inner for node in each.nodes)
        if not any(lines_at(blocks[node], rows) for node in loop.nodes - inner):
            entered = set[int]().union(*(lines_at(blocks[node], entries) for node in loop.nodes)) | {0}
            for node in sorted(inner):
                in_every_pass = loop.header not in reached(blocks, loop.header, loop.nodes - {node})
                if lines_at(blocks[node], rows) - entered and in_every_pass:
                    yield loop, node
        yield from _to_turn(blocks, list(loop.inner), rows, entries)
