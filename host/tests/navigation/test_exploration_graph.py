"""Nodes of an exploration: what must hold for paths however nodes are reached and blocked. The notes' example: E36."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.navigation import Scan
from boebot.navigation.exploration_graph import ExplorationGraph, Placement


def test_no_return_is_free() -> None:
    scan = Scan(np.full(19, -1.0), (-math.pi / 2, math.pi / 2), 4.0)
    assert Placement().intervals(scan) == [pytest.approx((-math.pi / 2, math.pi / 2))]
    assert Placement().intervals(Scan(np.full(19, 0.5), (-1.0, 1.0), 4.0)) == []


def test_nodes_are_apart_and_the_nearest_is_next() -> None:
    graph = ExplorationGraph((0.0, 0.0), 0.75)
    first, second = graph.place((1.0, 0.0)), graph.place((0.0, 1.1))
    assert first is not None and second is not None
    assert graph.place((0.5, 0.0)) is None and graph.place((1.0, 0.7)) is None
    assert graph.target() is first
    graph.reached(1)
    assert (first.status, graph.active, second.path) == ("completed", 1, [1, 0, 2])
    third = graph.place((2.0, 0.0))
    assert third is not None and graph.target() is third
    graph.blocked(third.number)
    assert (third.status, graph.active, second.path) == ("unreachable", 3, [3, 1, 0, 2])
    assert graph.place((2.0, 0.2)) is None and graph.place((2.0, 0.3)) is not None, "nearer to what is unreachable"
    graph.reached(4)
    graph.reached(2)
    assert graph.target() is None


def test_setting_out_says_whether_a_way_leads_there() -> None:
    graph = ExplorationGraph((0.0, 0.0), 0.75)
    for number, place in enumerate([(1.0, 0.0), (2.0, 0.0)], 1):
        graph.place(place)
        graph.reached(number)
    start = graph.nodes[0]
    assert graph.set_out(start) and start.path == [2, 1, 0]
    graph.bad_leg(0, 1)
    assert not graph.set_out(start)


@given(st.lists(st.tuples(st.integers(0, 3), st.floats(-3, 3), st.floats(-3, 3)), max_size=40))
def test_paths_lead_from_the_active_node_along_neighbours(deeds: list[tuple[int, float, float]]) -> None:
    """However nodes are placed, reached and blocked: no leg but those along which nodes were placed."""
    graph = ExplorationGraph((0.0, 0.0), 0.2)
    legs = set()
    for deed, x, y in deeds:
        target = graph.target()
        if deed < 2 or target is None:
            before = graph.active
            node = graph.place((x, y))
            if node is not None:
                legs |= {(before, node.number), (node.number, before)}
        elif deed == 2:
            graph.reached(target.number)
        else:
            graph.blocked(target.number)
        for node in graph.pending:
            assert (node.path[0], node.path[-1]) == (graph.active, node.number)
            assert len(set(node.path)) == len(node.path)
            assert set(zip(node.path, node.path[1:], strict=False)) <= legs


def test_back_at_another_node_paths_begin_there() -> None:
    """R14b, and R14d: from there it is the shortest way over completed nodes that counts."""
    graph = ExplorationGraph((0.0, 0.0), 0.75, beside=1.1)
    for place in ((1.0, 0.0), (1.0, 1.0), (0.0, 1.0)):
        graph.place(place)
        graph.reached(graph.active + 1)
    last = graph.place((-1.0, 1.0))
    assert last is not None and last.path == [3, 4]
    graph.came_back(0)
    assert (graph.active, last.path) == (0, [0, 3, 4]), "from 0 to 3 it is 1 m, though none was driven there"
    graph.blocked(4)
    graph.came_back(3)
    assert (graph.active, last.status, graph.way(1)) == (3, "unreachable", [3, 0, 1])
    assert [node.number for node in graph.nearest_completed((0.9, 0.8))] == [2, 1, 3, 0]
    graph.retry(last, 1)
    assert (graph.target(), last.path) == (last, [3, 0, 1, 4])


def test_bad_leg_is_tried_once_more() -> None:
    """R14c, R14f: what lies beyond it is unreachable until then, and again when it was bad twice."""
    graph = ExplorationGraph((0.0, 0.0), 0.75)
    graph.place((1.0, 0.0))
    graph.reached(1)
    far = graph.place((2.0, 0.0))
    assert far is not None
    graph.came_back(0)
    graph.bad_leg(0, 1)
    assert (far.status, graph.way(1)) == ("unreachable", [])
    assert graph.try_legs_again() and graph.way(1) == [0, 1]
    graph.retry(far, 1)
    assert far.path == [0, 1, 2]
    graph.bad_leg(0, 1)
    assert far.status == "unreachable" and not graph.try_legs_again()
