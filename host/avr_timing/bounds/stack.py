"""Worst-case depth of the stack: of a function with all that it calls, and of a whole image with its interrupts.

The stack pointer is followed through every instruction: `push`, `pop`, calls (2 bytes: the program counter), `rcall
.+0` (2 bytes of room) and frames, whose code reads SP into a pair of registers, subtracts a constant and writes it
back; also where libgcc does so for many functions (`__prologue_saves__`). Such a pair is a part of an unknown word
(constants.py), the value of SP at the function's entry. All ways to a place must have the same depth there. A depth
that depends on data (alloca, arrays of variable length) is refused.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from avr_timing.errors import AnalysisError
from avr_timing.flow.constants import Part, State, step
from avr_timing.image.registers import ZERO, is_call, pushes_only
from avr_timing.program import Block, Function, Instruction, Program

ADDRESS = 2  # bytes that a call or an interrupt puts on the stack
SPL, SPH = 0x3D, 0x3E  # I/O addresses
AT_ENTRY = -1  # the unknown word that SP is at a function's entry
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
class _State:
    depth: int
    known: State
    high: int | None = None  # the depth for which SPH is written, and SPL not yet


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
        function = self.program.entry(function)
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
        nesting, others = list[Depth](), list[Depth]()
        for vector in (4 * number for number in VECTORS if 4 * number in self.program.functions):
            code = self.program.instructions(self.program.below(vector))
            lets_others_in = any(instruction.mnemonic == "sei" for instruction in code)
            (nesting if lets_others_in else others).append(self.of(vector))
        nesting.sort(key=lambda depth: -depth.bytes)
        others.sort(key=lambda depth: -depth.bytes)
        return ImageDepth(self.of("main"), (*nesting, *others[:1]))

    def _depth(self, function: Function) -> Depth:
        begin = _State(0, State({ZERO: 0}))
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
                merged = state if known is None else replace(state, known=known.known.merge(state.known))
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
        own = ADDRESS if is_call(last) else 0
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
        known = step(instruction, state.known)
        if name == "in" and operands[1] in (SPL, SPH):
            read = Part(AT_ENTRY, -depth & 0xFFFF, operands[1] == SPH)
            known = replace(known, parts=known.parts | {operands[0]: read})
        return _State(depth, known, high)

    def _written(self, instruction: Instruction, state: _State) -> tuple[int, int | None]:
        """Depth, and SPH's where SPL is still to come, behind a write to one of the two."""
        port, register = instruction.operands
        parts = state.known.parts
        part, is_high = parts.get(register), port == SPH
        is_whole = part is not None and part._replace(high=not is_high) in parts.values()  # no borrow is missing
        if part is not None and part.word == AT_ENTRY and part.high == is_high and is_whole:
            depth = (-part.more + 0x8000 & 0xFFFF) - 0x8000
            if is_high:
                return state.depth, depth
            if state.high in (None, depth):
                return depth, None
        raise AnalysisError(
            f"the stack pointer gets a value that is not known at {self.program.where(instruction.address)}; "
            "expected frames of constant size (no alloca, no arrays of variable length)"
        )
