"""Where a computed jump or call leads: every value of the Z register (r31:r30) that the instructions before it allow.

The instructions that always run before the jump are worked through in their order; what is not known is an unknown
byte. Z is then a function of some unknown bytes, and is computed for all values of these, less those with which the
branches on the way would have gone elsewhere. With no unknown byte this is a constant (`__prologue_saves__`), with
one, or with the two of a 16-bit index, a table of jumps whose range the program itself checks (`__tablejump2__`). So
the answer is a proof; what it cannot cover is refused. Two things are taken from avr-gcc's calling convention: r1 is 0
where the way begins and behind a call, and stores through pointers do not reach the registers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from avr_timing.flow.arithmetic import BYTES
from avr_timing.flow.instructions import BRANCHES, SKIPS
from avr_timing.flow.registers import REGISTERS, ZERO
from avr_timing.program import Instruction

Values = NDArray[np.int64]  # of one term, one for each choice of the unknown bytes
LONGEST_WAY = 64  # instructions
MOST_UNKNOWN = 2  # bytes: 65,536 choices
MOST_PLACES = 255  # an index of one byte has 256 values when nothing limits it: this is no proof
Z = 30
SREG = 0x3F  # I/O address
# Neither registers nor the flags C and Z change.
INERT = frozenset(("nop", "std", "push", "cbi", "sbi", "sei", "cli", "wdr", "sleep", "bst", "jmp", "rjmp", "ijmp"))
INERT |= BRANCHES | SKIPS | frozenset(("set", "clt", "sen", "cln", "ses", "cls", "sev", "clv", "seh", "clh"))
LOADS = frozenset(("ld", "ldd", "lds", "pop", "in", "bld", "swap"))  # their first operand becomes unknown
PRODUCTS = frozenset(("mul", "muls", "mulsu", "fmul", "fmuls", "fmulsu"))  # into r1:r0


class NotProvenError(Exception):
    """Its text says why."""


@dataclass(frozen=True, slots=True)
class Step:
    """An instruction on the way to a jump, and the address where it went on."""

    instruction: Instruction
    to: int


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A byte or a flag: computed from its arguments, and so a function of some unknown bytes, given by number."""

    compute: Callable[..., Values]
    arguments: tuple[Term, ...] = ()
    unknown: frozenset[int] = frozenset()

    def values(self, known: dict[Term, Values]) -> Values:
        """With the terms that are known already; what is computed is added to them."""
        if self not in known:
            known[self] = self.compute(*(argument.values(known) for argument in self.arguments))
        return known[self]


def _constant(number: int) -> Term:
    return Term(lambda: np.asarray(number, dtype=np.int64))


def _term(compute: Callable[..., Values], *arguments: Term) -> Term:
    return Term(compute, arguments, frozenset[int]().union(*(argument.unknown for argument in arguments)))


def targets_of(code: bytes, way: list[Step]) -> frozenset[int]:
    """Byte addresses where an `ijmp` or `icall` can lead. Raises NotProvenError.

    Args:
        code: the flash.
        way: the instructions that always run before it, the nearest last.
    """
    machine = _Machine(code)
    for step in way[-LONGEST_WAY:]:
        machine.run(step)
    pointer = machine.pair(Z)
    if len(pointer.unknown) > MOST_UNKNOWN:
        raise NotProvenError(f"Z depends on {len(pointer.unknown)} bytes that are not known")
    numbers = np.unique(pointer.values(machine.allowed(pointer.unknown)))
    if not 0 < numbers.size <= MOST_PLACES:
        raise NotProvenError(f"Z can have {numbers.size} values, as nothing before limits it")
    return frozenset(2 * int(number) for number in numbers)


class _Machine:
    """Registers and the flags C and Z as terms, and what the branches said of them."""

    def __init__(self, code: bytes) -> None:
        self._code = np.frombuffer(code, dtype=np.uint8).astype(np.int64)
        self._unknown: list[Term] = []
        self._conditions: list[tuple[Term, bool]] = []
        self._forget()

    def allowed(self, unknown: frozenset[int]) -> dict[Term, Values]:
        """All choices of these unknown bytes with which the branches go the way that was taken."""
        leaves = [self._unknown[number] for number in sorted(unknown)]
        grid = np.meshgrid(*(np.arange(256, dtype=np.int64) for _ in leaves))
        choices: dict[Term, Values] = {leaf: axis.ravel() for leaf, axis in zip(leaves, grid, strict=True)}
        for condition, expected in self._conditions:
            if condition.unknown and condition.unknown <= unknown:
                holds = condition.values(dict(choices)).astype(bool) == expected
                choices = {leaf: values[holds] for leaf, values in choices.items()}
        return choices

    def pair(self, low: int) -> Term:
        return _term(lambda low, high: high << 8 | low, self._registers[low], self._registers[low + 1])

    def run(self, step: Step) -> None:
        """One instruction. What is not modelled leaves nothing known."""
        instruction = step.instruction
        name, operands = instruction.mnemonic, instruction.operands
        behind = instruction.address + instruction.size
        if name in BRANCHES and operands[0] != behind:
            self._branch(name, step.to != behind)
        operation = getattr(self, f"_{name}", None)
        if operation is not None:
            operation(*operands)
        elif name in BYTES:
            self._arithmetic(name, *operands)
        elif name in LOADS:
            self._load(name, *operands)
        elif name in PRODUCTS:
            self._forget_pair(0)
            self._forget_flags()
        elif not (name in INERT or (name == "rcall" and operands[0] == behind)):
            self._forget()

    def _new(self) -> Term:
        number = len(self._unknown)
        # An unknown byte is always among the known terms when values are computed.
        self._unknown.append(Term(partial(_never, number), (), frozenset((number,))))
        return self._unknown[-1]

    def _forget(self) -> None:
        self._registers = [self._new() for _ in range(REGISTERS)]
        self._registers[ZERO] = _constant(0)
        self._forget_flags()

    def _forget_flags(self) -> None:
        self._carry, self._zero = (_term(lambda byte: byte & 1, self._new()) for _ in range(2))

    def _branch(self, name: str, taken: bool) -> None:
        if name in ("brcs", "brcc"):
            self._conditions.append((self._carry, (name == "brcs") == taken))
        if name in ("breq", "brne"):
            self._conditions.append((self._zero, (name == "breq") == taken))

    def _arithmetic(self, name: str, d: int, other: int = 0) -> None:
        kind = BYTES[name]
        second = _constant(other) if kind.constant or kind.operands == 1 else self._registers[other]
        if not kind.constant and d == other and name in ("eor", "sub"):
            first = second = _constant(0)  # whatever is in there
        else:
            first = self._registers[d]
        carry = self._carry if kind.carries else _constant(0)
        result = _term(kind.compute, first, second, carry)
        byte = _term(lambda result: result & 0xFF, result)
        zero = _term(lambda byte: byte == 0, byte)
        if kind.chained:  # Z stays only where it was: so that 16 bits are compared
            zero = _term(lambda zero, before: zero & (before != 0), zero, self._zero)
        self._zero = zero
        if kind.carry is not None:
            self._carry = _term(kind.carry, first, result)
        if kind.writes:
            self._registers[d] = byte

    def _load(self, name: str, d: int, *address: int) -> None:
        self._registers[d] = self._new()
        if name == "ld" and address[1]:
            self._forget_pair(address[0])

    def _forget_pair(self, low: int) -> None:
        self._registers[low], self._registers[low + 1] = self._new(), self._new()

    def _st(self, pointer: int, step: int, _r: int) -> None:
        if step:
            self._forget_pair(pointer)

    def _sts(self, address: int, _r: int) -> None:
        if address < REGISTERS or address == SREG + REGISTERS:
            self._forget()

    def _out(self, address: int, _r: int) -> None:
        if address == SREG:
            self._forget_flags()

    def _ldi(self, d: int, number: int) -> None:
        self._registers[d] = _constant(number)

    def _mov(self, d: int, r: int) -> None:
        self._registers[d] = self._registers[r]

    def _movw(self, d: int, r: int) -> None:
        self._registers[d : d + 2] = self._registers[r : r + 2]

    def _advance(self, low: int, number: int) -> Term:
        """To a pair of registers, without flags; the sum."""
        total = _term(lambda pair: pair + number, self.pair(low))
        self._registers[low] = _term(lambda total: total & 0xFF, total)
        self._registers[low + 1] = _term(lambda total: total >> 8 & 0xFF, total)
        return total

    def _adiw(self, d: int, number: int) -> None:
        total = self._advance(d, number)
        self._carry = _term(lambda total: total >> 16 & 1, total)
        self._zero = _term(lambda total: total & 0xFFFF == 0, total)

    def _sbiw(self, d: int, number: int) -> None:
        self._adiw(d, -number)

    def _lpm(self, d: int, pointer: int, step: int) -> None:
        value = _term(self._read, self.pair(pointer))
        if step:
            self._advance(pointer, step)
        self._registers[d] = value

    def _read(self, addresses: Values) -> Values:
        """Bytes of the flash: a table, of which the program must have limited the index."""
        places = np.unique(addresses)
        if places.size > MOST_PLACES:
            raise NotProvenError(f"its table has {places.size} places, as nothing before limits the index")
        if places.size and places[-1] >= self._code.size:
            raise NotProvenError(f"its table is not in the flash, at 0x{places[-1]:04X}")
        return self._code[addresses]


def _never(number: int) -> Values:
    raise AssertionError(f"unknown byte {number} was asked for its value")
