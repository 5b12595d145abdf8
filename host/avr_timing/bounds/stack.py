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

from avr_timing.flow.constants import Context, Known, Part, State, known, root, step
from avr_timing.flow.registers import ZERO, is_call, pushes_only
from avr_timing.program import Block, Instruction, Program
from boebot.errors import AnalysisError

ADDRESS = 2  # bytes that a call or an interrupt puts on the stack
SPL, SPH = 0x3D, 0x3E  # I/O addresses
AT_ENTRY = -1  # the unknown word that SP is at a function's entry
VECTORS = range(1, 26)  # as in __vector_N; each at byte address 4 N


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
        self._left_out = left_out
        self._depths: dict[tuple[int, Context], int] = {}
        self._under_way: list[int] = []

    def of(self, function: str | int) -> int:
        """The worst-case depth of a function in bytes, by name or entry, without its own return address.

        Raises:
            AnalysisError: no such function; recursion; a depth that is not the same on all ways or depends on data.
        """
        entry = self.program.entry(function)
        return self.bound(entry, root(self.program.functions[entry]))

    def bound(self, entry: int, context: Context) -> int:
        """Of a function that is entered with these registers: ways that they close do not count (wcet.py)."""
        key = (entry, context)
        if entry in self._left_out:
            return 0
        if entry in self.program.unproven:
            raise AnalysisError(self.program.unproven[entry])
        if key not in self._depths:
            with self.program.entered(entry, self._under_way):
                self._depths[key] = self._depth(known(self.program.functions[entry], context))
        return self._depths[key]

    def image(self) -> int:
        """Of the whole image: `main` with its return address, and the worst nesting of interrupts on top of it, each
        with its.

        An interrupt that switches interrupts on again is taken to keep itself off meanwhile: each such one is there at
        most once, and on top of them one that does not.
        """
        depths, deepest = [self.of("main")], 0
        for vector in (4 * number for number in VECTORS if 4 * number in self.program.functions):
            code = self.program.instructions(self.program.below(vector))
            if any(instruction.mnemonic == "sei" for instruction in code):
                depths.append(self.of(vector))
            else:
                deepest = max(deepest, ADDRESS + self.of(vector))
        return deepest + sum(ADDRESS + depth for depth in depths)

    def _depth(self, inside: Known) -> int:
        function = inside.function
        begin = _State(0, State({ZERO: 0}))
        states = {function.entry: begin}
        work = [function.entry]
        deepest = 0
        while work:
            block = function.blocks[work.pop()]
            state, found = self._run(block, states[block.start], inside)
            deepest = max(deepest, found)
            for edge in block.edges:
                before = states.get(edge.to)
                if before is not None and (before.depth, before.high) != (state.depth, state.high):
                    raise AnalysisError(
                        f"{function.name} reaches {self.program.where(edge.to)} with {before.depth} and with "
                        f"{state.depth} bytes on the stack; expected one depth at each place"
                    )
                merged = state if before is None else replace(state, known=before.known.merge(state.known))
                if before is None or merged != before:
                    states[edge.to] = merged
                    work.append(edge.to)
        return deepest

    def _run(self, block: Block, state: _State, inside: Known) -> tuple[_State, int]:
        """The state at the end of a block, and the greatest depth within it."""
        name, deepest = inside.function.name, state.depth
        for instruction in block.instructions:
            state = self._step(instruction, state)
            deepest = max(deepest, state.depth)
        last = block.instructions[-1]
        own = ADDRESS if is_call(last) else 0
        if block.callee is not None:
            called = self.bound(block.callee, inside.handed(block))
            deepest = max(deepest, state.depth + own + called)
        if not (block.edges or is_call(last)) and state.depth != 0:  # a callee of a tail call would return into it, too
            raise AnalysisError(
                f"{name} returns at {self.program.where(last.address)} with {state.depth} bytes on the stack; "
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
        after = step(instruction, state.known)
        if name == "in" and operands[1] in (SPL, SPH):
            read = Part(AT_ENTRY, -depth & 0xFFFF, operands[1] == SPH)
            after = replace(after, parts=after.parts | {operands[0]: read})
        return _State(depth, after, high)

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
