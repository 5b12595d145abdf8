"""The global interrupt flag (bit I of SREG) from instruction to instruction, and where copies of it are kept.

Data sheet of the ATmega328P, section 7.7: `cli` works at once; behind what sets the flag one more instruction runs
before an interrupt can come. `ATOMIC_BLOCK` and interrupts copy SREG into a register, onto the stack or into the frame
and write it back: such copies are followed, so that it is known which state comes back.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from avr_timing.flow.registers import SREG, pushes_only, written
from avr_timing.program import Instruction

FRAME = 28  # Y, avr-gcc's frame pointer


class Flag(Enum):
    """Whether an interrupt can come before the next instruction."""

    OFF = "off"
    ONE_MORE = "one more instruction first"
    JUST_ON = "on, since this instruction"  # one interrupt can come, and return to run the next instruction
    ON = "on"

    __hash__ = object.__hash__  # nodes of graphs hold them: several times as fast as that of Enum

    @property
    def blocks(self) -> bool:
        """No interrupt can come."""
        return self in (Flag.OFF, Flag.ONE_MORE)


# A place: ("register", number), ("stack", how many pushes before it), ("frame", offset from Y)
_Place = tuple[str, int]


class State(NamedTuple):
    """Before an instruction: the flag, the copies of it that are known (True: on), and how much has been pushed."""

    flag: Flag
    copies: frozenset[tuple[_Place, bool]] = frozenset()
    pushed: int = 0


def after(instruction: Instruction, state: State, clobbered: frozenset[int] | None = None) -> list[State]:
    """The states that can follow; two where SREG is written and it is not known with what.

    Of a call this is what holds when it has begun, but for the registers that its callee writes (`clobbered`; None:
    all that the calling convention lets it); what it does to the flag is for the caller to know.
    """
    name, operands = instruction.mnemonic, instruction.operands
    on = state.flag is not Flag.OFF
    flags = [{Flag.ONE_MORE: Flag.JUST_ON, Flag.JUST_ON: Flag.ON}.get(state.flag, state.flag)]
    if name == "cli":
        flags = [Flag.OFF]
    elif name == "sei":
        flags = [_set(state.flag)]
    elif name == "out" and operands[0] == SREG:
        copy = dict(state.copies).get(("register", operands[1]))
        flags = ([_set(state.flag)] if copy is not False else []) + ([Flag.OFF] if copy is not True else [])
    copies, pushed = _copies(instruction, state, on, written(instruction) if clobbered is None else clobbered)
    return [State(flag, copies, pushed) for flag in flags]


def _set(flag: Flag) -> Flag:
    if flag is Flag.OFF:
        return Flag.ONE_MORE
    return Flag.JUST_ON if flag is Flag.ONE_MORE else Flag.ON


def _copies(
    instruction: Instruction, state: State, on: bool, lost: frozenset[int]
) -> tuple[frozenset[tuple[_Place, bool]], int]:
    name, operands = instruction.mnemonic, instruction.operands
    old, pushed = dict(state.copies), state.pushed
    new = {place: value for place, value in old.items() if place[0] != "register" or place[1] not in lost}
    if lost & {FRAME, FRAME + 1}:
        new = {place: value for place, value in new.items() if place[0] != "frame"}
    if name == "in" and operands[1] == SREG:
        new["register", operands[0]] = on
    elif name in ("mov", "movw"):
        for i in range(1 if name == "mov" else 2):
            _move(("register", operands[1] + i), ("register", operands[0] + i), old, new)
    elif name == "push":
        _move(("register", operands[0]), ("stack", pushed), old, new)
        pushed += 1
    elif name == "pop":
        pushed -= 1
        _move(("stack", pushed), ("register", operands[0]), old, new)
        new.pop(("stack", pushed), None)
    elif pushes_only(instruction):
        pushed += 2
    elif name in ("std", "st") and operands[0] == FRAME and (name == "std" or operands[1] == 0):
        _move(("register", operands[2]), ("frame", operands[1]), old, new)
    elif name in ("ldd", "ld") and operands[1] == FRAME and (name == "ldd" or operands[2] == 0):
        _move(("frame", operands[2]), ("register", operands[0]), old, new)
    return frozenset(new.items()), pushed


def _move(source: _Place, to: _Place, old: dict[_Place, bool], new: dict[_Place, bool]) -> None:
    new.pop(to, None)
    if source in old:
        new[to] = old[source]
