"""The longest walk through a graph whose loops are bounded, exactly.

Loops are worked out from the innermost. Of a loop only the longest pass from its header back to it counts, and the
longest way from the header out of each of its exits; around it, it is one node whose ways out are those exits. A bound
says how often a marked node runs per entry of the loop. With n such runs, and every pass marked, a walk leaves
- through an exit that it reaches without the mark (the test of `while`) after n passes,
- through one that it reaches over the mark (`break`, the test of `do ... while`) after n - 1.
Where one pass has copies of the mark, m of them on every way, the passes are n / m and (n - 1) / m.
The sum is the optimum of the integer program of Y. Li, S. Malik, "Performance Analysis of Embedded Software Using
Implicit Path Enumeration" (1995) with the same bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Generic

from avr_timing.flow.loops import Loop, N, natural_loops, reverse_postorder
from boebot.errors import AnalysisError


@dataclass(frozen=True, slots=True)
class Way(Generic[N]):
    """One way through a node: all that runs in it and on the edge to the next one."""

    node: N
    to: N | None  # None: out of the graph
    cycles: int  # with what is called at its end
    waits: bool = False  # stands for the time that a loop waits, and runs nothing by itself


@dataclass(frozen=True, slots=True)
class Repeat(Generic[N]):
    """A piece of a walk, repeated."""

    walk: Walk[N]
    times: int


@dataclass(frozen=True, slots=True)
class Walk(Generic[N]):
    """A walk, by its last part and what was before."""

    cycles: int = 0
    before: Walk[N] | None = None
    last: Way[N] | Repeat[N] | None = None

    def then(self, way: Way[N]) -> Walk[N]:
        """One way more."""
        return Walk(self.cycles + way.cycles, self, way)

    def repeat(self, walk: Walk[N], times: int) -> Walk[N]:
        """Another walk behind this one, repeated."""
        return Walk(self.cycles + times * walk.cycles, self, Repeat(walk, times)) if times else self

    def ways(self, times: int = 1) -> Iterator[tuple[Way[N], int]]:
        """All ways in their order, each with how often it is gone; those of a loop stand together."""
        parts: list[Way[N] | Repeat[N]] = []
        walk: Walk[N] | None = self
        while walk is not None and walk.last is not None:
            parts.append(walk.last)
            walk = walk.before
        for part in reversed(parts):
            if isinstance(part, Repeat):
                yield from part.walk.ways(times * part.times)
            else:
                yield part, times


@dataclass(frozen=True, slots=True)
class Mark:
    """A bound of the loop around a node: the node runs at most `passes` times per entry of the loop, or the loop takes
    at most `cycles`, to which a pass more may come. Copies of one loop of the source have the same `loop`."""

    loop: Hashable
    passes: int | None
    cycles: int | None


@dataclass(frozen=True, slots=True)
class Graph(Generic[N]):
    """Ways by the node that they lead out of, marks of nodes, and how a node is called in messages."""

    entry: N
    ways: dict[N, list[Way[N]]]
    where: Callable[[N], str]
    marks: dict[N, list[Mark]] = field(default_factory=dict)

    def successors(self, node: N) -> list[N]:
        """Where its ways lead."""
        return [way.to for way in self.ways[node] if way.to is not None]


def longest(graph: Graph[N]) -> Walk[N] | None:
    """The longest walk from the entry out of the graph; None if none leads out.

    Raises:
        AnalysisError: a loop has no bound or one that does not hold all of its passes, or two entries.
    """
    order = reverse_postorder(graph.entry, graph.successors)
    loops = natural_loops(order, graph.successors, graph.where)
    ends = _Search(graph, order).region(graph.entry, order, loops, frozenset()).out
    return max((walk for walks in ends.values() for walk in walks if walk), key=lambda walk: walk.cycles, default=None)


# The longest walk that has not met the mark, and the longest that has.
_Pair = tuple["Walk[N] | None", "Walk[N] | None"]


@dataclass(slots=True)
class _Region(Generic[N]):
    """Longest walks from a loop's header: back to it, and through each way that leaves the loop."""

    back: _Pair[N]
    out: dict[Way[N], _Pair[N]]


class _Search(Generic[N]):
    def __init__(self, graph: Graph[N], order: list[N]) -> None:
        self.graph = graph
        self.order = order
        self.exits: dict[Loop[N], dict[Way[N], Walk[N]]] = {}  # of loops that are done

    def region(self, start: N, nodes: list[N], loops: list[Loop[N]], marked: frozenset[N]) -> _Region[N]:
        """Longest walks through `nodes`, given in reverse postorder, with `loops` as single nodes."""
        by_header = {loop.header: loop for loop in loops}
        inside = frozenset(node for loop in loops for node in loop.nodes)
        members = frozenset(nodes)
        best: dict[N, _Pair[N]] = {start: (Walk(), None)}
        found: _Region[N] = _Region((None, None), {})
        for node in nodes:
            if node not in best or (node in inside and node not in by_header):
                continue
            for way, pair in self._steps(node, best[node], by_header.get(node), node in marked):
                if way.to is None or way.to not in members:
                    found.out[way] = _longer(found.out.get(way, (None, None)), pair)
                elif way.to == start:
                    found.back = _longer(found.back, pair)
                else:
                    best[way.to] = _longer(best.get(way.to, (None, None)), pair)
        return found

    def _steps(self, node: N, pair: _Pair[N], loop: Loop[N] | None, marked: bool) -> Iterator[tuple[Way[N], _Pair[N]]]:
        free, over = pair
        if loop is not None:
            for way, walk in self.loop(loop).items():
                yield way, (free and free.repeat(walk, 1), over and over.repeat(walk, 1))
            return
        for way in self.graph.ways[node]:
            if marked:
                longer = _max(free, over)
                yield way, (None, longer and longer.then(way))
            else:
                yield way, (free and free.then(way), over and over.then(way))

    def loop(self, loop: Loop[N]) -> dict[Way[N], Walk[N]]:
        """The longest walk from the entry of a loop through each of its exits."""
        if loop not in self.exits:
            self.exits[loop] = self._loop(loop)
        return self.exits[loop]

    def _loop(self, loop: Loop[N]) -> dict[Way[N], Walk[N]]:
        deeper = frozenset(node for inner in loop.inner for node in inner.nodes)
        marks: dict[Hashable, Mark] = {}
        marked: dict[Hashable, dict[N, int]] = {}  # nodes, and how many marks each has
        for node in sorted(loop.nodes - deeper, key=self.order.index):
            for mark in self.graph.marks.get(node, ()):
                known = marks.get(mark.loop, mark)
                passes = None if known.passes is None or mark.passes is None else max(known.passes, mark.passes)
                cycles = None if known.cycles is None or mark.cycles is None else max(known.cycles, mark.cycles)
                marks[mark.loop] = Mark(mark.loop, passes, cycles)
                counts = marked.setdefault(mark.loop, {})
                counts[node] = counts.get(node, 0) + 1
        nodes = [node for node in self.order if node in loop.nodes]
        where = self.graph.where(loop.header)
        if not marks:
            raise AnalysisError(f"the loop at {where} has no bound; expected one beside it in the source")
        regions = {name: self.region(loop.header, nodes, list(loop.inner), frozenset(marked[name])) for name in marks}
        whole = {name for name in marks if marks[name].cycles is not None or regions[name].back[0] is None}
        if len(marks) > 1 and (len(loop.latches) > 1 or not whole):
            # Loops of the source that share a header: at most n runs of the one before each of the m of the other, and
            # behind the last, the inner and the outer one alike.
            runs = 1
            for mark in marks.values():
                if mark.passes is None:
                    raise AnalysisError(
                        f"loops that share their header at {where}, one of them bounded by time, are "
                        "refused; expected one bound in passes for each"
                    )
                runs *= mark.passes + 1
            every = frozenset(node for nodes in marked.values() for node in nodes)
            return _out(self.region(loop.header, nodes, list(loop.inner), every), Mark(None, runs - 1, None), where, 1)
        # One loop of the source, or others within it that have no edge back any more (unrolled): which of them it
        # is cannot be seen, so each may be.
        result: dict[Way[N], Walk[N]] = {}
        for name in whole if whole else marks:
            least = self._least(loop, nodes, marked[name])
            for way, walk in _out(regions[name], marks[name], where, least).items():
                if way not in result or walk.cycles > result[way].cycles:
                    result[way] = walk
        return result

    def _least(self, loop: Loop[N], nodes: list[N], marked: Mapping[N, int]) -> int:
        """The fewest marks in one pass of a loop, all copies together; at least 1."""
        by_header = {inner.header: inner for inner in loop.inner}
        fewest = {loop.header: 0}
        passes = []
        for node in nodes:
            if node not in fewest:
                continue
            count = fewest[node] + marked.get(node, 0)
            for way in self.loop(by_header[node]) if node in by_header else self.graph.ways[node]:
                if way.to == loop.header:
                    passes.append(count)
                elif way.to in loop.nodes:
                    fewest[way.to] = min(count, fewest.get(way.to, count))
        return max(1, min(passes, default=1))


def _out(region: _Region[N], mark: Mark, where: str, least: int) -> dict[Way[N], Walk[N]]:
    """The longest walk through each exit of a loop under one bound, with at least `marks` marks in each pass."""
    free_pass, full = region.back
    result: dict[Way[N], Walk[N]] = {}
    if mark.cycles is not None and (mark.passes is None or free_pass is not None):
        once = _max(free_pass, full)
        for way, pair in region.out.items():
            last = _max(*pair)
            if last is not None:
                waiting: Walk[N] = Walk()
                waited = waiting.then(Way(way.node, way.node, mark.cycles, waits=True))
                result[way] = (waited.repeat(once, 1) if once else waited).repeat(last, 1)
        return result
    if free_pass is not None:
        raise AnalysisError(
            f"the loop at {where} can be passed without the place that its bound counts; expected a bound at the "
            "beginning of its body"
        )
    passes = mark.passes or 0
    for way, (free, over) in region.out.items():
        ends = [(free, passes // least), (over, (passes - 1) // least)]
        for last, count in ends:
            if last is not None and count >= 0:
                begin: Walk[N] = Walk()
                walk = (begin.repeat(full, count) if full else begin).repeat(last, 1)
                result[way] = _max(result.get(way), walk) or walk
    return result


def _max(one: Walk[N] | None, other: Walk[N] | None) -> Walk[N] | None:
    if one is None or other is None:
        return one if other is None else other
    return one if one.cycles >= other.cycles else other


def _longer(one: _Pair[N], other: _Pair[N]) -> _Pair[N]:
    return _max(one[0], other[0]), _max(one[1], other[1])
