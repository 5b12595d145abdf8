"""The nodes of an exploration by sensory area coverage (section 6.1 of the notes): where the robot has been, where it
will go, and how it gets there.

A node is pending, completed or unreachable. To each pending node leads a path of nodes from the active one, where the
robot is. Rules: R1 to R11 of docs/reference/navigation.md.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from boebot.errors import BrainError
from boebot.navigation.corridor import is_clear
from boebot.navigation.frames import Point
from boebot.navigation.scan_error import Scan
from boebot.navigation.search import search

TRIED = 8  # directions to each side of the middle of an interval

Status = Literal["pending", "completed", "unreachable"]
STATUSES: tuple[Status, ...] = ("pending", "completed", "unreachable")


@dataclass
class Node:
    """One place.

    Attributes:
        number: from 0, in the order in which they were placed.
        place: x, y (m).
        status: "pending", "completed" or "unreachable".
        path: numbers of nodes from the active one to this, both included; of what is not pending none.
    """

    number: int
    place: Point
    status: Status
    path: list[int] = field(default_factory=list)


class ExplorationGraph:
    """All nodes of an exploration.

    Attributes:
        nodes: by number.
        active: number of the node where the robot is.
        legs: pairs of numbers: from the first of them the second was placed.
    """

    def __init__(self, start: Point, least_distance: float, beside: float = 0.0) -> None:
        """R1: a node at the start, completed and active.

        Args:
            start: x, y (m).
            least_distance: d_min between nodes (m).
            beside: m up to which a way around may lead from node to node, though none was driven there.
        """
        self.nodes = [Node(0, start, "completed")]
        self.active = 0
        self._least, self._beside = least_distance, beside
        self.legs: set[frozenset[int]] = set()  # along which nodes were placed
        self._bad: set[frozenset[int]] = set()
        self._tried_again: set[frozenset[int]] = set()  # legs that were bad once

    def place(self, place: Point, share: float = 1.0) -> Node | None:
        """R5, R6: a new pending node there (m); None: it would be too near to another. To one that is unreachable it
        may be nearer: it may be reached from another side. `share`: of d_min that is enough."""
        for node in self.nodes:
            least = share * (self._least / 3 if node.status == "unreachable" else self._least)
            if math.dist(node.place, place) < least:
                return None
        node = Node(len(self.nodes), place, "pending", [self.active, len(self.nodes)])
        self.nodes.append(node)
        self.legs.add(frozenset(node.path))
        return node

    def length(self, path: Sequence[int]) -> float:
        """Of a path (m)."""
        places = [self.nodes[number].place for number in path]
        return sum(math.dist(one, other) for one, other in itertools.pairwise(places))

    @property
    def pending(self) -> list[Node]:
        """Those that are left."""
        return [node for node in self.nodes if node.status == "pending"]

    def target(self) -> Node | None:
        """R7: the pending node with the shortest path; of equals the one that was placed first; None: R13, all done."""
        return min(self.pending, key=lambda node: (self.length(node.path), node.number), default=None)

    def reached(self, number: int) -> None:
        """R9: the robot is at a node."""
        if self.nodes[number].status == "pending":
            self.nodes[number].status = "completed"
        self._activate(number)

    def blocked(self, number: int) -> None:
        """R11: the robot cannot come to a node; its paths begin there all the same, for it is on the leg before it."""
        self._activate(number)
        self.nodes[number].status = "unreachable"

    def came_back(self, number: int) -> None:
        """R14b: the robot is at a completed node again, though perhaps not at the one where it was last."""
        if number == self.active or frozenset((self.active, number)) in self.legs:
            self._activate(number)
            return
        self.active = number
        for node in self.pending:
            self._find_path(node)

    def neighbours(self, number: int) -> Iterator[tuple[int, float]]:
        """As of what `search` searches: completed nodes to which a straight way may lead, each with its length (m)."""
        for node in self.nodes:
            leg, length = frozenset((number, node.number)), self.distance(number, node.number)
            if node.status == "completed" and leg not in self._bad and (leg in self.legs or 0 < length <= self._beside):
                yield node.number, length

    def distance(self, number: int, other: int) -> float:
        """Straight from node to node (m)."""
        return math.dist(self.nodes[number].place, self.nodes[other].place)

    def bad_leg(self, number: int, other: int) -> None:
        """R14c: no way is there; paths that lead there go around over completed nodes, or become unreachable."""
        self._bad.add(frozenset((number, other)))
        for node in self.pending:
            if any({one, two} == {number, other} for one, two in itertools.pairwise(node.path)):
                self._find_path(node)

    def try_legs_again(self) -> bool:
        """R14f: bad legs count once more; whether there were any for which that is new."""
        again = self._bad - self._tried_again
        self._tried_again |= again
        self._bad -= again
        return bool(again)

    def way(self, number: int) -> list[int]:
        """From the active node to a completed one, over completed ones; empty: there is none."""
        return search(self, self.active, number, "dijkstra").path

    def retry(self, node: Node, last: int) -> None:
        """R14d: an unreachable node is pending again, to be reached from the completed node `last`."""
        node.status, node.path = "pending", [*self.way(last), node.number]
        self.legs.add(frozenset((last, node.number)))

    def set_out(self, node: Node) -> bool:
        """R14e: back to a completed node; whether a way leads there."""
        node.path = self.way(node.number)
        return bool(node.path)

    def nearest_completed(self, place: Point) -> list[Node]:
        """The completed nodes, the nearest to a place (m) first."""
        completed = [one for one in self.nodes if one.status == "completed"]
        return sorted(completed, key=lambda one: math.dist(one.place, place))

    def _find_path(self, node: Node) -> None:
        node.status = "completed"  # so that its last leg counts as well
        node.path = search(self, self.active, node.number, "dijkstra").path
        node.status = "pending" if len(node.path) > 1 else "unreachable"

    def _activate(self, number: int) -> None:
        """R10: all paths begin at that node from now on."""
        if number == self.active:
            return
        way = self.nodes[number].path or [self.active, number]
        for node in self.nodes:
            if node.path and node.number != number:
                node.path = joined(way, node.path)
        self.nodes[number].path = []
        self.active = number


def joined(way: Sequence[int], path: Sequence[int]) -> list[int]:
    """R10: the path from where `way` ends to where `path` ends; both begin at the same node. Back to where they part,
    and on from there."""
    common = 0
    while common < min(len(way), len(path)) and way[common] == path[common]:
        common += 1
    return [*reversed(way[common - 1 :]), *path[common:]]


@dataclass(frozen=True)
class Placement:
    """How nodes are placed about the robot."""

    distance: float = 1.0
    """D (m)"""
    margin: float = 0.3
    """Δ: free way behind a node (m)"""
    least_angle: float = 0.35
    """γ_min: of an interval of free directions (rad)"""
    least_distance: float = 0.75
    """d_min: between nodes (m)"""

    def __post_init__(self) -> None:
        lengths = self.distance, self.least_angle, self.least_distance
        if not all(0 < one < math.inf for one in lengths) or not 0 <= self.margin < math.inf:
            raise BrainError(f"{self}: expected finite numbers above 0, and a margin of 0 or more")

    @classmethod
    def of(cls, radius: float) -> Placement:
        """For rooms that are not large, by the robot's radius (m)."""
        distance = max(0.4, 4 * radius)
        return cls(distance, radius + 0.05, cls.least_angle, 0.7 * distance)

    def closer(self, share: float) -> Placement:
        """The same with nodes at that share of the distances."""
        return replace(self, distance=share * self.distance, least_distance=share * self.least_distance)

    def bearings(self, scan: Scan, half_width: float = 0.0) -> list[float]:
        """R2 to R4: directions of new nodes, from the robot's heading (rad): in each interval of free directions, one
        node in its middle, or several beside each other in a wide one.

        Args:
            half_width: of the corridor to a node (m). Where something is in it, the node lies in the direction next to
                the middle in which the corridor is free; nowhere, if there is none.
        """
        each = 2.0 * math.asin(min(1.0, self.least_distance / (2.0 * self.distance)))  # γ_s
        found = []
        for begin, end in self.intervals(scan):
            if end - begin > self.least_angle:
                count = max(1, math.floor((end - begin) / each))
                part = (end - begin) / count
                middles = [begin + (k + 0.5) * part for k in range(count)]
                found += [self._clear(scan, middle, part / 2, half_width) for middle in middles]
        return [bearing for bearing in found if bearing is not None]

    def _clear(self, scan: Scan, middle: float, most: float, half_width: float) -> float | None:
        """The direction next to the middle, at most that far from it (rad), in which the corridor is free."""
        aside = sorted(np.arange(-TRIED, TRIED + 1) / TRIED * most, key=abs)
        length = self.distance + half_width
        return next((middle + by for by in aside if is_clear(scan, middle + by, length, half_width)), None)

    def intervals(self, scan: Scan) -> list[tuple[float, float]]:
        """R2: directions in which nothing is nearer than D + Δ: first and last of each interval (rad)."""
        count = len(scan.distances)
        step = (scan.bearings[1] - scan.bearings[0]) / (count - 1)
        free = [not 0.0 <= distance <= self.distance + self.margin for distance in scan.distances.tolist()]
        found, begun = [], -1
        for ray in range(count + 1):
            is_free = ray < count and free[ray]
            if is_free and begun < 0:
                begun = ray
            elif not is_free and begun >= 0:
                found.append((scan.bearings[0] + begun * step, scan.bearings[0] + (ray - 1) * step))
                begun = -1
        return found
