"""The core alone does what is recorded of every instruction (vectors/README.md); and that is what the AVR instruction
set manual (DS40002198) says: opcodes and cycles by its tables, results and flags of arithmetic by its equations."""

from __future__ import annotations

import itertools
import os
import random
import zlib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from avr_timing.flow.instructions import BRANCHES, SKIPS, decode
from sim_bridge.tests.boards.avr.vectors.record import HERE, build, printed, recorded

# The tests may lie in a copy of the package below the checkout.
CORE = next(
    f for parent in HERE.parents if (f := parent / "sim_bridge/boards/avr/core").joinpath("avr_core.h").exists()
)
SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
ROUNDS, PROGRAMS = 30, 40  # of programs that QEMU executes too

Numbers = npt.NDArray[np.int64]
C, Z = 0, 1  # bits of SREG
# Before arithmetic: of C and Z all, of the others both (cases.c).
FLAGS = (0x00, 0xFD, 0x02, 0xFF)


@cache
def part(title: str) -> list[str]:
    """The lines behind the one that begins with that title."""
    (found,) = (text for text in recorded().split("# ") if text.startswith(title))
    return found.splitlines()[1:]


def checksums(title: str) -> Iterator[tuple[str, list[int]]]:
    """Of each instruction its checksums."""
    for line in part(title):
        name, values = line.split(":")
        yield name, [int(value, 16) for value in values.split()]


# ---- the core ----


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program that prints what the core does."""
    sanitizers = SANITIZERS if os.environ.get("BOEBOT_SANITIZED") else []
    sources = [str(HERE / "core_machine.c"), *map(str, CORE.glob("*.c"))]
    return build(tmp_path_factory.mktemp("core") / "vectors", [f"-I{CORE}", *sanitizers, *sources])


def difference(ours: str, theirs: str) -> str:
    """The first line that differs; of a line of checksums, which one."""
    for ours_line, theirs_line in itertools.zip_longest(ours.splitlines(), theirs.splitlines(), fillvalue=""):
        if ours_line == theirs_line:
            continue
        name, colon, _ = theirs_line.partition(": ")
        pairs = zip(ours_line.split()[1:], theirs_line.split()[1:], strict=False)
        which = [number for number, (one, other) in enumerate(pairs) if one != other]
        if colon and len(which) and len(theirs_line) > 120:
            return f"{name}: the checksum of number {which[0]} differs (vectors.c says how to print what is behind it)"
        return f"{ours_line!r}, expected {theirs_line!r}"
    return ""


def test_the_core_does_what_is_recorded(core: Path) -> None:
    assert difference(printed(core), recorded()) == ""


@pytest.mark.soak
@pytest.mark.unsanitized
def test_the_core_does_what_qemu_does(core: Path, tmp_path: Path) -> None:
    qemu = build(tmp_path / "vectors", [str(HERE / "qemu_machine.c")])
    assert difference(printed(core, "witness"), printed(qemu, "witness")) == ""
    first = random.randrange(1 << 32)
    for seed in range(first, first + PROGRAMS):
        arguments = ("witness", str(seed), str(ROUNDS))
        assert difference(printed(core, *arguments), printed(qemu, *arguments)) == ""


# ---- opcodes and cycles ----


def test_the_opcodes_are_those_of_the_chip() -> None:
    recorded_ones: set[int] = set()
    for line in part("opcodes"):
        first, _, last = line.partition("-")
        recorded_ones.update(range(int(first, 16), int(last or first, 16) + 1))
    ours = {opcode for opcode in range(0x10000) if decode(opcode.to_bytes(2, "little") + b"\0\0", 0)}
    # Reserved, and nothing is recorded of them; the chip executes 0xFFFF as SBRS r31,7.
    without = {opcode for opcode in range(0x10000) if opcode & 0xF808 == 0xF808}
    assert recorded_ones - without == ours - without
    assert 0xFFFF in recorded_ones


def test_cycles_are_those_of_the_manuals_tables() -> None:
    for line in part("cases"):
        (at, opcode, *_, flags), (*_, end, cycles) = (half.split() for half in line.split(" > "))
        number = 0xFFF7 if opcode == "FFFF" else int(opcode, 16)
        instruction = decode(number.to_bytes(2, "little") + b"\0\0", 0)
        assert instruction is not None
        expected = instruction.cycles
        if instruction.mnemonic in SKIPS:  # and 1 for each word that is skipped
            expected += int(end, 16) - int(at.rstrip(":"), 16) - 1
        elif instruction.mnemonic in BRANCHES:
            expected += flags[7 - (number & 7)].isupper() == ("BRBS" in line)
        assert int(cycles) == expected, line


# ---- results and flags ----


def bit(value: Numbers, number: int) -> Numbers:
    """0 or 1."""
    return value >> number & 1


def no(value: Numbers) -> Numbers:
    """1 where it is 0."""
    return 1 - value


def flags_of(before: Numbers, top: int, result: Numbers, **changed: Numbers | int) -> Numbers:
    """The flags after an instruction: Z and N of its result, S = N xor V, those that are given; the others stay."""
    flags = {"Z": (result == 0).astype(np.int64), "N": bit(result, top), **changed}
    if "V" in flags:
        flags["S"] = flags["N"] ^ flags["V"]
    after = before.copy()
    for name, value in flags.items():
        number = "CZNVSHTI".index(name)
        after = after & ~(1 << number) | value << number
    return after


Result = tuple[Numbers, Numbers]
Operation = Callable[[Numbers, Numbers, Numbers], Result]


def add(d: Numbers, r: Numbers, f: Numbers, carry: Numbers | int = 0) -> Result:
    """ADD, ADC: "H: Rd3 Rr3 + Rr3 /R3 + /R3 Rd3" and so on."""
    result = d + r + carry & 0xFF

    def carried(n: int) -> Numbers:
        return bit(d, n) & bit(r, n) | bit(r, n) & no(bit(result, n)) | no(bit(result, n)) & bit(d, n)

    d7, r7, s7 = bit(d, 7), bit(r, 7), bit(result, 7)
    overflow = d7 & r7 & no(s7) | no(d7) & no(r7) & s7
    return result, flags_of(f, 7, result, H=carried(3), C=carried(7), V=overflow)


def subtract(d: Numbers, r: Numbers, f: Numbers, carry: Numbers | int = 0) -> Result:
    """SUB, SUBI, CP, CPI: "H: /Rd3 Rr3 + Rr3 R3 + R3 /Rd3" and so on."""
    result = d - r - carry & 0xFF

    def borrowed(n: int) -> Numbers:
        return no(bit(d, n)) & bit(r, n) | bit(r, n) & bit(result, n) | bit(result, n) & no(bit(d, n))

    d7, r7, s7 = bit(d, 7), bit(r, 7), bit(result, 7)
    overflow = d7 & no(r7) & no(s7) | no(d7) & r7 & s7
    return result, flags_of(f, 7, result, H=borrowed(3), C=borrowed(7), V=overflow)


def with_carry(d: Numbers, r: Numbers, f: Numbers) -> Result:
    """SBC, SBCI, CPC: "Z: previous value remains unchanged when the result is zero; cleared otherwise"."""
    result, flags = subtract(d, r, f, bit(f, C))
    return result, flags & ~(1 << Z) | (result == 0).astype(np.int64) * bit(f, Z) << Z


def compared(operation: Operation) -> Operation:
    """Only the flags."""
    return lambda d, r, f: (d, operation(d, r, f)[1])


def logic(operation: Callable[[Numbers, Numbers], Numbers]) -> Operation:
    """AND, OR, EOR: V is cleared."""
    return lambda d, r, f: (operation(d, r), flags_of(f, 7, operation(d, r), V=0))


def signed(value: Numbers) -> Numbers:
    """Two's complement."""
    return value - 2 * (value & 0x80)


def product(of_d: bool, of_r: bool, shift: int) -> Operation:
    """MUL and its like: "C: R15" or, before the shift to the left, "R16"; Z; signed or unsigned operands."""

    def multiply(d: Numbers, r: Numbers, f: Numbers) -> Result:
        exact = (signed(d) if of_d else d) * (signed(r) if of_r else r)
        result = exact << shift & 0xFFFF
        flags = f & ~(1 << C | 1 << Z) | bit(exact, 15) << C | (result == 0).astype(np.int64) << Z
        return result, flags

    return multiply


def shifted(d: Numbers, f: Numbers, top: Numbers) -> Result:
    """ASR, LSR, ROR: "C: Rd0", "V: N xor C, for N and C after the shift"."""
    result = d >> 1 | top << 7
    return result, flags_of(f, 7, result, C=bit(d, 0), V=bit(result, 7) ^ bit(d, 0))


def negated(d: Numbers, _: Numbers, f: Numbers) -> Result:
    """NEG: "H: R3 + Rd3", "V: R = 0x80", "C: R is not 0x00"."""
    result = -d & 0xFF
    half = bit(result, 3) | bit(d, 3)
    return result, flags_of(f, 7, result, H=half, V=1 * (result == 0x80), C=1 * (result != 0))


def word(sign: int) -> Operation:
    """ADIW: "V: /Rdh7 R15", "C: /R15 Rdh7"; SBIW: "V: Rdh7 /R15", "C: R15 /Rdh7"."""

    def count(d: Numbers, k: Numbers, f: Numbers) -> Result:
        result = d + sign * k & 0xFFFF
        rises, falls = no(bit(d, 15)) & bit(result, 15), bit(d, 15) & no(bit(result, 15))
        v, c = (rises, falls) if sign > 0 else (falls, rises)
        return result, flags_of(f, 15, result, V=v, C=c)

    return count


MANUAL: dict[str, Operation] = {
    "ADD": add,
    "ADC": lambda d, r, f: add(d, r, f, bit(f, C)),
    "SUB": subtract,
    "SUBI": subtract,
    "SBC": with_carry,
    "SBCI": with_carry,
    "CP": compared(subtract),
    "CPI": compared(subtract),
    "CPC": compared(with_carry),
    "AND": logic(np.bitwise_and),
    "ANDI": logic(np.bitwise_and),
    "OR": logic(np.bitwise_or),
    "ORI": logic(np.bitwise_or),
    "EOR": logic(np.bitwise_xor),
    "MUL": product(False, False, 0),
    "MULS": product(True, True, 0),
    "MULSU": product(True, False, 0),
    "FMUL": product(False, False, 1),
    "FMULS": product(True, True, 1),
    "FMULSU": product(True, False, 1),
    "COM": lambda d, _, f: (0xFF - d, flags_of(f, 7, 0xFF - d, V=0, C=1)),
    "NEG": negated,
    "SWAP": lambda d, _, f: (d >> 4 | d << 4 & 0xF0, f),
    "INC": lambda d, _, f: (d + 1 & 0xFF, flags_of(f, 7, d + 1 & 0xFF, V=1 * (d + 1 == 0x80))),
    "DEC": lambda d, _, f: (d - 1 & 0xFF, flags_of(f, 7, d - 1 & 0xFF, V=1 * (d - 1 == 0x7F))),
    "ASR": lambda d, _, f: shifted(d, f, bit(d, 7)),
    "LSR": lambda d, _, f: shifted(d, f, 0 * d),
    "ROR": lambda d, _, f: shifted(d, f, bit(f, C)),
    "ADIW": word(1),
    "SBIW": word(-1),
}
VALUES, ALL_FLAGS = np.arange(256, dtype=np.int64), np.array(FLAGS, np.int64)


def rows(name: str) -> Iterator[tuple[Numbers, Numbers, Numbers]]:
    """Rd, Rr or K, and the flags of each checksum, in the order of cases.c."""
    if name in ("ADIW", "SBIW"):
        for k in range(64):
            yield np.arange(0x10000, dtype=np.int64), np.full(1, k, np.int64), np.full(1, FLAGS[k % 4], np.int64)
    elif name in ("COM", "NEG", "SWAP", "INC", "DEC", "ASR", "LSR", "ROR"):
        for number in range(256):
            yield VALUES, VALUES, np.full(256, number, np.int64)
    else:
        columns, flags = np.tile(VALUES, 4), np.repeat(ALL_FLAGS, 256)
        for row in range(256):
            fixed = np.full(1024, row, np.int64)
            yield (columns, fixed, flags) if name.endswith("I") else (fixed, columns, flags)


@pytest.mark.parametrize("name", MANUAL)
def test_arithmetic_is_that_of_the_manuals_equations(name: str) -> None:
    found = dict(checksums("checksums of all results"))[name]
    wide = "MUL" in name or name.endswith("IW")
    for row, (d, r, flags) in enumerate(rows(name)):
        result, after = MANUAL[name](d, r, flags)
        cells = [result & 0xFF, result >> 8, after] if wide else [result, after]
        text = np.stack([np.broadcast_to(cell, d.shape) for cell in cells], axis=1).astype(np.uint8).tobytes()
        assert zlib.crc32(text) == found[row], row


def test_other_instructions_leave_the_flags() -> None:
    reach_flags = {name.lower() for name in MANUAL} | {"bst", "reti", "out", "st", "std", "sts"}
    for line in part("cases"):
        (_, opcode, *_, before), (*_, after, _, _) = (half.split() for half in line.split(" > "))
        instruction = decode(bytes.fromhex(opcode)[::-1] + b"\0\0", 0)
        if instruction and instruction.mnemonic not in reach_flags and " BSET " not in line and " BCLR " not in line:
            assert after == before, line
