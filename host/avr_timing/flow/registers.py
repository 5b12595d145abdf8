"""What instructions do beyond the graph: which registers they write.

After the AVR instruction set manual, and the register conventions of avr-gcc: https://gcc.gnu.org/wiki/avr-gcc.
"""

from __future__ import annotations

from functools import cache

from avr_timing.flow.instructions import BRANCHES, JUMPS, SKIPS
from avr_timing.program import Instruction


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


REGISTERS = 32  # at data addresses 0 to 31
SREG = 0x3F  # I/O address
ZERO = 1  # holds zero wherever compiled code does not multiply
CALL_CLOBBERED = frozenset((0, 1, *range(18, 28), 30, 31))
NO_RESULT = BRANCHES | SKIPS | JUMPS | _words("cp cpc cpi tst out sts st std push spm bst sbi cbi")  # with operands
PRODUCTS = _words("mul muls mulsu fmul fmuls fmulsu")
PAIRS = _words("movw adiw sbiw")


def written(instruction: Instruction) -> frozenset[int]:
    """Registers that may be different after it; after a call, those that a callee need not keep."""
    if is_call(instruction):
        return CALL_CLOBBERED
    return frozenset() if pushes_only(instruction) else _results(instruction.mnemonic, instruction.operands)


@cache
def _results(name: str, operands: tuple[int, ...]) -> frozenset[int]:
    if name in PRODUCTS:
        return frozenset((0, 1))
    result: set[int] = set()
    if name not in NO_RESULT and operands:
        result.add(operands[0])
        if name in PAIRS:
            result.add(operands[0] + 1)
    if name in ("ld", "lpm") and operands[-1] in (1, -1):
        result |= {operands[1], operands[1] + 1}
    if name == "st" and operands[1] in (1, -1):
        result |= {operands[0], operands[0] + 1}
    return frozenset(result)


def is_call(instruction: Instruction) -> bool:
    """Calls a function."""
    return instruction.mnemonic in ("call", "rcall", "icall") and not pushes_only(instruction)


def pushes_only(instruction: Instruction) -> bool:
    """`rcall .+0`: calls the next instruction, so that two bytes are on the stack."""
    return instruction.mnemonic == "rcall" and instruction.operands[0] == instruction.address + instruction.size
