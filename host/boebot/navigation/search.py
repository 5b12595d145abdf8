"""Search for a path from node to node: greedy best-first, Dijkstra's and A*, through one interface (section 6.2 of the
notes, Figs. 6.7 and 6.9).

All of them keep a frontier of nodes that have been seen and not yet expanded, and expand the one that promises most:

    greedy     least f(n), the straight way from n to the target
    dijkstra   least g(n), the way from the start to n
    astar      least g(n) + f(n)

Dijkstra's path is the shortest one. So is A*'s, as f never promises too much; it expands fewer nodes.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeVar

from boebot.errors import BrainError

N = TypeVar("N", bound=Hashable)
Method = Literal["walk", "greedy", "dijkstra", "astar"]
METHODS: tuple[Method, ...] = ("walk", "greedy", "dijkstra", "astar")


class Graph(Protocol[N]):
    """What can be searched: a `Lattice`, or anything else whose nodes have neighbours."""

    def neighbours(self, node: N) -> Iterable[tuple[N, float]]:
        """The nodes next to one, each with the way there (m)."""

    def distance(self, node: N, other: N) -> float:
        """Straight from one to another (m); no way between them is shorter."""


@dataclass(frozen=True)
class Found(Generic[N]):
    """What a search came to.

    Attributes:
        path: the nodes from start to target; empty: there is none.
        cost: its length (m); infinite: there is none.
        expanded: the nodes whose neighbours were looked at, in that order.
    """

    path: list[N]
    cost: float
    expanded: list[N]


def search(graph: Graph[N], start: N, target: N, method: Method = "astar") -> Found[N]:
    """A path from start to target.

    Args:
        method: "astar", "dijkstra", "greedy", or "walk": greedy as the notes have it, a walk that goes back
            where it can go no further.

    Raises:
        BrainError: there is no such method.
    """
    if method not in METHODS:
        raise BrainError(f"there is no search {method!r}; expected one of {', '.join(METHODS)}")
    return _walk(graph, start, target) if method == "walk" else _best_first(graph, start, target, method)


def _best_first(graph: Graph[N], start: N, target: N, method: Method) -> Found[N]:
    way_counts, rest_counts = method != "greedy", method != "dijkstra"
    number = itertools.count()  # of equals, the one that was seen first
    way: dict[N, float] = {start: 0.0}  # g: the shortest known, from the start
    before: dict[N, N] = {}
    done: set[N] = set()
    expanded: list[N] = []
    frontier: list[tuple[float, int, N]] = [(0.0, next(number), start)]
    while frontier:
        _, _, node = heapq.heappop(frontier)
        if node in done:
            continue
        if node == target:
            return Found(_followed(before, target), way[target], expanded)
        done.add(node)
        expanded.append(node)
        so_far = way[node]
        for other, step in graph.neighbours(node):
            if other in done:
                continue
            length = so_far + step
            if other not in way or (way_counts and length < way[other]):
                way[other] = length
                before[other] = node
                promise = (length if way_counts else 0.0) + (graph.distance(other, target) if rest_counts else 0.0)
                heapq.heappush(frontier, (promise, next(number), other))
    return Found([], math.inf, expanded)


def _walk(graph: Graph[N], start: N, target: N) -> Found[N]:
    """From each node on to the neighbour nearest to the target that was not visited; back where there is none."""
    path, visited, expanded = [start], {start}, [start]
    ways = [0.0]
    while path and path[-1] != target:
        left = [(other, step) for other, step in graph.neighbours(path[-1]) if other not in visited]
        if left:
            node, step = min(left, key=lambda one: graph.distance(one[0], target))
            visited.add(node)
            expanded.append(node)
            path.append(node)
            ways.append(step)
        else:
            path.pop()
            ways.pop()
    return Found(path, sum(ways) if path else math.inf, expanded)


def _followed(before: dict[N, N], target: N) -> list[N]:
    path = [target]
    while path[-1] in before:
        path.append(before[path[-1]])
    return path[::-1]
