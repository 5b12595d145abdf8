"""Dominators, natural loops and their nesting, of any graph; what the image says of how often a loop is passed.

A. Aho et al., "Compilers: Principles, Techniques, and Tools", 2nd edition, section 9.6; dominators after K. Cooper,
T. Harvey, K. Kennedy, "A Simple, Fast Dominance Algorithm" (2001). Only reducible graphs have natural loops for all of
their cycles; compilers make no others from structured code, and what else comes is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from avr_timing.program import Function
from boebot.errors import AnalysisError

N = TypeVar("N", bound=Hashable)


@dataclass(eq=False, slots=True)
class Loop(Generic[N]):
    """All nodes from which a way leads back to `header` without passing it; `inner` are the loops directly within."""

    header: N
    nodes: frozenset[N]
    latches: tuple[N, ...]  # sources of the edges back to the header
    inner: tuple[Loop[N], ...] = ()


class IrreducibleError(AnalysisError):
    """A cycle can be entered at two places."""


def reverse_postorder(entry: N, successors: Callable[[N], Iterable[N]]) -> list[N]:
    """All nodes that can be reached, each before its successors but for edges back."""
    order: list[N] = []
    seen = {entry}
    stack = [(entry, iter(successors(entry)))]
    while stack:
        node, rest = stack[-1]
        for following in rest:
            if following not in seen:
                seen.add(following)
                stack.append((following, iter(successors(following))))
                break
        else:
            order.append(node)
            stack.pop()
    order.reverse()
    return order


def predecessors(order: Iterable[N], successors: Callable[[N], Iterable[N]]) -> dict[N, list[N]]:
    """Of each node, those that lead to it, each once."""
    result: dict[N, list[N]] = {node: [] for node in order}
    for node in result:
        for following in dict.fromkeys(successors(node)):
            result[following].append(node)
    return result


def dominators(order: list[N], before: Mapping[N, list[N]]) -> dict[N, N]:
    """The immediate dominator of each node, of the first node itself, from reverse postorder and predecessors."""
    number = {node: i for i, node in enumerate(order)}
    above: dict[N, N] = {order[0]: order[0]}

    def common(one: N, other: N) -> N:
        while one != other:
            while number[one] > number[other]:
                one = above[one]
            while number[other] > number[one]:
                other = above[other]
        return one

    changed = True
    while changed:
        changed = False
        for node in order[1:]:
            known = [previous for previous in before[node] if previous in above]
            found = known[0]
            for previous in known[1:]:
                found = common(found, previous)
            if above.get(node) != found:
                above[node] = found
                changed = True
    return above


def natural_loops(order: list[N], successors: Callable[[N], Iterable[N]], where: Callable[[N], str]) -> list[Loop[N]]:
    """The outermost loops of a graph given in reverse postorder; `where`: what a node is called in messages.

    Raises:
        IrreducibleError: a cycle has two entries.
    """
    before = predecessors(order, successors)
    above = dominators(order, before)
    number = {node: i for i, node in enumerate(order)}
    latches: dict[N, list[N]] = {}
    for node in order:
        for following in dict.fromkeys(successors(node)):
            if number[following] <= number[node]:
                if not _dominates(following, node, above):
                    raise IrreducibleError(
                        f"the loop at {where(following)} can be entered at two places; expected loops with one entry, "
                        "as structured code has"
                    )
                latches.setdefault(following, []).append(node)
    loops = [Loop(header, _body(header, ends, before), tuple(ends)) for header, ends in latches.items()]
    return _nest(loops)


def loops_of(function: Function) -> list[Loop[int]]:
    """The outermost loops of a function.

    Raises:
        IrreducibleError: a cycle has two entries.
    """

    def successors(start: int) -> list[int]:
        return [edge.to for edge in function.blocks[start].edges]

    return natural_loops(reverse_postorder(function.entry, successors), successors, "0x{:04X}".format)


def with_parents(function: Function) -> list[tuple[Loop[int], Loop[int] | None]]:
    """All loops, each with the one around it, inner ones before those around them; none where a cycle has two entries:
    the search for the longest walk refuses it."""
    try:
        found: list[tuple[Loop[int], Loop[int] | None]] = [(loop, None) for loop in loops_of(function)]
    except IrreducibleError:
        return []
    for loop, _ in found:  # grows meanwhile
        found += [(inner, loop) for inner in loop.inner]
    return found[::-1]


def _dominates(one: N, other: N, above: Mapping[N, N]) -> bool:
    while other != one:
        if above[other] == other:
            return False
        other = above[other]
    return True


def _body(header: N, latches: list[N], before: Mapping[N, list[N]]) -> frozenset[N]:
    body = {header}
    work = list(latches)
    while work:
        node = work.pop()
        if node not in body:
            body.add(node)
            work += before[node]
    return frozenset(body)


def _nest(loops: list[Loop[N]]) -> list[Loop[N]]:
    """Natural loops with different headers are apart or one within the other."""
    outermost: list[Loop[N]] = []
    by_size = sorted(loops, key=lambda loop: len(loop.nodes))
    for i, loop in enumerate(by_size):
        around = next((other for other in by_size[i + 1 :] if loop.header in other.nodes), None)
        if around is None:
            outermost.append(loop)
        else:
            around.inner = (*around.inner, loop)
    return outermost
