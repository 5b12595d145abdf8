"""What each message to the board costs, from its image alone: a poll of the link that takes a frame with it.

The image names its messages (rows FRAME of its table), and where a register holds the id of the one that is worked off
(`.boebot.ids`). With the id known there, only that message's ways are left, down to the function that carries it out
(constants.py). Of the loops that take and check a frame those over its bytes are known by their bounds: these are the
longest payload's bytes and up to FRAME_OVERHEAD more, as FRAME_OVERHEAD bytes of a frame are no payload; for a shorter
message they are so many less. A poll takes one frame at most, and before it an empty one: the pass for that has one
byte.

The bytes that a message makes the board send are those of the longest way, counted where messages are sent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from boebot.errors import TimingError
from boebot.link.frame import FRAME_OVERHEAD
from boebot.timing.constants import Context, Known, root
from boebot.timing.costs import DECODE, LINK_POLL, PIECES, TAKE, Given, entry_of, passed
from boebot.timing.paths import Way
from boebot.timing.program import Block, Function, IdPlace, Instruction, Program
from boebot.timing.wcet import Bound, WorstCase

SEND = "send_message"
LENGTH = 20  # register in which the payload's bytes are handed to SEND, its third argument (avr-gcc's convention)


@dataclass(frozen=True, slots=True)
class FrameCost:
    """Of one message; `bytes` on the wire, with both delimiters."""

    name: str
    id: int
    bytes: int
    poll: int  # cycles of the poll that takes it, at most
    answer: int  # bytes that it makes the board send, at most


def frame_costs(program: Program, progress: Callable[[float], None] = lambda _: None) -> tuple[FrameCost, ...]:
    """Of all messages that the image names, in its order; none where it does not say enough.

    Args:
        program: the image's.
        progress: called with the share of them that are done, 0 to 1.

    Raises:
        TimingError: a loop has no bound, or a message's answer no constant length.
    """
    rows = program.table.frames
    entries = [entry_of(program, name) for name in (LINK_POLL, TAKE, DECODE, SEND)]
    if not rows or None in entries or not program.ids or None in [_place(program, one) for one in program.ids]:
        return ()
    poll, take, decode, send = (entry for entry in entries if entry is not None)
    longest = max(row.length for row in rows)
    empty = _empty(program, take, decode)
    found = []
    for row in rows:
        own = _shorter(with_id(program, row.id), (take, decode), longest, row.length)
        taken = WorstCase(_once(own, take)).bound(take).cycles + empty
        found.append(
            FrameCost(
                name=row.name,
                id=row.id,
                bytes=row.length + FRAME_OVERHEAD,
                poll=Given(own, {take: taken}).bound(poll).cycles,
                answer=_Sent(own, send).bound(poll).cycles,
            )
        )
        progress(len(found) / len(rows))
    return tuple(found)


def with_id(program: Program, number: int) -> Program:
    """The program as a message with that id runs through it: loads of the id bring it."""
    functions = program.functions
    for place in program.ids:
        found = _place(program, place)
        if found is None:
            raise TimingError(f"{program.path}: ways join at {program.where(place.address)}, where an id is said to be")
        function, blocks = found
        changed = {start: _known_there(functions[function].blocks[start], place, number) for start in blocks}
        old = functions[function]
        functions = functions | {function: replace(old, blocks=old.blocks | changed)}
    return replace(program, functions=functions)


def _known_there(block: Block, place: IdPlace, number: int) -> Block:
    """The block with an instruction more, which takes no time: it brings the id."""
    at = _index(block, place.address)
    brings = Instruction(place.address, 0, "ldi", (place.register, number), 0)
    return replace(block, instructions=(*block.instructions[:at], brings, *block.instructions[at:]))


def _index(block: Block, address: int) -> int:
    return next(at for at, instruction in enumerate(block.instructions) if instruction.address == address)


def _place(program: Program, place: IdPlace) -> tuple[int, list[int]] | None:
    """The function and its blocks in which the instruction behind a load of the id is; None: it can be reached without
    that load, or not at all."""
    for entry, function in program.functions.items():
        blocks = [start for start, block in function.blocks.items() if _holds(block, place.address)]
        if blocks:
            return None if any(_joins(function, start, place.address) for start in blocks) else (entry, blocks)
    return None


def _holds(block: Block, address: int) -> bool:
    return any(instruction.address == address for instruction in block.instructions)


def _joins(function: Function, start: int, address: int) -> bool:
    """Whether the block begins there and not all ways to it come from the instruction before."""
    if _index(function.blocks[start], address) > 0:
        return False
    before = [block for block in function.blocks.values() if any(edge.to == start for edge in block.edges)]
    lasts = [block.instructions[-1] for block in before]
    return start == function.entry or any(last.address + last.size != address for last in lasts)


def _shorter(program: Program, entries: tuple[int, ...], longest: int, length: int) -> Program:
    """With the loops over a frame's bytes as a payload of that length has them run."""
    over = range(longest + 1, longest + FRAME_OVERHEAD + 1)
    own = _addresses(program, entries)
    bounds = [
        replace(one, passes=one.passes - longest + length)
        if one.address in own and one.passes is not None and one.passes in over
        else one
        for one in program.bounds
    ]
    return replace(program, bounds=tuple(bounds))


def _addresses(program: Program, entries: tuple[int, ...]) -> set[int]:
    """Of all instructions of these functions."""
    blocks = (block for entry in entries for block in program.functions[entry].blocks.values())
    return {instruction.address for block in blocks for instruction in block.instructions}


def _once(program: Program, take: int) -> Program:
    """With one piece taken in a poll."""
    own = _addresses(program, (take,))
    bounds = [
        replace(one, passes=1) if one.address in own and one.passes is not None and one.passes <= PIECES else one
        for one in program.bounds
    ]
    return replace(program, bounds=tuple(bounds))


def _empty(program: Program, take: int, decode: int) -> int:
    """What an empty piece before the frame takes more."""
    nothing = {decode: 0}
    one, two = (Given(passed(program, take, 1, above), nothing).bound(take).cycles for above in (0, PIECES))
    return two - one


class _Sent(WorstCase):
    """In place of cycles the bytes that are sent."""

    def __init__(self, program: Program, send: int) -> None:
        super().__init__(program)
        self._send = send

    def bound(self, entry: int, context: Context | None = None) -> Bound:
        """See `WorstCase`; bytes."""
        if entry != self._send:
            return super().bound(entry, context)
        length = dict(root(self.program.functions[entry]) if context is None else context).get(LENGTH)
        if length is None:
            raise TimingError(f"{self.program.path}: {SEND} is called with a length that is not a constant")
        return Bound(length + FRAME_OVERHEAD, (), {})

    def ways(self, block: Block, inside: Known) -> list[Way[int]]:
        """See `WorstCase`."""
        sent = max((self.callee(entry, block, inside).cycles for entry in block.calls), default=0)
        if not block.edges:
            return [Way(block.start, None, sent)]
        return [Way(block.start, to, sent) for to in dict.fromkeys(edge.to for edge in block.edges)]
