"""What the registers hold for certain at each place of a function that is entered with some of them known.

Conditional constant propagation (M. Wegman, F. Zadeck, "Constant Propagation with Conditional Branches", 1991): a
register counts as known where every way to the place gives it the same number, and ways that a branch or skip cannot
take with what is known are none. Of a word that is not known it is followed by how much others are more (Part): so
a loop from a pointer to its end has a count. Arithmetic and flags after the AVR instruction set manual. Three things
are taken from avr-gcc's calling convention (https://gcc.gnu.org/wiki/avr-gcc): a callee keeps what is not its own, r1
is 0 at a call and behind it, and stores through pointers do not reach the registers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from avr_timing.flow.arithmetic import BYTES
from avr_timing.flow.instructions import BRANCHES, SKIPS
from avr_timing.flow.registers import SREG, ZERO, is_call, pushes_only, written
from avr_timing.program import Block, Edge, Function, Instruction

ARGUMENTS = range(8, 26)  # registers in which values are handed to a callee
VECTORS_END = 4 * 26  # addresses below are interrupt vectors: there r1 may hold anything
# What changes neither C, Z, N nor V; `out` where it does not write SREG (keeps_flags).
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


class Part(NamedTuple):
    """The low or the high byte of an unknown word and `more`, modulo 2^16. `word`: the address of the instruction that
    copied it last; all parts with that number are of the same copy."""

    word: int
    more: int
    high: bool


@dataclass(frozen=True, slots=True)
class State:
    """What is known at a place: registers by number, flags by letter (of these C, Z, N, V and T are followed), and
    registers that are parts of unknown words. None of these may be changed. `carried`: C is what the low byte of that
    word carried when so much was added, or, where that was subtracted (True), what it borrowed."""

    registers: dict[int, int] = field(default_factory=dict)
    flags: dict[str, bool] = field(default_factory=dict)
    parts: dict[int, Part] = field(default_factory=dict)
    carried: tuple[Part, int, bool] | None = None

    def merge(self, other: State) -> State:
        """What holds on both ways."""
        return State(
            {r: value for r, value in self.registers.items() if other.registers.get(r) == value},
            {f: value for f, value in self.flags.items() if other.flags.get(f) == value},
            {r: part for r, part in self.parts.items() if other.parts.get(r) == part},
            self.carried if self.carried == other.carried else None,
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

    def behind(self, block: Block, to: int) -> State:
        """Behind the block's last instruction, on the way to that block; behind a call, when that has returned."""
        after = step(block.instructions[-1], self.before_last(block))
        return _told_by(block, next(edge for edge in block.edges if edge.to == to), after)

    def handed(self, block: Block) -> Context:
        """With which the function is entered that the block's last instruction calls or leads to."""
        last = block.instructions[-1]
        known = self.before_last(block).registers
        found = {r: value for r, value in known.items() if r in ARGUMENTS or r == ZERO}
        if is_call(last):
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
        work += [edge.to for edge in taken[block.start] if _arrive(states, edge.to, _told_by(block, edge, state))]
    blocks = {start: replace(function.blocks[start], edges=tuple(edges)) for start, edges in sorted(taken.items())}
    return Known(replace(function, blocks=blocks), context, states)


def once_round(function: Function, header: int, nodes: Collection[int], state: State) -> tuple[State | None, bool]:
    """What is known at a loop's header after one pass, from what was known before it; None: no way leads back to it.
    And whether it was known of any way out of the loop, or round it, that it is not taken.

    Args:
        nodes: the blocks of the loop.
    """
    states = {header: state}
    back: dict[int, State] = {}
    decided = False
    work = [header]
    while work:
        block = function.blocks[work.pop()]
        edges, after = _through(block, states[block.start])
        decided = decided or (len(edges) < len(block.edges) and any(e.to not in nodes for e in block.edges))
        for edge in edges:
            behind = _told_by(block, edge, after)
            if edge.to == header:
                _arrive(back, header, behind)
            elif edge.to in nodes and _arrive(states, edge.to, behind):
                work.append(edge.to)
    return back.get(header), decided


def _through(block: Block, state: State) -> tuple[list[Edge], State]:
    """The edges that can be taken behind a block, and what is known there."""
    for instruction in block.instructions[:-1]:
        state = step(instruction, state)
    last = block.instructions[-1]
    return [edge for edge in block.edges if may_take(last, edge, state)], step(last, state)


def _told_by(block: Block, edge: Edge, state: State) -> State:
    """What is known besides on one way out of a block, by the branch that leads there: what was compared is equal, what
    came out is zero, or what was counted below zero is 255."""
    last = block.instructions[-1]
    behind = last.address + last.size
    if last.mnemonic not in CONDITIONS or len(block.instructions) < 2 or last.operands[-1] == behind:
        return state
    flag, value = CONDITIONS[last.mnemonic]
    is_set = value == (edge.to == last.operands[-1])
    setter = block.instructions[-2]
    name, operands = setter.mnemonic, setter.operands
    number = None
    if flag == "Z" and is_set:
        number = operands[1] if name == "cpi" else 0 if name in ("dec", "inc", "subi", "sub", "and", "andi") else None
    elif flag == "C" and is_set and name == "subi" and operands[1] == 1:
        number = 0xFF
    if number is None:
        return state
    parts = {r: part for r, part in state.parts.items() if r != operands[0]}
    return replace(state, registers=state.registers | {operands[0]: number}, parts=parts)


def _arrive(states: dict[int, State], place: int, state: State) -> bool:
    """One way more that leads to a place; whether less is known there now."""
    old = states.get(place)
    states[place] = state if old is None else old.merge(state)
    return states[place] != old


def may_take(last: Instruction, edge: Edge, state: State) -> bool:
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
    if is_call(instruction):
        changed = written(instruction)
        kept = {r: part for r, part in state.parts.items() if r not in changed}
        return State(_without(state.registers, changed) | {ZERO: 0}, {}, kept)
    registers = _without(state.registers, written(instruction))
    flags = state.flags if keeps_flags(instruction) else {}
    for register, value in (*_pointer(name, operands, state), *_moved(name, operands, state)):
        registers[register] = value
    if name in SETS:
        flag, value = SETS[name]
        flags = state.flags | {flag: value}
    elif name == "bst":
        flags = _stored(operands, state)
    elif name in BYTES:
        flags = _transfer(state) | _byte(name, operands, state, registers)
    elif name in ("adiw", "sbiw"):
        flags = _transfer(state) | _word(name, operands, state, registers)
    parts, carried = _parts(instruction, state, registers, flags)
    return State(registers, flags, parts, carried)


def keeps_flags(instruction: Instruction) -> bool:
    """Whether an instruction changes neither C, Z, N nor V. `sts` to SREG is refused (graph.py)."""
    name = instruction.mnemonic
    return pushes_only(instruction) or (name in KEEPS and not (name == "out" and instruction.operands[0] == SREG))


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


def _parts(
    instruction: Instruction, state: State, registers: dict[int, int], flags: dict[str, bool]
) -> tuple[dict[int, Part], tuple[Part, int, bool] | None]:
    """The parts of unknown words behind an instruction, and the carry that one has left. What a comparison or a
    difference of two parts says goes to `registers` and `flags`."""
    name, operands, old = instruction.mnemonic, instruction.operands, state.parts
    changed = written(instruction)
    new = {r: part for r, part in old.items() if r not in changed} if changed else old.copy()
    carried = state.carried if keeps_flags(instruction) else None
    if name in ("mov", "movw"):
        new.update(_copied(instruction, state, new))
    elif name in ("adiw", "sbiw"):
        _step_on(operands[0], operands[1] if name == "adiw" else -operands[1], old, new)
    elif name == "st":
        _step_on(operands[0], operands[1], old, new)
    elif name in ("ld", "lpm") and operands[0] not in (operands[1], operands[1] + 1):
        _step_on(operands[1], operands[2], old, new)
    elif old and name in _PART_KINDS:
        carried = _arithmetic(name, operands, state, new, registers, flags)
    return new, carried


def _copied(instruction: Instruction, state: State, new: dict[int, Part]) -> dict[int, Part]:
    """A copy of parts; or of what is not known at all, which is a word from then on."""
    to, source = instruction.operands[:2]
    count = 2 if instruction.mnemonic == "movw" else 1
    sources = range(source, source + count)
    if not any(r in state.registers or r in state.parts for r in sources):
        for register in [r for r, part in new.items() if part.word == instruction.address]:
            del new[register]
        born = {r: Part(instruction.address, 0, r > source) for r in sources}
        return born | {to + r - source: part for r, part in born.items()}
    return {to + r - source: state.parts[r] for r in sources if r in state.parts}


def _step_on(low: int, more: int, old: Mapping[int, Part], new: dict[int, Part]) -> None:
    """A pair of registers that is a whole word becomes so much more."""
    one, other = old.get(low), old.get(low + 1)
    if one is not None and other == one._replace(high=True) and not one.high:
        moved = one._replace(more=one.more + more & 0xFFFF)
        new[low], new[low + 1] = moved, moved._replace(high=True)


_PART_KINDS = frozenset(("add", "subi", "sub", "inc", "dec", "adc", "sbci", "sbc", "cp", "cpc"))


def _arithmetic(
    name: str,
    operands: tuple[int, ...],
    state: State,
    new: dict[int, Part],
    registers: dict[int, int],
    flags: dict[str, bool],
) -> tuple[Part, int, bool] | None:
    """Of a part and a number, or of two parts. Returns the carry that it leaves, where the next instruction can use
    it."""
    to, part = operands[0], state.parts.get(operands[0])
    if part is None and name in ("add", "adc"):
        part, number = state.parts.get(operands[1]), state.registers.get(to)
    else:
        number = _number(name, operands, state)
    if part is None:
        return None
    other = state.parts.get(operands[1]) if name in ("sub", "cp", "cpc") else None
    if other is not None:
        _difference_of(name, to, part, other, state, registers, flags)
        return None
    if number is None or name in ("cp", "cpc"):
        return None
    if name in ("add", "subi", "sub", "inc", "dec"):
        if part.high:
            return None
        new[to] = part._replace(more=part.more + number & 0xFFFF)
        return None if name in ("inc", "dec") else (part, number, name != "add")
    low_before, added, is_borrow = state.carried or (None, 0, False)
    if part.high and low_before == part._replace(high=False) and is_borrow == (name != "adc"):
        whole = part._replace(more=part.more + added + (number << 8) & 0xFFFF)
        new[to] = whole
        low = part._replace(more=part.more + added & 0xFFFF, high=False)
        new.update({r: whole._replace(high=False) for r, one in list(new.items()) if one == low})
    return None


def _number(name: str, operands: tuple[int, ...], state: State) -> int | None:
    """What an instruction adds, if that is known."""
    if name in ("inc", "dec"):
        return 1 if name == "inc" else -1
    number = operands[1] if name in ("subi", "sbci") else state.registers.get(operands[1])
    return number if number is None or name in ("add", "adc") else -number


def _difference_of(
    name: str, to: int, one: Part, other: Part, state: State, registers: dict[int, int], flags: dict[str, bool]
) -> None:
    """What is known of the difference of two bytes of the same word."""
    if one.word != other.word or one.high != other.high:
        return
    more = one.more - other.more & 0xFFFF
    if not one.high and name in ("sub", "cp"):
        flags["Z"] = more & 0xFF == 0
        if flags["Z"]:
            flags["C"] = False
        if name == "sub":
            registers[to] = more & 0xFF
    elif one.high and name == "cpc" and state.flags.get("Z") is False:
        flags["Z"] = False
    elif one.high and name == "cpc" and "Z" in state.flags and state.flags.get("C") is False and more & 0xFF == 0:
        flags["Z"] = more == 0


def _pointer(name: str, operands: tuple[int, ...], state: State) -> Iterator[tuple[int, int]]:
    """The pair of registers with which an instruction steps on through memory."""
    low, change = operands[:2] if name == "st" else operands[1:3] if name in ("ld", "lpm") else (0, 0)
    held = state.word(low)
    if change and held is not None:
        moved = held + change & 0xFFFF
        yield from (
            (r, byte) for r, byte in ((low, moved & 0xFF), (low + 1, moved >> 8)) if name == "st" or r != operands[0]
        )


def _byte(name: str, operands: tuple[int, ...], state: State, registers: dict[int, int]) -> dict[str, bool]:
    """The flags behind an instruction of BYTES; what it writes goes to `registers`."""
    kind = BYTES[name]
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
