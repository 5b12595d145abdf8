"""The program of an image as a graph, and the rows of the timing table that the image carries: the types that the
parts of this package share.

Addresses are byte addresses in flash. Cycles are those of the CPU's clock, after the AVR instruction set manual for
cores with a 16-bit program counter.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from boebot.errors import TimingError

COPY = 0x10000  # behind all addresses: what a copy of a block has above its own (split.py)


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

    A block without edges leaves the function: by return, or by a jump into another one (`calls` names it then, a tail
    call), or never (an endless loop has an edge to itself and so is none of these). `last_cycles` is what its last
    instruction takes then. A copy (split.py) has `start` above its first instruction's address.
    """

    start: int
    instructions: tuple[Instruction, ...]
    edges: tuple[Edge, ...]
    calls: tuple[int, ...] = ()  # entries of the functions that its last instruction may call; mostly one
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


@dataclass(frozen=True, slots=True)
class LoopBound:
    """What the source says of a loop: `address` lies in its body.

    At most `passes` of the body for each time that the loop is entered; and, for loops that wait for a time, at most
    `cycles` in all, to which one more pass may come. None: not said. `line` is that of the loop where the image tells
    all places at which it is entered (Program.entries), else 0; the instruction at `address` then runs once a pass.
    """

    address: int
    passes: int | None
    cycles: int | None
    line: int = 0


@dataclass(frozen=True, slots=True)
class TaskRow:
    """TASK of tasks.def: runs in each slot whose number mod `period` is `phase`; `budget` in cycles, net."""

    name: str
    period: int
    phase: int
    budget: int


@dataclass(frozen=True, slots=True)
class InterruptRow:
    """INTERRUPT of tasks.def: all numbers but `vector` in cycles.

    `budget` is its span from acceptance to the end of RETI, `latency` the longest from the request to acceptance,
    `interval` the least time between two requests in the long run.
    """

    name: str
    vector: int
    budget: int
    latency: int
    interval: int


@dataclass(frozen=True, slots=True)
class SensorRow:
    """SENSOR of tasks.def: a reading takes `conversion` us in hardware, comes every `period` ticks, and is at most
    `age` us old when telemetry takes it."""

    name: str
    conversion: int
    period: int
    age: int


@dataclass(frozen=True, slots=True)
class FrameRow:
    """A message that the program takes: its name, its id, and the bytes of its payload."""

    name: str
    id: int
    length: int


@dataclass(frozen=True, slots=True)
class IdPlace:
    """What the source says of a message's id: it is in `register` behind the instruction that ends at `address`."""

    address: int
    register: int


@dataclass(frozen=True, slots=True)
class Constants:
    """What the program is built with and its bounds depend on.

    A control tick is `slots_per_tick` slots of `slot_cycles` cycles; when more than `slots_kept` wait, ticks are
    dropped. Between slots the main loop is at the link when a frame has ended or `receive_due` bytes wait, and before
    that at the encoders when `changes_due` changes do, of `change_bytes` bytes each. Their interrupt stops itself when
    `changes_storm` in a row have come at most `changes_close` cycles after the one before; a line is stopped above
    `encoder_limit` edges in a tick, if the parameter of that name is as it is at first.
    """

    slot_cycles: int
    slots_per_tick: int
    slots_kept: int
    receive_due: int
    encoder_limit: int
    changes_due: int
    change_bytes: int
    changes_close: int
    changes_storm: int


@dataclass(frozen=True, slots=True)
class Table:
    """The timing table of an image, in its order."""

    tasks: tuple[TaskRow, ...] = ()
    interrupts: tuple[InterruptRow, ...] = ()
    sensors: tuple[SensorRow, ...] = ()
    frames: tuple[FrameRow, ...] = ()
    constants: Constants | None = None


@dataclass(frozen=True, slots=True)
class Program:
    """All functions of an image that can be reached, by entry, and what the image says of itself."""

    path: str
    functions: dict[int, Function]
    by_name: dict[str, int]  # entry of each named function
    bounds: tuple[LoopBound, ...] = ()
    entries: dict[int, int] = field(default_factory=dict)  # instructions that run when a loop is entered, and its line
    table: Table = field(default_factory=Table)
    lines: dict[int, str] = field(default_factory=dict)  # "file.c:123" of an instruction's address, where known
    ids: tuple[IdPlace, ...] = ()

    @property
    def constants(self) -> Constants:
        """What the image says of itself. Raises TimingError where it does not."""
        if self.table.constants is None:
            raise TimingError(f"{self.path} carries no constants; expected CONSTANT rows in its section .boebot.timing")
        return self.table.constants

    def where(self, address: int) -> str:
        """A place for people: `0x1A2C (safety.c:57)`, or `0x1A2C (in __divsf3)` where no line is known."""
        address %= COPY
        text = f"0x{address:04X}"
        if line := self.lines.get(address):
            return f"{text} ({line})"
        entry = max((entry for entry in self.functions if entry <= address), default=None)
        return text if entry is None else f"{text} (in {self.functions[entry].name})"
