"""What the registers hold for certain at each place of a function that is entered with some of them known.

Conditional constant propagation (M. Wegman, F. Zadeck, "Constant Propagation with Conditional Branches", 1991): a
register counts as known where every way to the place gives it the same number, and ways that a branch or skip cannot
take with what is known are none. Arithmetic and flags after the AVR instruction set manual. Three things are taken from
avr-gcc's calling convention (https://gcc.gnu.org/wiki/avr-gcc): a callee keeps what is not its own, r1 is 0 at a call
and behind it, and stores through pointers do not reach the registers.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, replace

from boebot.timing.instructions import BRANCHES, SKIPS
from boebot.timing.program import Block, Edge, Function, Instruction
from boebot.timing.registers import ZERO, pushes_only, written

ARGUMENTS = range(8, 26)  # registers in which values are handed to a callee
SREG_IO, SREG_DATA = 0x3F, 0x5F
VECTORS_END = 4 * 26  # addresses below are interrupt vectors: there r1 may hold anything
# What changes neither C, Z, N nor V.
KEEPS = BRANCHES | SKIPS
KEEPS |= frozenset(("ldi", "mov", "movw", "ld", "ldd", "lds", "lpm", "pop", "in", "bld", "swap"))
KEEPS |= frozenset(("st", "std", "sts", "out", "push", "sbi", "cbi", "nop", "wdr", "sleep", "sei", "cli", "bst"))
KEEPS |= frozenset(("seh", "clh", "jmp", "rjmp", "ijmp", "ret", "reti"))
SETS = {"sec": ("C", True), "clc": ("C", False), "set": ("T", True), "clt": ("T", False)}
# Of each branch: the flag that decides and the value with which it is taken; S is N xor V.
CONDITIONS = {
    "brcs": ("C", True), "brcc": ("C", False), "breq": ("Z", True), "brne": ("Z", False), "brmi": ("N", True),
    "brpl": ("N", False), "brvs": ("V", True), "brvc": ("V", False), "brlt": ("S", True), "brge": ("S", False),
    "brts": ("T", True), "brtc": ("T", False),
}  # fmt: skip

Context = tuple[tuple[int, int], ...]  # registers and what they hold, at the entry of a function


@dataclass(frozen=True, slots=True)
class State:
    """What is known at a place: registers by number, flags by letter (of these C, Z, N, V and T are followed). None of
    both may be changed."""

    registers: dict[int, int] = field(default_factory=dict)
    flags: dict[str, bool] = field(default_factory=dict)

    def merge(self, other: State) -> State:
        """What holds on both ways."""
        return State(
            {r: value for r, value in self.registers.items() if other.registers.get(r) == value},
            {f: value for f, value in self.flags.items() if other.flags.get(f) == value},
        )

    def word(self, low: int) -> int | None:
        """The number in a pair of registers."""
        one, other = self.registers.get(low), self.registers.get(low + 1)
        return None if one is None or other is None else other << 8 | one


@dataclass(frozen=True, slots=True)
class Known:
    """A function in one context: its blocks that can run, with the edges that can be taken, and what is known."""

    function: Function
    context: Context
    states: dict[int, State]  # at the beginning of each block

    def before_last(self, block: Block) -> State:
        """In front of the block's last instruction."""
        state = self.states[block.start]
        for instruction in block.instructions[:-1]:
            state = step(instruction, state)
        return state

    def behind(self, block: Block) -> State:
        """Behind the block's last instruction, where that is not a call also behind what it calls."""
        return step(block.instructions[-1], self.before_last(block))

    def handed(self, block: Block) -> Context:
        """With which the function is entered that the block's last instruction calls or leads to."""
        last = block.instructions[-1]
        known = self.before_last(block).registers
        found = {r: value for r, value in known.items() if r in ARGUMENTS or r == ZERO}
        if last.mnemonic in ("call", "rcall", "icall"):
            found[ZERO] = 0
        return tuple(sorted(found.items()))


def root(function: Function) -> Context:
    """Of a function of which no call is known."""
    return () if function.entry < VECTORS_END else ((ZERO, 0),)


def known(function: Function, context: Context) -> Known:
    """Of a function that is entered with these registers."""
    states = {function.entry: State(dict(context))}
    taken: dict[int, list[Edge]] = {}
    work = [function.entry]
    while work:
        block = function.blocks[work.pop()]
        taken[block.start], state = _through(block, states[block.start])
        work += [edge.to for edge in taken[block.start] if _arrive(states, edge.to, state)]
    blocks = {start: replace(function.blocks[start], edges=tuple(edges)) for start, edges in sorted(taken.items())}
    return Known(replace(function, blocks=blocks), context, states)


def once_round(function: Function, header: int, nodes: Collection[int], state: State) -> State | None:
    """What is known at a loop's header after one pass, from what was known before it; None: no way leads back to it.

    Args:
        nodes: the blocks of the loop.
    """
    states = {header: state}
    back: dict[int, State] = {}
    work = [header]
    while work:
        block = function.blocks[work.pop()]
        edges, after = _through(block, states[block.start])
        for edge in edges:
            if edge.to == header:
                _arrive(back, header, after)
            elif edge.to in nodes and _arrive(states, edge.to, after):
                work.append(edge.to)
    return back.get(header)


def _through(block: Block, state: State) -> tuple[list[Edge], State]:
    """The edges that can be taken behind a block, and what is known there."""
    for instruction in block.instructions[:-1]:
        state = step(instruction, state)
    last = block.instructions[-1]
    return [edge for edge in block.edges if _may_take(last, edge, state)], step(last, state)


def _arrive(states: dict[int, State], place: int, state: State) -> bool:
    """One way more that leads to a place; whether less is known there now."""
    old = states.get(place)
    states[place] = state if old is None else old.merge(state)
    return states[place] != old


def _may_take(last: Instruction, edge: Edge, state: State) -> bool:
    """Whether what is known allows that way out of a block."""
    behind = last.address + last.size
    if last.mnemonic in CONDITIONS and last.operands[-1] != behind:
        flag, value = CONDITIONS[last.mnemonic]
        found = _flag(flag, state)
        return found is None or (edge.to == last.operands[-1]) == (found == value)
    if last.mnemonic in ("cpse", "sbrc", "sbrs"):
        skips = _skips(last, state)
        return skips is None or (edge.to != behind) == skips
    return True


def _flag(name: str, state: State) -> bool | None:
    if name != "S":
        return state.flags.get(name)
    negative, overflow = state.flags.get("N"), state.flags.get("V")
    return None if negative is None or overflow is None else negative != overflow


def _skips(last: Instruction, state: State) -> bool | None:
    one, other = last.operands
    if last.mnemonic == "cpse":
        if one == other:
            return True
        values = state.registers.get(one), state.registers.get(other)
        return None if None in values else values[0] == values[1]
    value = state.registers.get(one)
    return None if value is None else (value >> other & 1 == 1) == (last.mnemonic == "sbrs")


def step(instruction: Instruction, state: State) -> State:
    """What is known behind an instruction; behind a call, when its callee has returned."""
    name, operands = instruction.mnemonic, instruction.operands
    if name in ("call", "rcall", "icall") and not pushes_only(instruction):
        return State(_without(state.registers, written(instruction)) | {ZERO: 0})
    registers = _without(state.registers, written(instruction))
    writes_flags = (name == "out" and operands[0] == SREG_IO) or (name == "sts" and operands[0] == SREG_DATA)
    flags = {} if writes_flags or (name not in KEEPS and not pushes_only(instruction)) else state.flags
    for register, value in _moved(name, operands, state):
        registers[register] = value
    if name in SETS:
        flag, value = SETS[name]
        flags = state.flags | {flag: value}
    elif name == "bst":
        flags = _stored(operands, state)
    elif name in _BYTES:
        flags = _transfer(state) | _byte(name, operands, state, registers)
    elif name in ("adiw", "sbiw"):
        flags = _transfer(state) | _word(name, operands, state, registers)
    return State(registers, flags)


def _transfer(state: State) -> dict[str, bool]:
    """Flag T, which arithmetic keeps."""
    return {"T": state.flags["T"]} if "T" in state.flags else {}


def _stored(operands: tuple[int, ...], state: State) -> dict[str, bool]:
    """The flags behind `bst`."""
    kept = {f: value for f, value in state.flags.items() if f != "T"}
    held = state.registers.get(operands[0])
    return kept if held is None else kept | {"T": held >> operands[1] & 1 == 1}


def _without(registers: dict[int, int], changed: frozenset[int]) -> dict[int, int]:
    kept = registers.copy()
    for register in changed:
        kept.pop(register, None)
    return kept


def _moved(name: str, operands: tuple[int, ...], state: State) -> Iterator[tuple[int, int]]:
    """Registers that get a number without arithmetic."""
    if name == "ldi":
        yield operands[0], operands[1]
    elif name in ("mov", "movw"):
        for i in range(2 if name == "movw" else 1):
            if operands[1] + i in state.registers:
                yield operands[0] + i, state.registers[operands[1] + i]
    elif name == "swap" and operands[0] in state.registers:
        value = state.registers[operands[0]]
        yield operands[0], value << 4 & 0xF0 | value >> 4
    elif name == "bld" and operands[0] in state.registers and "T" in state.flags:
        bit = 1 << operands[1]
        yield operands[0], state.registers[operands[0]] & ~bit | bit * state.flags["T"]


@dataclass(frozen=True, slots=True)
class _Kind:
    """Arithmetic of one byte: from both operands and C, the result, which may leave 0..255, and V."""

    compute: Callable[[int, int, int], int]
    overflow: Callable[[int, int, int], bool]  # from both operands and the byte of the result
    operands: int = 2  # that are registers
    constant: bool = False  # the second one is a number
    carries: bool = False  # C goes in
    chained: bool = False  # Z stays false where it was
    writes: bool = True
    carry: Callable[[int, int], bool] | None = None  # C from the first operand and the whole result; None: it stays


def _outside(_first: int, result: int) -> bool:
    return not 0 <= result <= 255


def _lowest(first: int, _result: int) -> bool:
    return first & 1 == 1


def _difference(a: int, b: int, r: int) -> bool:
    return (a ^ b) & (a ^ r) & 0x80 != 0


def _sum(a: int, b: int, r: int) -> bool:
    return (a ^ r) & (b ^ r) & 0x80 != 0


def _never(_a: int, _b: int, _r: int) -> bool:
    return False


def _shifted(a: int, _b: int, r: int) -> bool:
    return (r >> 7) != (a & 1)


def _less(a: int, b: int, c: int) -> int:
    return a - b - c


def _more(a: int, b: int, c: int) -> int:
    return a + b + c


_BYTES = {
    "add": _Kind(_more, _sum, carry=_outside),
    "adc": _Kind(_more, _sum, carries=True, carry=_outside),
    "sub": _Kind(_less, _difference, carry=_outside),
    "subi": _Kind(_less, _difference, constant=True, carry=_outside),
    "sbc": _Kind(_less, _difference, carries=True, chained=True, carry=_outside),
    "sbci": _Kind(_less, _difference, constant=True, carries=True, chained=True, carry=_outside),
    "cp": _Kind(_less, _difference, writes=False, carry=_outside),
    "cpi": _Kind(_less, _difference, constant=True, writes=False, carry=_outside),
    "cpc": _Kind(_less, _difference, carries=True, chained=True, writes=False, carry=_outside),
    "and": _Kind(lambda a, b, c: a & b, _never),
    "andi": _Kind(lambda a, b, c: a & b, _never, constant=True),
    "or": _Kind(lambda a, b, c: a | b, _never),
    "ori": _Kind(lambda a, b, c: a | b, _never, constant=True),
    "eor": _Kind(lambda a, b, c: a ^ b, _never),
    "com": _Kind(lambda a, b, c: 255 - a, _never, operands=1, carry=lambda a, r: True),
    "neg": _Kind(lambda a, b, c: -a, lambda a, b, r: r == 0x80, operands=1, carry=_outside),
    "inc": _Kind(lambda a, b, c: a + 1, lambda a, b, r: r == 0x80, operands=1),
    "dec": _Kind(lambda a, b, c: a - 1, lambda a, b, r: r == 0x7F, operands=1),
    "lsr": _Kind(lambda a, b, c: a >> 1, _shifted, operands=1, carry=_lowest),
    "ror": _Kind(lambda a, b, c: a >> 1 | c << 7, _shifted, operands=1, carries=True, carry=_lowest),
    "asr": _Kind(lambda a, b, c: a >> 1 | a & 0x80, _shifted, operands=1, carry=_lowest),
}


def _byte(name: str, operands: tuple[int, ...], state: State, registers: dict[int, int]) -> dict[str, bool]:
    """The flags behind an instruction of _BYTES; what it writes goes to `registers`."""
    kind = _BYTES[name]
    kept = {} if kind.carry is not None or "C" not in state.flags else {"C": state.flags["C"]}
    if name in ("eor", "sub") and operands[0] == operands[1]:
        first: int | None = 0  # whatever is in there
        second: int | None = 0
    else:
        first = state.registers.get(operands[0])
        second = 0 if kind.operands == 1 else operands[1] if kind.constant else state.registers.get(operands[1])
    carry = state.flags.get("C") if kind.carries else False
    if first is None or second is None or carry is None:
        return kept
    result = kind.compute(first, second, int(carry))
    byte = result & 0xFF
    if kind.writes:
        registers[operands[0]] = byte
    flags = kept | {"N": byte >= 0x80, "V": kind.overflow(first, second, byte)}
    if kind.carry is not None:
        flags["C"] = kind.carry(first, result)
    if byte != 0 or not kind.chained:
        flags["Z"] = byte == 0
    elif "Z" in state.flags:
        flags["Z"] = state.flags["Z"]
    return flags


def _word(name: str, operands: tuple[int, ...], state: State, registers: dict[int, int]) -> dict[str, bool]:
    """The same for `adiw` and `sbiw`."""
    first = state.word(operands[0])
    if first is None:
        return {}
    result = first + operands[1] if name == "adiw" else first - operands[1]
    word = result & 0xFFFF
    registers[operands[0]], registers[operands[0] + 1] = word & 0xFF, word >> 8
    changed = (word & ~first if name == "adiw" else first & ~word) & 0x8000 != 0
    return {"C": not 0 <= result <= 0xFFFF, "Z": word == 0, "N": word >= 0x8000, "V": changed}
