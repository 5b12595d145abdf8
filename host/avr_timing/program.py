"""The program of an image as a graph: the types that the rooms of this package share.

Addresses are byte addresses in flash. Cycles are those of the CPU's clock, after the AVR instruction set manual for
cores with a 16-bit program counter.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from boebot.errors import AnalysisError
from boebot.image.elf import LoopBound

REFUSED = "?"  # in place of an instruction at which a function could not be followed any further


@dataclass(frozen=True, slots=True)
class Instruction:
    """One machine instruction.

    `cycles` is what it takes when the program goes on behind it, `operands` the decoded numbers in the order of the
    manual's syntax (registers by number, constants, byte addresses of branches, I/O addresses).
    """

    address: int
    size: int  # bytes, 2 or 4
    mnemonic: str  # as objdump writes it: "ldi", "brne", "rcall", ...
    operands: tuple[int, ...]
    cycles: int


@dataclass(frozen=True, slots=True)
class Edge:
    """A way out of a block: `cycles` is what the block's last instruction takes on this way, without a callee."""

    to: int  # address of a block of the same function
    cycles: int


@dataclass(frozen=True, slots=True)
class Block:
    """Instructions that run one after another. A call ends a block; its only edge leads behind the call.

    A block without edges leaves the function: by return, or by a jump into another one (`callee` is it then, a tail
    call), or never (an endless loop has an edge to itself and so is none of these). `last_cycles` is what its last
    instruction takes then.
    """

    start: int
    instructions: tuple[Instruction, ...]
    edges: tuple[Edge, ...]
    callee: int | None = None  # entry of the function that its last instruction calls
    last_cycles: int = 0  # of the last instruction, where there are no edges

    @property
    def body_cycles(self) -> int:
        """Cycles of all instructions but the last."""
        return sum(instruction.cycles for instruction in self.instructions[:-1])


@dataclass(frozen=True, slots=True)
class Function:
    """A function: where it begins and its blocks by their addresses."""

    name: str
    entry: int
    blocks: dict[int, Block]
    clobbers: frozenset[int] | None = None  # registers that a call may change; None: all that a callee need not keep


@dataclass(frozen=True, slots=True)
class Program:
    """All functions of an image that can be reached, by entry, and what the image says of itself."""

    path: str
    functions: dict[int, Function]
    by_name: dict[str, int]  # entry of each named function
    bounds: tuple[LoopBound, ...] = ()
    lines: dict[int, str] = field(default_factory=dict)  # "file.c:123" of an instruction's address, where known
    unproven: dict[int, str] = field(default_factory=dict)  # why a function could not be followed, by its entry

    def entry(self, function: str | int) -> int:
        """Of a function by name, or by the entry itself. Raises AnalysisError where there is none of that name."""
        if isinstance(function, int):
            return function
        if function not in self.by_name:
            raise AnalysisError(f"{self.path} has no function {function}")
        return self.by_name[function]

    @contextmanager
    def entered(self, entry: int, under_way: list[int]) -> Iterator[None]:
        """While a function is worked out, with all that it calls; `under_way`: those above it. Raises AnalysisError
        where it is one of them."""
        if entry in under_way:
            around = [self.functions[each].name for each in under_way[under_way.index(entry) :]]
            chain = " calls ".join([*around, around[0] if around[1:] else "itself"])
            raise AnalysisError(
                f"recursion at {self.where(entry)}: {chain}; expected functions that do not call themselves"
            )
        under_way.append(entry)
        try:
            yield
        finally:
            under_way.pop()

    def below(self, entry: int) -> set[int]:
        """A function with all that it calls, and so on."""
        found, work = {entry}, [entry]
        while work:
            blocks = self.functions[work.pop()].blocks.values()
            new = {block.callee for block in blocks if block.callee is not None} - found
            found |= new
            work += new
        return found

    def instructions(self, entries: Iterable[int]) -> Iterator[Instruction]:
        """All instructions of functions."""
        for entry in entries:
            for block in self.functions[entry].blocks.values():
                yield from block.instructions

    def clobbered(self, block: Block) -> frozenset[int] | None:
        """Registers that what a block calls may change; None: all that a callee need not keep."""
        return None if block.callee is None else self.functions[block.callee].clobbers

    def where(self, address: int) -> str:
        """A place for people: `0x1A2C (safety.c:57)`, or `0x1A2C (in __divsf3)` where no line is known."""
        text = f"0x{address:04X}"
        if line := self.lines.get(address):
            return f"{text} ({line})"
        entry = max((entry for entry in self.functions if entry <= address), default=None)
        return text if entry is None else f"{text} (in {self.functions[entry].name})"
