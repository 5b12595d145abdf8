"""Makes the graph of a function reducible: loops that compilers let be entered at two places get one entry.

What runs from the other entry until the loop's header is there a second time, so that only the header is entered (node
splitting; A. Aho et al., "Compilers: Principles, Techniques, and Tools", 2nd edition, section 9.7.6). The ways through
the function, and so its times, stay what they were. A copy of a block has the same instructions, and its address plus
a multiple of COPY as its name.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import partial

from boebot.timing.loops import IrreducibleError, natural_loops, reverse_postorder
from boebot.timing.program import COPY, Block, Edge

Blocks = dict[int, Block]
MOST = 4  # times as many blocks as there were; what needs more stays as it is, and is refused by whoever follows loops


def reducible(blocks: Blocks, entry: int) -> Blocks:
    """The same function without loops of several entries."""
    most = MOST * len(blocks)
    found = blocks
    while len(found) <= most:
        following = partial(successors, found)
        found = {start: found[start] for start in reverse_postorder(entry, following)}
        try:
            natural_loops(list(found), following)
        except IrreducibleError:
            found = _split(found, entry)
        else:
            return found if len(found) > len(blocks) else blocks
    return blocks


def successors(blocks: Blocks, start: int) -> list[int]:
    """Where the ways out of a block lead."""
    return [edge.to for edge in blocks[start].edges]


def _split(blocks: Blocks, entry: int) -> Blocks:
    """With one loop less that has several entries."""
    component, entries = next(_tangles(blocks, entry, set(blocks)))

    def copied(header: int) -> tuple[int, int]:
        ways = _without(blocks, component, entries - {header}, header)
        return sum(len(blocks[start].instructions) for start in ways), -header

    header = entry if entry in entries else min(entries, key=copied)
    return entered_only_at(header, blocks, component, entries)


def entered_only_at(header: int, blocks: Blocks, component: set[int], entries: set[int]) -> Blocks:
    """The same function with copies of what runs from the entries of a part of it until `header`, which all of its
    cycles pass."""
    names = {start: _name(blocks, start) for start in _without(blocks, component, entries - {header}, header)}
    result = {start: block if start in component else _led(block, names) for start, block in blocks.items()}
    return result | {names[start]: replace(_led(blocks[start], names), start=names[start]) for start in names}


def _led(block: Block, names: dict[int, int]) -> Block:
    """A block whose ways lead to copies, where there are some."""
    return replace(block, edges=tuple(Edge(names.get(edge.to, edge.to), edge.cycles) for edge in block.edges))


def _name(blocks: Blocks, start: int) -> int:
    name = start + COPY
    while name in blocks:
        name += COPY
    return name


def _tangles(blocks: Blocks, entry: int, nodes: set[int]) -> Iterator[tuple[set[int], set[int]]]:
    """The strongly connected parts with several entries, and those entries; the outermost first."""
    left = set(nodes)
    while left:
        start = min(left)
        ahead = reached(blocks, start, nodes)
        component = {node for node in ahead if start in reached(blocks, node, nodes)}
        left -= component | {start}
        if not component:
            continue
        entered = {to for node, block in blocks.items() if node not in component for to in successors(blocks, node)}
        entries = {node for node in component if node in entered or node == entry}
        if len(entries) > 1:
            yield component, entries
        else:
            yield from _tangles(blocks, entry, component - entries)


def reached(blocks: Blocks, start: int, nodes: Collection[int]) -> set[int]:
    """Of some blocks, those to which ways lead from there through no others."""
    seen: set[int] = set()
    work = [start]
    while work:
        for to in successors(blocks, work.pop()):
            if to in nodes and to not in seen:
                seen.add(to)
                work.append(to)
    return seen


def _without(blocks: Blocks, component: set[int], starts: set[int], header: int) -> set[int]:
    """Those that run from there until the header."""
    nodes = component - {header}
    return starts.union(*(reached(blocks, start, nodes) for start in starts))
