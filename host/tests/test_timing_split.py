"""Loops with several entries, made reducible: any graph comes out reducible, and with the same ways through it."""

from __future__ import annotations

import random
from functools import partial
from pathlib import Path

import pytest
from test_timing_wcet import LOOP

from avr_image import assembled
from boebot.errors import TimingError
from boebot.timing.loops import IrreducibleError, natural_loops, reverse_postorder
from boebot.timing.program import COPY, Block, Edge, Instruction
from boebot.timing.split import MOST, reducible
from boebot.timing.wcet import WorstCase

# A row in the body of a loop that is entered there and at its test.
ROW = """
main: sbrc r24, 0
 rjmp 2f
1: bounded 5
 lds r18, 256
2: sbis 5, 0
 rjmp 1b
 ret
"""


def graph(edges: dict[int, tuple[int, ...]]) -> dict[int, Block]:
    return {
        start: Block(start, (Instruction(start, 2, "nop", (), 1),), tuple(Edge(to, 1) for to in leads))
        for start, leads in edges.items()
    }


def ways(blocks: dict[int, Block], entry: int, length: int) -> set[tuple[int, ...]]:
    """All of that many blocks from the entry on, and shorter ones that end; copies as what they are copies of."""
    found: set[tuple[int, tuple[int, ...]]] = {(entry, (entry,))}
    for _ in range(length):
        ended = {(start, way) for start, way in found if not blocks[start].edges}
        found = ended | {(edge.to, (*way, edge.to % COPY)) for start, way in found for edge in blocks[start].edges}
    return {way for _, way in found}


def successors(blocks: dict[int, Block], start: int) -> list[int]:
    return [edge.to for edge in blocks[start].edges]


def test_random_graphs_keep_their_ways() -> None:
    chance = random.Random(12)
    made = left = 0
    for _ in range(600):
        size = chance.randrange(3, 9)
        edges = {
            2 * i: tuple(2 * j for j in chance.sample(range(size), chance.choice((0, 1, 2, 2)))) for i in range(size)
        }
        edges = {start: edges[start] for start in reverse_postorder(0, edges.__getitem__)}
        blocks = graph(edges)
        found = reducible(blocks, 0)
        assert len(found) <= MOST * len(blocks)
        assert ways(found, 0, 7) == ways(blocks, 0, 7)
        following = partial(successors, found)
        try:
            natural_loops(reverse_postorder(0, following), following)
        except IrreducibleError:
            assert found is blocks  # it would have grown too much
            left += 1
            continue
        made += len(found) > len(blocks)
    assert made > 40 and left < 20


def test_reducible_graphs_stay_as_they_are() -> None:
    blocks = graph({0: (2,), 2: (4, 6), 4: (4, 2), 6: ()})
    assert reducible(blocks, 0) is blocks


def test_row_of_a_loop_counts_where_it_is_in_the_loop(tmp_path: Path) -> None:
    passes = 5 * (1 + 2 + 2) + 2 + 4  # sbis, rjmp, lds; then sbis skips, ret
    # sbrc skips, the copy of the loop's body (which its row does not count: so much the bound is above what can be)
    assert WorstCase(assembled(tmp_path, LOOP + ROW)).of("main").cycles == 2 + 2 + passes


def test_row_in_a_copy_does_not_bound_the_loop_around_it(tmp_path: Path) -> None:
    """What is copied to before the inner loop's header lies in the loop around it, and has its row there."""
    source = LOOP + "main: 3: nop\n" + ROW.replace("main:", "").replace("ret", "sbis 6, 1\n rjmp 3b\n ret")
    with pytest.raises(TimingError, match="has no bound"):
        WorstCase(assembled(tmp_path, source)).of("main")
