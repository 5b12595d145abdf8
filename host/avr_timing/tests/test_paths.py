"""The longest walk through bounded loops: closed forms, random walks, and the optimum of the integer program."""

from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import Bounds, LinearConstraint, milp

from avr_timing.flow.paths import Graph, Mark, Walk, Way, longest
from boebot.errors import AnalysisError
from random_shapes import END, Shape, random_shape


def graph_of(ways: list[tuple[int, int, int]], marks: dict[int, list[Mark]]) -> Graph[int]:
    nodes = {source for source, _, _ in ways}
    by_node = {node: [Way(node, None if t == END else t, c) for s, t, c in ways if s == node] for node in nodes}
    return Graph(0, by_node, lambda node: f"node {node}", marks)


def cycles_of(ways: list[tuple[int, int, int]], marks: dict[int, list[Mark]]) -> int:
    walk = longest(graph_of(ways, marks))
    assert walk is not None
    assert sum(way.cycles * times for way, times in walk.ways()) == walk.cycles
    return walk.cycles


def passes(most: int, loop: str = "loop") -> list[Mark]:
    return [Mark(loop, most, None)]


def optimum(shape: Shape) -> int:
    """Of the integer program: how often each way is gone, so that what comes into a node goes out of it."""
    balance = np.zeros((shape.nodes, len(shape.ways)))
    limits = np.zeros((len(shape.loops), len(shape.ways)))
    for i, (source, target, _) in enumerate(shape.ways):
        balance[source, i] += 1
        if target != END:
            balance[target, i] -= 1
        for row, (header, mark, most, nodes) in enumerate(shape.loops):
            limits[row, i] += source == mark
            limits[row, i] -= most * (target == header and source not in nodes)
    start = np.zeros(shape.nodes)
    start[0] = 1
    constraints = [LinearConstraint(balance, start, start)]
    if shape.loops:
        constraints.append(LinearConstraint(limits, -np.inf, 0))
    cycles = np.array([cycles for _, _, cycles in shape.ways])
    result = milp(-cycles, constraints=constraints, integrality=np.ones(len(cycles)), bounds=Bounds(0, np.inf))
    assert result.success, result.message
    return int(np.rint(-result.fun))


def simulated(shape: Shape, seed: int) -> int:
    """Cycles of one walk that keeps all bounds; 0 if it got stuck."""
    chance = random.Random(seed)
    node, total = 0, 0
    runs = [0] * len(shape.loops)
    while node != END:
        for i, (_, mark, most, _) in enumerate(shape.loops):
            if node == mark:
                runs[i] += 1
                if runs[i] > most:
                    return 0
        _, target, cycles = chance.choice([way for way in shape.ways if way[0] == node])
        for i, (header, _, _, nodes) in enumerate(shape.loops):
            if target == header and node not in nodes:
                runs[i] = 0
        total += cycles
        node = target
    return total


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32))
def test_bound_is_the_optimum_of_the_integer_program_and_above_every_walk(seed: int) -> None:
    shape = random_shape(seed)
    walk = longest(shape.graph())
    assert walk is not None
    assert walk.cycles == optimum(shape)
    assert all(simulated(shape, i) <= walk.cycles for i in range(20))


def test_while_tests_once_more_than_it_runs() -> None:
    # 0 -> test 1 -(3)-> body 2 -(10)-> test; the test's way out takes 5
    ways = [(0, 1, 1), (1, 2, 3), (2, 1, 10), (1, 3, 5), (3, END, 7)]
    assert cycles_of(ways, {2: passes(4)}) == 1 + 4 * 13 + 5 + 7
    assert cycles_of(ways, {2: passes(0)}) == 1 + 5 + 7


def test_do_while_runs_as_often_as_it_is_bounded() -> None:
    ways = [(0, 1, 1), (1, 1, 10), (1, 2, 4), (2, END, 7)]
    assert cycles_of(ways, {1: passes(6)}) == 1 + 5 * 10 + 4 + 7


@pytest.mark.parametrize("leaving", [2, 900])
def test_leaving_in_the_middle(leaving: int) -> None:
    ways = [(0, 1, 1), (1, 2, 3), (1, 3, 5), (2, 4, 6), (2, 3, leaving), (4, 1, 10), (3, END, 7)]
    by_test, by_break = 4 * 19 + 5, 3 * 19 + 3 + leaving
    assert cycles_of(ways, {2: passes(4)}) == 1 + max(by_test, by_break) + 7


def test_loops_in_each_other_multiply() -> None:
    ways = [(0, 1, 1), (1, 2, 1), (2, 3, 1), (3, 3, 10), (3, 4, 9), (4, 1, 2), (1, 5, 1), (5, END, 1)]
    inner = 4 * 10 + 9
    assert cycles_of(ways, {2: passes(3, "outer"), 3: passes(5, "inner")}) == 1 + 3 * (1 + 1 + inner + 2) + 1 + 1


def test_loop_bounded_by_time_takes_it_and_a_pass_more() -> None:
    ways = [(0, 1, 1), (1, 2, 3), (2, 1, 10), (1, 3, 5), (3, END, 7)]
    assert cycles_of(ways, {2: [Mark("loop", None, 500)]}) == 1 + 500 + 13 + 5 + 7


def test_loops_that_share_their_header_are_bounded_together() -> None:
    # outer: at most 3 times; inner `while` with its test at the outer's beginning: at most 2 times each.
    ways = [(0, 1, 1), (1, 2, 1), (2, 1, 10), (1, 3, 1), (3, 1, 20), (3, 4, 1), (4, END, 1)]
    marks = {2: passes(2, "inner"), 3: passes(3, "outer")}
    truth = 1 + 3 * 2 * 11 + 2 * 21 + 2 + 1  # of the real nest
    assert truth <= cycles_of(ways, marks)
    together = (2 + 1) * (3 + 1) - 1  # marked runs; the last of them leaves
    assert cycles_of(ways, marks) == 1 + (together - 1) * 21 + (1 + 1) + 1


def farthest(ways: list[tuple[int, int, int]], marked: set[int], most: int, node: int = 0) -> int:
    """By trying all walks from a node to the end with that many runs of marked nodes; below 0: there is none."""
    left = most - (node in marked)
    if node == END or left < 0:
        return 0 if node == END else -10_000
    return max(cycles + farthest(ways, marked, left, to) for source, to, cycles in ways if source == node)


@pytest.mark.parametrize("most", range(2, 12))
@pytest.mark.parametrize("skips", [False, True])
def test_copies_of_a_mark_in_one_pass_count_together(most: int, skips: bool) -> None:
    """The loop 1, 2, 4 is unrolled, with a mark in 1 and one in 2, which a pass may go around."""
    ways = [(0, 1, 1), (1, 2, 10), (1, 3, 5), (2, 4, 7), (2, 3, 1), (4, 1, 2), (4, 3, 3), (3, END, 1)]
    ways += [(1, 4, 1)] if skips else []
    found = cycles_of(ways, {1: passes(most), 2: passes(most)})
    truth = farthest(ways, {1, 2}, most)
    if skips:  # some passes hold one mark: each counts as if it were such a one, and as long as the others
        assert truth <= found == 1 + (most - 1) * 19 + 10 + 7 + 3 + 1
    else:
        assert truth <= found <= truth + 19


def test_copies_of_an_inner_loop_without_edges_back_do_not_hide_the_outer_bound() -> None:
    ways = [(0, 1, 1), (1, 2, 1), (2, 1, 10), (2, 3, 1), (3, END, 1)]
    assert cycles_of(ways, {1: passes(8, "outer"), 2: passes(2, "inner")}) == 1 + 7 * 11 + 2 + 1


@pytest.mark.parametrize(
    ("ways", "marks", "words"),
    [
        ([(0, 1, 1), (1, 1, 1), (1, END, 1)], {}, "loop at node 1 has no bound"),
        ([(0, 1, 1), (0, 2, 1), (1, 2, 1), (2, 1, 1), (2, END, 1)], {1: passes(3)}, "entered at two places"),
        ([(0, 1, 1), (1, 2, 1), (2, 1, 1), (1, 1, 1), (1, END, 1)], {2: passes(3)}, "passed without the place"),
    ],
    ids=["no bound", "two entries", "not in every pass"],
)
def test_refused(ways: list[tuple[int, int, int]], marks: dict[int, list[Mark]], words: str) -> None:
    with pytest.raises(AnalysisError, match=words):
        longest(graph_of(ways, marks))


def test_endless_loop_leads_nowhere() -> None:
    assert longest(graph_of([(0, 1, 1), (1, 1, 1)], {1: passes(3)})) is None


def test_empty_walk() -> None:
    walk: Walk[int] = Walk()
    assert list(walk.ways()) == []
