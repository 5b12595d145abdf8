"""Worst-case depth of the stack: of a function with all that it calls, and of a whole image with its interrupts.

The stack pointer is followed through every instruction: `push`, `pop`, calls (2 bytes: the program counter), `rcall
.+0` (2 bytes of room) and frames, whose code reads SP into a pair of registers, subtracts a constant and writes it
back; also where libgcc does so for many functions (`__prologue_saves__`). All ways to a place must have the same depth
there. A depth that depends on data (alloca, arrays of variable length) is refused.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from avr_timing.errors import AnalysisError
from avr_timing.image.registers import ZERO, pushes_only, written
from avr_timing.program import Block, Function, Instruction, Program

ADDRESS = 2  # bytes that a call or an interrupt puts on the stack
SPL, SPH = 0x3D, 0x3E  # I/O addresses
VECTORS = range(1, 26)  # as in __vector_N; each at byte address 4 N


@dataclass(frozen=True, slots=True)
class Depth:
    """Bytes below the return address, and the chain of calls that needs them."""

    bytes: int
    chain: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ImageDepth:
    """Of a whole image: `main` with its own return address, and interrupts, outermost first, each with its."""

    main: Depth
    interrupts: tuple[Depth, ...]

    @property
    def bytes(self) -> int:
        """Of all."""
        return ADDRESS + self.main.bytes + sum(ADDRESS + each.bytes for each in self.interrupts)


@dataclass(frozen=True, slots=True)
class _Byte:
    """What a register holds: a constant (`depth` None), or the low or high byte of the stack pointer as it is when
    `depth` bytes are in use; `part` was subtracted from the low one, and the borrow is still to be."""

    number: int = 0
    depth: int | None = None
    high: bool = False
    part: int | None = None


@dataclass(frozen=True, slots=True)
class _State:
    depth: int
    registers: dict[int, _Byte]
    high: int | None = None  # SPH is written for this depth, SPL not yet

    def merge(self, other: _State) -> _State:
        """What holds on both ways; depths are the same."""
        both = {r: byte for r, byte in self.registers.items() if other.registers.get(r) == byte}
        return _State(self.depth, both, self.high)


class Stack:
    """Depths of the functions of a program, each worked out once."""

    def __init__(self, program: Program, left_out: Collection[int] = ()) -> None:
        """`left_out`: entries of functions that count as if they needed nothing but their return address."""
        self.program = program
        self._depths = {entry: Depth(0, (program.functions[entry].name,)) for entry in left_out}
        self._under_way: list[int] = []

    def of(self, function: str | int) -> Depth:
        """The worst-case depth of a function, by name or entry, without its own return address.

        Raises:
            AnalysisError: no such function; recursion; a depth that is not the same on all ways or depends on data.
        """
        if isinstance(function, str):
            if function not in self.program.by_name:
                raise AnalysisError(f"{self.program.path} has no function {function}")
            function = self.program.by_name[function]
        if function not in self._depths:
            if function in self.program.unproven:
                raise AnalysisError(self.program.unproven[function])
            name = self.program.functions[function].name
            if function in self._under_way:
                raise AnalysisError(
                    f"recursion at {self.program.where(function)}: {name} calls itself; expected functions that do not"
                )
            self._under_way.append(function)
            try:
                self._depths[function] = self._depth(self.program.functions[function])
            finally:
                self._under_way.pop()
        return self._depths[function]

    def image(self) -> ImageDepth:
        """Of the whole image: `main`, and the worst nesting of interrupts on top of it.

        An interrupt that switches interrupts on again is taken to keep itself off meanwhile: each such one is there at
        most once, and on top of them one that does not.
        """
        vectors = [4 * number for number in VECTORS if 4 * number in self.program.functions]
        nesting = [self.of(vector) for vector in vectors if self._switches_on(vector)]
        others = [self.of(vector) for vector in vectors if not self._switches_on(vector)]
        nesting.sort(key=lambda depth: -depth.bytes)
        top = max(others, key=lambda depth: depth.bytes, default=None)
        return ImageDepth(self.of("main"), (*nesting, *((top,) if top else ())))

    def _switches_on(self, entry: int) -> bool:
        seen: set[int] = set()
        work = [entry]
        while work:
            function = self.program.functions[work.pop()]
            if function.entry not in seen:
                seen.add(function.entry)
                for block in function.blocks.values():
                    if any(instruction.mnemonic == "sei" for instruction in block.instructions):
                        return True
                    work += block.calls
        return False

    def _depth(self, function: Function) -> Depth:
        begin = _State(0, {ZERO: _Byte(0)})
        states = {function.entry: begin}
        work = [function.entry]
        deepest = Depth(0, (function.name,))
        while work:
            block = function.blocks[work.pop()]
            state, found = self._run(block, states[block.start], function)
            if found.bytes > deepest.bytes:
                deepest = found
            for edge in block.edges:
                known = states.get(edge.to)
                if known is not None and (known.depth, known.high) != (state.depth, state.high):
                    raise AnalysisError(
                        f"{function.name} reaches {self.program.where(edge.to)} with {known.depth} and with "
                        f"{state.depth} bytes on the stack; expected one depth at each place"
                    )
                merged = state if known is None else known.merge(state)
                if known is None or merged != known:
                    states[edge.to] = merged
                    work.append(edge.to)
        return deepest

    def _run(self, block: Block, state: _State, function: Function) -> tuple[_State, Depth]:
        """The state at the end of a block, and the greatest depth within it."""
        deepest = Depth(state.depth, (function.name,))
        for instruction in block.instructions:
            state = self._step(instruction, state)
            if state.depth > deepest.bytes:
                deepest = Depth(state.depth, (function.name,))
        last = block.instructions[-1]
        own = ADDRESS if last.mnemonic in ("call", "rcall", "icall") else 0
        for callee in block.calls:
            called = self.of(callee)
            if state.depth + own + called.bytes > deepest.bytes:
                deepest = Depth(state.depth + own + called.bytes, (function.name, *called.chain))
        if last.mnemonic in ("ret", "reti") and state.depth != 0:
            raise AnalysisError(
                f"{function.name} returns at {self.program.where(last.address)} with {state.depth} bytes on the stack; "
                "expected none"
            )
        return state, deepest

    def _step(self, instruction: Instruction, state: _State) -> _State:
        name, operands = instruction.mnemonic, instruction.operands
        depth, high = state.depth, state.high
        if name == "push":
            depth += 1
        elif name == "pop":
            depth -= 1
        elif pushes_only(instruction):
            depth += ADDRESS
        elif name == "out" and operands[0] in (SPL, SPH):
            depth, high = self._written(instruction, state)
        if depth < 0:
            raise AnalysisError(f"more is popped than was pushed at {self.program.where(instruction.address)}")
        return _State(depth, _registers(instruction, state), high)

    def _written(self, instruction: Instruction, state: _State) -> tuple[int, int | None]:
        """Depth, and SPH's where SPL is still to come, behind a write to one of the two."""
        byte = state.registers.get(instruction.operands[1])
        is_high = instruction.operands[0] == SPH
        fits = byte is not None and byte.depth is not None and byte.part is None and byte.high == is_high
        if fits and byte is not None and byte.depth is not None:
            if is_high:
                return state.depth, byte.depth
            if state.high in (None, byte.depth):
                return byte.depth, None
        raise AnalysisError(
            f"the stack pointer gets a value that is not known at {self.program.where(instruction.address)}; "
            "expected frames of constant size (no alloca, no arrays of variable length)"
        )


def _registers(instruction: Instruction, state: _State) -> dict[int, _Byte]:
    """Behind an instruction: constants, and bytes of the stack pointer."""
    name, operands, known = instruction.mnemonic, instruction.operands, state.registers
    changed = written(instruction)
    result = {r: byte for r, byte in known.items() if r not in changed}
    if name == "ldi":
        result[operands[0]] = _Byte(operands[1])
    elif name == "eor" and operands[0] == operands[1]:
        result[operands[0]] = _Byte(0)
    elif name == "in" and operands[1] in (SPL, SPH):
        result[operands[0]] = _Byte(0, state.depth, operands[1] == SPH)
    elif name == "mov" and operands[1] in known:
        result[operands[0]] = known[operands[1]]
    elif name == "movw":
        result |= {operands[0] + i: known[operands[1] + i] for i in (0, 1) if operands[1] + i in known}
    elif name in ("sbiw", "adiw"):
        _add_word(operands[0], operands[1] if name == "sbiw" else -operands[1], known, result)
    elif name in ("subi", "sub", "add", "sbci", "sbc", "adc"):
        _add_byte(name, operands, known, result)
    elif name in ("call", "rcall", "icall") and not pushes_only(instruction):
        result[ZERO] = _Byte(0)  # avr-gcc's convention
    return result


def _add_word(low: int, number: int, known: dict[int, _Byte], result: dict[int, _Byte]) -> None:
    one, other = known.get(low), known.get(low + 1)
    if one and other and one.depth is not None and one.part is None and other == _Byte(0, one.depth, True):
        result[low] = _Byte(0, one.depth + number)
        result[low + 1] = _Byte(0, one.depth + number, True)


def _add_byte(name: str, operands: tuple[int, ...], known: dict[int, _Byte], result: dict[int, _Byte]) -> None:
    """The low byte of the stack pointer, or then the high one, less or plus a constant."""
    to, sign = operands[0], -1 if name in ("add", "adc") else 1
    number: int | None = operands[1]
    if name not in ("subi", "sbci"):
        byte = known.get(operands[1])
        number = byte.number if byte is not None and byte.depth is None else None
    old = known.get(to)
    if number is None or old is None or old.depth is None:
        return
    if name in ("subi", "sub", "add"):
        if not old.high and old.part is None:
            result[to] = _Byte(0, old.depth, False, sign * number)
        return
    low = known.get(to - 1)
    if low is None or low.part is None or low.depth != old.depth or not old.high:
        return
    taken = low.part + (sign * number << 8)
    taken -= taken + 0x8000 & ~0xFFFF  # subi and sbci add by subtracting the two's complement
    result[to - 1] = _Byte(0, old.depth + taken)
    result[to] = _Byte(0, old.depth + taken, True)
