"""What is taken away from the experiments of chapter 6 (E36 to E55); test_experiment_mutants.py runs these rows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from boebot.navigation import (
    Estimate,
    Explore,
    Lattice,
    LineMap,
    LockDetector,
    PotentialField,
    RandomSearch,
    Scan,
    exploration_graph,
)
from boebot.navigation.exploration_graph import ExplorationGraph, Placement
from boebot.navigation.steering import SteeredBehavior
from boebot_course.experiments import exploring, grid_search, potential_fields, scan_matching
from boebot_course.experiments.grid_search import Nodes
from boebot_course.tests.mutants import Mutant

search_module = import_module("boebot.navigation.search")  # the package has a function of that name


def put(owner: Any, name: str, made: Callable[[Any], Any]) -> Callable[[pytest.MonkeyPatch], None]:
    """A patch: `owner.name` becomes `made(owner.name)`."""
    return lambda monkeypatch: monkeypatch.setattr(owner, name, made(getattr(owner, name)))


def bearings_with(**changed: float) -> Callable[[Any], Any]:
    """Nodes placed by other parameters."""

    def made(bearings: Any) -> Any:
        def placed(self: Placement, scan: Scan) -> Any:
            return bearings(replace(self, **changed), scan)

        return placed

    return made


def without_heuristic(distance: Any) -> Any:
    """A distance to the target that says nothing."""
    return lambda self, cell, other: 0.0


def as_if(method: str) -> Callable[[Any], Any]:
    """Dijkstra's search does what another one does."""

    def made(best_first: Any) -> Any:
        return lambda graph, start, target, asked: best_first(
            graph, start, target, method if asked == "dijkstra" else asked
        )

    return made


def slope_of(**changed: float) -> Callable[[Any], Any]:
    """A gradient by other widths or directions of the potentials than their own."""
    return lambda old: (
        lambda self, points: old(PotentialField.of(replace(one, **changed) for one in self.potentials), points)
    )


def steering(**changed: float) -> Callable[[pytest.MonkeyPatch], None]:
    """Robots that steer by other parameters."""

    def made(steer: Any) -> Any:
        def steered(self: Any, *arguments: Any) -> None:
            for name, value in changed.items():
                setattr(self, name, value)
            steer(self, *arguments)

        return steered

    return put(SteeredBehavior, "steer", made)


def longer_way(steer: Any) -> Any:
    """It turns to where the reference heading is by the longer way."""
    return lambda self, robot, error, share=1.0: steer(
        self, robot, error if abs(error) < math.pi / 3 else -error, share
    )


def uphill(steer: Any) -> Any:
    """It heads for where the field rises."""
    return lambda self, robot, error, share=1.0: steer(self, robot, error + math.pi, share)


def box_stays(search_pose: Any) -> Any:
    """Each try begins where the search began."""

    def searched(*arguments: Any, tries: int, **terms: Any) -> Any:
        return min((search_pose(*arguments, tries=1, **terms) for _ in range(tries)), key=lambda match: match.error)

    return searched


def search_with(**changed: Any) -> Callable[[Any], Any]:
    """A random search with other parameters."""
    return lambda search_pose: lambda *arguments, **terms: search_pose(*arguments, **(terms | changed))


def in_metres(_: Any) -> Any:
    """ε of distances, not of their shares."""

    def errors(self: Scan, plan: LineMap, poses: Any, least: int = 20) -> Any:
        off = np.where(self.known, self.expected(plan, poses) - self.distances, 0.0)
        return np.sqrt((off**2).mean(axis=1))

    return errors


def from_beside(expected: Any) -> Any:
    """What the map lets expect 2 cm and 0.02 rad away."""
    return lambda self, plan, poses: expected(self, plan, np.add(poses, 0.02))


def unheeded(_: Any) -> Any:
    """ε says nothing."""
    return lambda self, plan, poses, least=20: np.full(len(poses), 0.05)


NOTHING: list[Any] = []


def looking_ahead(self: Explore) -> None:
    """In one direction only."""
    self._headings, self._looked_about = [], set(range(1000))


def correcting_nothing(self: RandomSearch, scan: Scan) -> Estimate:
    """Whatever a scan says, the pose stays."""
    return Estimate(self.pose, self.uncertainty, 0.0, True)


NAVIGATION = [
    Mutant(
        "E36",
        "the common part of two paths is left out",
        put(exploration_graph, "joined", lambda _: lambda way, path: [*reversed(way), *path[1:]]),
    ),
    Mutant("E36", "d_min", put(ExplorationGraph, "__init__", lambda init: lambda self, at, _: init(self, at, 0.0))),
    Mutant("E36", "the nearest is next", put(ExplorationGraph, "length", lambda _: lambda self, path: 0.0)),
    Mutant("E37", "γ_min", put(Placement, "bearings", bearings_with(least_angle=1e-9))),
    Mutant("E37", "several nodes in a wide interval", put(Placement, "bearings", bearings_with(least_distance=2.0))),
    Mutant("E37", "the margin Δ", put(Placement, "bearings", bearings_with(margin=0.0))),
    Mutant("E41", "the heuristic", put(Lattice, "distance", without_heuristic)),
    Mutant("E42", "the extended obstacle", put(grid_search, "c_wall", lambda _: grid_search.open_map)),
    Mutant("E43", "the way from the start counts", put(search_module, "_best_first", as_if("greedy"))),
    Mutant("E43", "it expands in all directions", put(search_module, "_best_first", as_if("astar"))),
    Mutant(
        "E44",
        "a heuristic that never promises too much",
        put(Lattice, "distance", lambda old: lambda *at: 3 * old(*at)),
    ),
    Mutant("E44", "the heuristic", put(Lattice, "distance", without_heuristic)),
    Mutant(
        "E45",
        "the cost of an edge",
        put(Nodes, "neighbours", lambda _: lambda self, node: ((n, 1.0) for n in self.edges[node])),
    ),
    Mutant(
        "E45",
        "both grids have the same wall",
        put(grid_search, "nodes_of", lambda old: lambda free: old(grid_search.open_map())),
    ),
    Mutant(
        "E46",
        "the clearance",
        put(grid_search, "tightened", lambda old: lambda path, plan, clear: old(path, plan, 0.0)),
    ),
    Mutant("E46", "tightening", put(grid_search, "tightened", lambda _: lambda path, plan, clear: path)),
    Mutant(
        "E46",
        "cells cover what is free",
        put(grid_search, "rectangles_of", lambda old: lambda free: old(free & False)),
    ),
    Mutant("E47", "the potentials' directions", put(PotentialField, "gradient", slope_of(heading=0.0))),
    Mutant("E47", "the factor 2 of (6.3)", put(PotentialField, "gradient", lambda old: lambda *at: old(*at) / 2)),
    Mutant("E48", "the hills", put(potential_fields, "ROOM", lambda _: NOTHING)),
    Mutant("E48", "the way down", put(SteeredBehavior, "steer", uphill)),
    Mutant("E49", "the hills", put(potential_fields, "WEDGE", lambda _: NOTHING)),
    Mutant("E49", "the middle hill", put(potential_fields, "WEDGE", lambda wedge: wedge[1:])),
    *(
        Mutant("E50", without, patch)
        for without, patch in (
            ("waypoints", put(potential_fields, "waypoints", lambda _: lambda path: NOTHING)),
            ("waypoints go", put(potential_fields, "PASSING", lambda _: 1e-3)),
            ("the lock is noticed", put(LockDetector, "step", lambda _: lambda self, robot: None)),
        )
    ),
    *(
        Mutant("E51", without, patch)
        for without, patch in (
            ("turning on the spot", steering(turn_above=9.0)),
            ("it turns on the spot only beyond π/3", steering(turn_above=0.5)),
            ("it goes on within π/12", steering(turn_below=0.6)),
            ("the shorter way", put(SteeredBehavior, "steer", longer_way)),
        )
    ),
    Mutant("E52", "a deviation is relative", put(Scan, "errors", in_metres)),
    Mutant("E52", "the true pose", put(Scan, "expected", from_beside)),
    Mutant("E53", "the pose is wrong", put(scan_matching, "away", lambda _: lambda pose, chance, offset=0.0: pose)),
    Mutant("E53", "the scan", put(Scan, "errors", unheeded)),
    Mutant("E54", "200 tries", put(scan_matching, "search_pose", search_with(tries=10))),
    Mutant("E54", "the box goes with what is better", put(scan_matching, "search_pose", box_stays)),
    Mutant("E54", "the box is small", put(scan_matching, "search_pose", search_with(box=(0.5, 0.5, 0.5)))),
    Mutant("E54", "the scan", put(Scan, "errors", unheeded)),
    Mutant("E38", "that something blocks the way", put(Explore, "_blocked", lambda _: lambda self, robot: False)),
    Mutant("E39", "R15: it looks in four directions", put(Explore, "_look_around", lambda _: looking_ahead)),
    Mutant(
        "E40",
        "R14: what to do in a deadlock",
        put(exploring, "explorer", lambda old: lambda **_: old(second_pass=False)),
    ),
    Mutant("E52-avr", "that a beam is wide", put(scan_matching, "TurretScan", lambda old: lambda: old(beam=0.0))),
    Mutant("E55-avr", "the scan's correction", put(RandomSearch, "correct", lambda _: correcting_nothing)),
    Mutant("E55", "the scan's correction", put(RandomSearch, "correct", lambda _: correcting_nothing)),
]
