"""The instructions of the ATmega328P: every opcode, its operands and its cycles.

After the AVR instruction set manual (DS40002198), column AVRe of its cycle tables, and the data sheet's section 31. The
ATmega328P has the AVRe+ set without what needs more than 64 KB of flash: no `eicall`, `eijmp`, `elpm`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from avr_timing.program import Instruction

# One row for each opcode: mnemonic, its bits as in the manual (16 or 32, a letter for each bit of a field), operands in
# the order of the manual's syntax, cycles when the program goes on behind it. An operand is a field's letter with how
# to read it (READINGS below), or a number that is always the same: the pointer register of loads and stores, and after
# it 1 for post-increment, -1 for pre-decrement, 0 for neither.
TABLE = """
nop     0000000000000000                                          1
movw    00000001ddddrrrr                  d:even r:even           1
muls    00000010ddddrrrr                  d:high r:high           2
mulsu   000000110ddd0rrr                  d:high r:high           2
fmul    000000110ddd1rrr                  d:high r:high           2
fmuls   000000111ddd0rrr                  d:high r:high           2
fmulsu  000000111ddd1rrr                  d:high r:high           2
cpc     000001rdddddrrrr                  d r                     1
sbc     000010rdddddrrrr                  d r                     1
add     000011rdddddrrrr                  d r                     1
cpse    000100rdddddrrrr                  d r                     1
cp      000101rdddddrrrr                  d r                     1
sub     000110rdddddrrrr                  d r                     1
adc     000111rdddddrrrr                  d r                     1
and     001000rdddddrrrr                  d r                     1
eor     001001rdddddrrrr                  d r                     1
or      001010rdddddrrrr                  d r                     1
mov     001011rdddddrrrr                  d r                     1
cpi     0011KKKKddddKKKK                  d:high K                1
sbci    0100KKKKddddKKKK                  d:high K                1
subi    0101KKKKddddKKKK                  d:high K                1
ori     0110KKKKddddKKKK                  d:high K                1
andi    0111KKKKddddKKKK                  d:high K                1
ld      1000000ddddd0000                  d 30 0                  2
ld      1000000ddddd1000                  d 28 0                  2
ldd     10q0qq0ddddd0qqq                  d 30 q                  2
ldd     10q0qq0ddddd1qqq                  d 28 q                  2
st      1000001rrrrr0000                  30 0 r                  2
st      1000001rrrrr1000                  28 0 r                  2
std     10q0qq1rrrrr0qqq                  30 q r                  2
std     10q0qq1rrrrr1qqq                  28 q r                  2
lds     1001000ddddd0000kkkkkkkkkkkkkkkk  d k                     2
ld      1001000ddddd0001                  d 30 1                  2
ld      1001000ddddd0010                  d 30 -1                 2
lpm     1001000ddddd0100                  d 30 0                  3
lpm     1001000ddddd0101                  d 30 1                  3
ld      1001000ddddd1001                  d 28 1                  2
ld      1001000ddddd1010                  d 28 -1                 2
ld      1001000ddddd1100                  d 26 0                  2
ld      1001000ddddd1101                  d 26 1                  2
ld      1001000ddddd1110                  d 26 -1                 2
pop     1001000ddddd1111                  d                       2
sts     1001001rrrrr0000kkkkkkkkkkkkkkkk  k r                     2
st      1001001rrrrr0001                  30 1 r                  2
st      1001001rrrrr0010                  30 -1 r                 2
st      1001001rrrrr1001                  28 1 r                  2
st      1001001rrrrr1010                  28 -1 r                 2
st      1001001rrrrr1100                  26 0 r                  2
st      1001001rrrrr1101                  26 1 r                  2
st      1001001rrrrr1110                  26 -1 r                 2
push    1001001rrrrr1111                  r                       2
com     1001010ddddd0000                  d                       1
neg     1001010ddddd0001                  d                       1
swap    1001010ddddd0010                  d                       1
inc     1001010ddddd0011                  d                       1
asr     1001010ddddd0101                  d                       1
lsr     1001010ddddd0110                  d                       1
ror     1001010ddddd0111                  d                       1
dec     1001010ddddd1010                  d                       1
ijmp    1001010000001001                                          2
ret     1001010100001000                                          4
icall   1001010100001001                                          3
reti    1001010100011000                                          4
sleep   1001010110001000                                          1
break   1001010110011000                                          1
wdr     1001010110101000                                          1
lpm     1001010111001000                  0 30 0                  3
spm     1001010111101000                                          1
jmp     1001010kkkkk110kkkkkkkkkkkkkkkkk  k:word                  3
call    1001010kkkkk111kkkkkkkkkkkkkkkkk  k:word                  4
adiw    10010110KKddKKKK                  d:wide K                2
sbiw    10010111KKddKKKK                  d:wide K                2
cbi     10011000AAAAAbbb                  A b                     2
sbic    10011001AAAAAbbb                  A b                     1
sbi     10011010AAAAAbbb                  A b                     2
sbis    10011011AAAAAbbb                  A b                     1
mul     100111rdddddrrrr                  d r                     2
in      10110AAdddddAAAA                  d A                     1
out     10111AArrrrrAAAA                  A r                     1
rjmp    1100kkkkkkkkkkkk                  k:near                  2
rcall   1101kkkkkkkkkkkk                  k:near                  3
ldi     1110KKKKddddKKKK                  d:high K                1
bld     1111100ddddd0bbb                  d b                     1
bst     1111101ddddd0bbb                  d b                     1
sbrc    1111110rrrrr0bbb                  r b                     1
sbrs    1111111rrrrr0bbb                  r b                     1
"""

# BSET, BCLR, BRBS and BRBC are in none of these rows: the manual names them by the flag in SREG, from bit 0 on.
FLAGS = "cznvshti"
IF_SET = ("brcs", "breq", "brmi", "brvs", "brlt", "brhs", "brts", "brie")
IF_CLEAR = ("brcc", "brne", "brpl", "brvc", "brge", "brhc", "brtc", "brid")

# Branches take 1 cycle, and 1 more when taken; skips 1 cycle, and 1 more for each word that is skipped.
BRANCHES = frozenset(IF_SET + IF_CLEAR)
SKIPS = frozenset(("cpse", "sbrc", "sbrs", "sbic", "sbis"))
JUMPS = frozenset(("jmp", "rjmp"))
CALLS = frozenset(("call", "rcall"))
RETURNS = frozenset(("ret", "reti"))


def _relative(value: int, bits: int, address: int) -> int:
    """Byte address of a branch: its field counts words from the next instruction, in two's complement."""
    signed = value - (value >> (bits - 1) << bits)
    return address + 2 + 2 * signed


# The EEPROM's control register, and for how long it halts the CPU when a bit of it is set (data sheet, section 8.6.3).
EECR_IO, EECR_DATA = 0x1F, 0x3F
EEPROM_HALTS = {0: 4, 1: 2}  # EERE begins a read, EEPE a write


def _halt(mnemonic: str, operands: tuple[int, ...]) -> int:
    """Cycles for which the CPU stands still behind an instruction.

    What `out` and `sts` write is not known here: they count as a read, which takes longest. Stores through pointers
    are taken not to reach the EEPROM: else each of them would count four cycles more.
    """
    if mnemonic == "sbi" and operands[0] == EECR_IO:
        return EEPROM_HALTS.get(operands[1], 0)
    writes = (mnemonic == "out" and operands[0] == EECR_IO) or (mnemonic == "sts" and operands[0] == EECR_DATA)
    return max(EEPROM_HALTS.values()) if writes else 0


# How a field becomes an operand: from its value, its width in bits and the address of the instruction.
READINGS: dict[str, Callable[[int, int, int], int]] = {
    "": lambda value, bits, address: value,
    "high": lambda value, bits, address: value + 16,  # r16 to r31, or r16 to r23
    "even": lambda value, bits, address: 2 * value,  # the lower register of a pair
    "wide": lambda value, bits, address: 24 + 2 * value,  # r24, r26, r28, r30
    "near": _relative,
    "word": lambda value, bits, address: 2 * value,
}


@dataclass(frozen=True, slots=True)
class _Operand:
    pieces: tuple[tuple[int, int], ...]  # of the field in the opcode, the highest first: lowest bit, width
    width: int  # of the field; 0: a fixed number
    read: Callable[[int, int, int], int]
    number: int = 0

    def value(self, opcode: int, address: int) -> int:
        if self.width == 0:
            return self.number
        field = 0
        for lowest, width in self.pieces:
            field = field << width | (opcode >> lowest & (1 << width) - 1)
        return self.read(field, self.width, address)


@dataclass(frozen=True, slots=True)
class _Row:
    mnemonic: str
    mask: int  # of the first word
    bits: int
    size: int
    operands: tuple[_Operand, ...]
    cycles: int

    def decode(self, opcode: int, address: int) -> Instruction:
        operands = tuple([operand.value(opcode, address) for operand in self.operands])
        return Instruction(address, self.size, self.mnemonic, operands, self.cycles + _halt(self.mnemonic, operands))


def _operand(text: str, pattern: str) -> _Operand:
    letter, _, reading = text.partition(":")
    if not letter.isalpha():
        return _Operand((), 0, READINGS[""], int(text))
    pieces = tuple((len(pattern) - piece.end(), len(piece[0])) for piece in re.finditer(f"{letter}+", pattern))
    return _Operand(pieces, sum(width for _, width in pieces), READINGS[reading])


def _row(line: str) -> _Row:
    mnemonic, pattern, *operands, cycles = line.split()
    word = pattern[:16]
    mask = int("".join("1" if bit in "01" else "0" for bit in word), 2)
    bits = int("".join("1" if bit == "1" else "0" for bit in word), 2)
    parsed = tuple(_operand(text, pattern) for text in operands)
    return _Row(mnemonic, mask, bits, len(pattern) // 8, parsed, int(cycles))


def _of_flags() -> Iterator[str]:
    """The rows of BSET, BCLR, BRBS and BRBC."""
    for bit, (flag, if_set, if_clear) in enumerate(zip(FLAGS, IF_SET, IF_CLEAR, strict=True)):
        yield f"se{flag} 100101000{bit:03b}1000 1"
        yield f"cl{flag} 100101001{bit:03b}1000 1"
        yield f"{if_set} 111100kkkkkkk{bit:03b} k:near 1"
        yield f"{if_clear} 111101kkkkkkk{bit:03b} k:near 1"


def _by_high_byte() -> tuple[tuple[_Row, ...], ...]:
    """The rows that an opcode with this high byte may be, those with most fixed bits first: `ld` before `ldd`."""
    lines = [*TABLE.strip().splitlines(), *_of_flags()]
    rows = sorted(map(_row, lines), key=lambda row: -row.mask.bit_count())
    return tuple(tuple(row for row in rows if (high << 8 ^ row.bits) & row.mask & 0xFF00 == 0) for high in range(256))


_ROWS = _by_high_byte()


def decode(code: bytes, address: int) -> Instruction | None:
    """The instruction at a byte address of `code`, which begins at address 0.

    None where the opcode is reserved, belongs to other cores only, or is cut off by the end of the code.
    """
    word = int.from_bytes(code[address : address + 2], "little")
    if len(code) < address + 2 or address < 0:
        return None
    for row in _ROWS[word >> 8]:
        if word & row.mask == row.bits:
            break
    else:
        return None
    if row.size == 2:
        return row.decode(word, address)
    if len(code) < address + 4:
        return None
    return row.decode(word << 16 | int.from_bytes(code[address + 2 : address + 4], "little"), address)
