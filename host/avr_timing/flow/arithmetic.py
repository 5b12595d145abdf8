"""Arithmetic of one byte, after the AVR instruction set manual."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Kind:
    """One instruction: from both operands and C, the result, which may leave 0..255, and V."""

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


BYTES = {
    "add": Kind(_more, _sum, carry=_outside),
    "adc": Kind(_more, _sum, carries=True, carry=_outside),
    "sub": Kind(_less, _difference, carry=_outside),
    "subi": Kind(_less, _difference, constant=True, carry=_outside),
    "sbc": Kind(_less, _difference, carries=True, chained=True, carry=_outside),
    "sbci": Kind(_less, _difference, constant=True, carries=True, chained=True, carry=_outside),
    "cp": Kind(_less, _difference, writes=False, carry=_outside),
    "cpi": Kind(_less, _difference, constant=True, writes=False, carry=_outside),
    "cpc": Kind(_less, _difference, carries=True, chained=True, writes=False, carry=_outside),
    "and": Kind(lambda a, b, c: a & b, _never),
    "andi": Kind(lambda a, b, c: a & b, _never, constant=True),
    "or": Kind(lambda a, b, c: a | b, _never),
    "ori": Kind(lambda a, b, c: a | b, _never, constant=True),
    "eor": Kind(lambda a, b, c: a ^ b, _never),
    "com": Kind(lambda a, b, c: 255 - a, _never, operands=1, carry=lambda a, r: True),
    "neg": Kind(lambda a, b, c: -a, lambda a, b, r: r == 0x80, operands=1, carry=_outside),
    "inc": Kind(lambda a, b, c: a + 1, lambda a, b, r: r == 0x80, operands=1),
    "dec": Kind(lambda a, b, c: a - 1, lambda a, b, r: r == 0x7F, operands=1),
    "lsr": Kind(lambda a, b, c: a >> 1, _shifted, operands=1, carry=_lowest),
    "ror": Kind(lambda a, b, c: a >> 1 | c << 7, _shifted, operands=1, carries=True, carry=_lowest),
    "asr": Kind(lambda a, b, c: a >> 1 | a & 0x80, _shifted, operands=1, carry=_lowest),
}
