"""Where a computed jump leads: into the table of a `switch`, whose index the program itself limits.

The instructions that always run before the jump are worked through with each value that one unknown byte can have, by
the arithmetic of constants.py; a value with which a branch on the way would have gone elsewhere drops out. Where Z
(r31:r30) is known with each of the others, and fewer places of the table are read than a byte has values, this is a
proof; what it cannot cover, such as an index of two bytes, is refused. Two things are taken from avr-gcc's calling
convention: r1 is 0 where the way begins and behind a call, and stores through pointers do not reach the registers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from avr_timing.flow.constants import State, may_take, step
from avr_timing.flow.registers import REGISTERS, ZERO
from avr_timing.program import Edge, Instruction

LONGEST_WAY = 64  # instructions
Z = 30


class NotProvenError(Exception):
    """Its text says why."""


class Step(NamedTuple):
    """An instruction on the way to a jump, and the address where it went on."""

    instruction: Instruction
    to: int


def targets_of(code: bytes, way: Sequence[Step]) -> frozenset[int]:
    """Byte addresses where an `ijmp` can lead. Raises NotProvenError.

    Args:
        code: the flash.
        way: the instructions that always run before it, the nearest last.
    """
    way = way[-LONGEST_WAY:]
    known = [State({ZERO: 0})]
    for each in way:
        known.append(_behind(code, each, known[-1]) or State())
    for begin in reversed(range(len(way) + 1)):
        for register in range(REGISTERS):
            if register not in known[begin].registers:
                found = _with_each_value(code, way[begin:], known[begin], register)
                if found:
                    return frozenset(2 * pointer for pointer in found)
    raise NotProvenError("nothing before limits its index")


def _with_each_value(code: bytes, way: Sequence[Step], known: State, register: int) -> set[int]:
    """What Z can be where only that register is not known; empty: that proves nothing."""
    found, places = set[int](), set[tuple[int | None, ...]]()
    for value in range(256):
        state: State | None = State(known.registers | {register: value}, known.flags)
        pointers = []
        for each in way:
            if state is not None:
                pointers += [state.word(Z)] if each.instruction.mnemonic == "lpm" else []
                state = _behind(code, each, state)
        if state is not None:
            pointer = state.word(Z)
            if pointer is None:
                return set()
            found.add(pointer)
            places.add((*pointers, pointer))
    return found if len(places) < 256 else set()


def _behind(code: bytes, each: Step, state: State) -> State | None:
    """What is known behind a step; None: with what was known before it, it goes another way."""
    instruction, pointer = each.instruction, state.word(Z)
    if not may_take(instruction, Edge(each.to, 0), state):
        return None
    after = step(instruction, state)
    if instruction.mnemonic == "lpm" and pointer is not None and pointer < len(code):
        after = replace(after, registers=after.registers | {instruction.operands[0]: code[pointer]})
    return after
