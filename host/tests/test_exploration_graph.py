"""Nodes of an exploration: the notes' examples, and what must hold for paths however nodes are reached and blocked."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.navigation import Scan
from boebot.navigation.exploration_graph import ExplorationGraph, Placement, joined


def test_paths_after_a_move_as_in_the_notes() -> None:
    """From 1 to 4: (1, 2) becomes (4, 1, 2); and where two paths part, the way goes back only to there."""
    assert joined([1, 4], [1, 2]) == [4, 1, 2] and joined([1, 4], [1, 3]) == [4, 1, 3]
    assert joined([1, 4, 6], [1, 4, 7]) == [6, 4, 7]
    assert joined([1, 4], [1, 4, 6]) == [4, 6]


def test_nodes_of_the_notes_scan() -> None:
    """Fig. 6.1: 181 rays from -90 to 90 degrees; the interval of 88 and 89 degrees is too narrow for a node."""
    degrees = np.arange(-90, 91)
    distances = np.full(181, 0.8)
    for first, last, far in ((-70, -31, 2.0), (-10, 84, 1.6), (88, 89, 3.0)):
        distances[(degrees >= first) & (degrees <= last)] = far
    scan = Scan(distances, (-math.pi / 2, math.pi / 2), 4.0)
    placement = Placement(distance=1.0, margin=0.3, least_angle=0.35, least_distance=0.75)
    assert np.degrees(placement.intervals(scan)) == pytest.approx(np.array([(-70, -31), (-10, 84), (88, 89)]))
    assert np.degrees(placement.bearings(scan)) == pytest.approx([-50.5, 13.5, 60.5])


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
