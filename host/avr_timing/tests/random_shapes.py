"""Random structured programs as graphs, for tests: what a compiler makes of sequence, choice and loops with exits."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

from avr_timing.flow.paths import Graph, Mark, Way

END = -1


@dataclass
class Shape:
    """A graph under construction: ways as (from, to, cycles), and its loops, known by construction."""

    chance: random.Random
    ways: list[tuple[int, int, int]] = field(default_factory=list)
    loops: list[tuple[int, int, int, list[int]]] = field(default_factory=list)  # header, marked node, passes, nodes
    nodes: int = 0

    def node(self, inside: list[int]) -> int:
        """A new node in all of these loops."""
        self.nodes += 1
        for loop in inside:
            self.loops[loop][3].append(self.nodes - 1)
        return self.nodes - 1

    def way(self, source: int, target: int) -> None:
        """A new way with its own cycles."""
        self.ways.append((source, target, self.chance.randint(1, 30)))

    def graph(self) -> Graph[int]:
        """As the analysis takes it; node 0 is the entry."""
        ways: dict[int, list[Way[int]]] = {node: [] for node in range(self.nodes)}
        for source, target, cycles in self.ways:
            ways[source].append(Way(source, None if target == END else target, cycles))
        marks = {mark: [Mark(header, passes, None)] for header, mark, passes, _ in self.loops}
        return Graph(0, ways, str, marks)


def random_shape(seed: int, depth: int = 3) -> Shape:
    """A program with up to `depth` loops in each other."""
    shape = Shape(random.Random(seed))
    entry = shape.node([])
    last = _statements(shape, entry, [], [], depth)
    shape.way(last, END)
    return shape


def _statements(shape: Shape, at: int, inside: list[int], leave: list[int], depth: int) -> int:
    """Statements behind node `at`; the node behind them. `leave`: where `break` of each loop around goes."""
    for _ in range(shape.chance.randint(1, 3)):
        kind = shape.chance.choice(("plain", "if", "while", "do", "leave") if depth else ("plain", "if", "leave"))
        after = shape.node(inside)
        if kind == "plain":
            shape.way(at, after)
        elif kind == "if":
            shape.way(at, after)
            there = shape.node(inside)
            shape.way(at, there)
            end = _statements(shape, there, inside, leave, depth - 1) if depth else there
            shape.way(end, after)
        elif kind == "leave":
            shape.way(at, after)
            shape.way(at, shape.chance.choice([*leave, END]))
        else:
            _loop(shape, at, after, inside, leave, depth, tested_first=kind == "while")
        at = after
    return at


def _loop(
    shape: Shape, at: int, after: int, inside: list[int], leave: list[int], depth: int, tested_first: bool
) -> None:
    shape.loops.append((shape.nodes, shape.nodes + tested_first, shape.chance.randint(1, 5), []))
    within = [*inside, len(shape.loops) - 1]
    header = shape.node(within)
    shape.way(at, header)
    body = header
    if tested_first:
        body = shape.node(within)
        shape.way(header, body)
        shape.way(header, after)
    end = _statements(shape, body, within, [*leave, after], depth - 1)
    shape.way(end, header)
    if not tested_first:
        shape.way(end, after)
