"""Bounds of loops that show in the machine code itself: those that the compiler and its library make.

The source has no place for an annotation of them: copies of structures, delays, shifts, divisions, `ATOMIC_BLOCK`.
Two kinds are found: loops whose every pass counts a register down that nothing else in the loop writes, from a known
value; and loops that end after a few passes, executed one by one with the values that are known. Shifts by a variable
count are bounded by the language: a count of at least the width of the operand is undefined (C11, 6.5.7).
"""

from __future__ import annotations

from avr_timing.flow.constants import Known, State, keeps_flags, once_round
from avr_timing.flow.loops import Loop
from avr_timing.flow.registers import is_call, written
from avr_timing.program import Block, Function, Instruction, Program

MOST = 1 << 16  # passes that are tried; longer loops have other counters
MOST_EXECUTED = 1024  # passes
SHIFTS = frozenset(("lsr", "ror", "asr", "add", "adc"))  # lsl and rol are an add and adc of a register to itself


def by_counter(loop: Loop[int], known: Known, program: Program) -> int | None:
    """How often the header runs at most for each entry of the loop, by its counter; None: it has none."""
    function = known.function
    entering = _entering(loop, known)
    inner = frozenset(node for each in loop.inner for node in each.nodes)
    found: list[int] = []
    for start in loop.nodes - inner:
        block = function.blocks[start]
        if any(edge.to not in loop.nodes for edge in block.edges) and in_every_pass(start, loop, function):
            count = _counted(block, loop, known, entering, program)
            if count is not None:
                found.append(count)
    return min(found, default=None)


def by_execution(loop: Loop[int], known: Known) -> int | None:
    """The same by executing the passes one by one, until no way leads back to the header with the known registers and
    flags. None: that does not happen, or not soon."""
    counts = [_executed(loop, known.function, state) for state in _entering(loop, known)]
    return None if None in counts else max((count for count in counts if count is not None), default=None)


def _executed(loop: Loop[int], function: Function, state: State) -> int | None:
    for count in range(1, MOST_EXECUTED + 1):
        after, decided = once_round(function, loop.header, loop.nodes, state)
        if after is None:
            return count
        if after == state or not decided:  # all passes are like this one, or may be for all that is known
            return None
        state = after
    return None


def _entering(loop: Loop[int], known: Known) -> list[State]:
    """What is known on each way into a loop."""
    blocks = [block for start, block in known.function.blocks.items() if start not in loop.nodes]
    entering = [block for block in blocks if any(edge.to == loop.header for edge in block.edges)]
    found = [known.behind(block, loop.header) for block in entering]
    if loop.header == known.function.entry:
        found.append(State(dict(known.context)))
    return found


def in_every_pass(start: int, loop: Loop[int], function: Function) -> bool:
    """Without it there is no way from the header back to the header."""
    if start == loop.header:
        return True
    seen = {loop.header}
    work = [loop.header]
    while work:
        for edge in function.blocks[work.pop()].edges:
            if edge.to == loop.header:
                return False
            if edge.to in loop.nodes and edge.to != start and edge.to not in seen:
                seen.add(edge.to)
                work.append(edge.to)
    return True


def _counted(block: Block, loop: Loop[int], known: Known, entering: list[State], program: Program) -> int | None:
    branch = block.instructions[-1]
    if branch.mnemonic not in ("brne", "breq", "brpl", "brmi", "brcc", "brcs") or len(block.edges) != 2:
        return None
    counting = _counting(block.instructions[:-1])
    if counting is None:
        return None
    registers, step, instructions = counting
    if branch.mnemonic in ("brcc", "brcs") and instructions[-1].mnemonic == "dec":  # which keeps C
        return None
    for start in loop.nodes:
        for instruction in known.function.blocks[start].instructions:
            if instruction in instructions:
                continue
            changed = program.clobbered(known.function.blocks[start]) if is_call(instruction) else None
            if not (written(instruction) if changed is None else changed).isdisjoint(registers):
                return None
    stays = branch.operands[-1] in loop.nodes
    counts: list[int] = []
    for state in entering:
        held = state.registers
        if not held.keys() >= set(registers):
            return _shift(loop, known.function, instructions)
        value = sum(held[register] << 8 * i for i, register in enumerate(registers))
        count = _runs(value, step, 8 * len(registers), branch.mnemonic, stays)
        if count is None:
            return None
        counts.append(count)
    return max(counts, default=None)


def _counting(
    instructions: tuple[Instruction, ...],
) -> tuple[tuple[int, ...], int, tuple[Instruction, ...]] | None:
    """The counter whose flags the branch behind these instructions reads: its registers, the lowest first, which need
    not stand together; its step; its instructions."""
    rest = list(instructions)
    while rest and keeps_flags(rest[-1]):
        rest.pop()
    if not rest:
        return None
    last = rest[-1]
    if last.mnemonic == "dec":
        return last.operands[:1], 1, (last,)
    if last.mnemonic == "sbiw":
        return (last.operands[0], last.operands[0] + 1), last.operands[1], (last,)
    chain = [rest.pop()]
    while rest and chain[0].mnemonic == "sbci":
        chain.insert(0, rest.pop())
    registers = tuple(each.operands[0] for each in chain if each.mnemonic in ("subi", "sbci"))
    if chain[0].mnemonic != "subi" or len(set(registers)) < len(chain):
        return None
    return registers, sum(each.operands[1] << 8 * i for i, each in enumerate(chain)), tuple(chain)


def _runs(value: int, step: int, bits: int, branch: str, stays: bool) -> int | None:
    """How often `value -= step` runs until the branch leaves the loop."""
    mask = (1 << bits) - 1
    if branch == "brne" and stays and step == 1:
        return value or mask + 1
    for count in range(1, MOST + 1):
        borrow = value < step
        value = value - step & mask
        flag = {"ne": value != 0, "eq": value == 0, "cc": not borrow, "cs": borrow}.get(branch[2:])
        if flag is None:
            flag = (value >> (bits - 1) == 0) == (branch == "brpl")
        if flag != stays:
            return count
    return None


def _shift(loop: Loop[int], function: Function, counting: tuple[Instruction, ...]) -> int | None:
    """Of a loop that does nothing but shift an operand: a test before the shift runs once more than the shift."""
    shifts = 0
    for start in loop.nodes:
        for instruction in function.blocks[start].instructions:
            if instruction.mnemonic in SHIFTS:
                doubles = instruction.mnemonic in ("add", "adc")
                if doubles and instruction.operands[0] != instruction.operands[1]:
                    return None
                shifts += 1
            elif instruction not in counting and instruction.mnemonic not in ("rjmp", "brne", "brpl", "brmi"):
                return None
    if counting[0].mnemonic != "dec" or shifts not in (1, 2, 3, 4):
        return None
    header = function.blocks[loop.header].instructions
    tests = 0 if any(instruction.mnemonic in SHIFTS for instruction in header) else 1
    return (32 if shifts > 2 else 16) - 1 + tests  # int is the least width that C shifts
