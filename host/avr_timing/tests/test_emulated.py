"""Static bounds beside the emulator: the same programs measured, at random inputs and at those that drive the worst."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from avr_image import MARKS
from avr_timing.bounds.stack import Stack
from avr_timing.bounds.wcet import WorstCase
from avr_timing.flow.graph import load_program
from avr_timing.interrupts.interrupts_off import InterruptsOff
from avr_timing.program import Program
from sim_bridge.boards.avr import create
from sim_bridge.boards.board import Level
from sim_bridge.tests.boards.access import BoardAccess

PIN = 13  # PB5
INPUT = 0x700  # of the programs in data memory, far from variables and stack
CYCLES = 400_000
CALL, CLEAR = 4, 2  # `call`, and the `cbi` that ends the measured span

HEAD = (
    """
#define __SFR_OFFSET 0
#include <avr/io.h>
"""
    + MARKS
    + """
.global main
main: sbi DDRB, 5
 ldi r26, lo8(0x700)
 ldi r27, hi8(0x700)
 ld r24, X+
 ld r25, X+
 ld r22, X+
 ld r23, X+
 ld r18, X+
 ld r19, X+
 ld r20, X+
 ld r21, X+
 sbi PORTB, 5
 call f
 cbi PORTB, 5
1: rjmp 1b
.type f, @function
"""
)
# CRC-8 of 8 bytes at X: the longer way in each bit is that with a carry.
CRC = """f: ldi r18, 0
1: ld r19, X+
 eor r18, r19
 ldi r20, 8
2: lsl r18
 brcc 3f
 eor r18, r24
3: dec r20
 brne 2b
 bounded 8
 dec r25
 brne 1b
 ret
"""
# Looks for r22 in r18 bytes, 31 at most; leaves when it is found.
SEARCH = """f: mov r20, r18
 andi r20, 31
1: tst r20
 breq 9f
 bounded 31
 dec r20
 ld r19, X+
 cp r19, r22
 brne 1b
 push r20
 pop r20
9: ret
"""
# Sums a triangle of products, with a call in the inner loop.
TRIANGLE = """f: ldi r20, 0
1: inc r20
 mov r21, r20
2: bounded 6
 rcall g
 dec r21
 brne 2b
 bounded 6
 cpi r20, 6
 brne 1b
 clr r1
 ret
.type g, @function
g: mul r20, r21
 add r24, r0
 sbrc r24, 0
 lds r23, 256
 ret
"""
DIVIDE = "f: jmp __udivmodhi4\n"
DIVIDE_LONG = "f: call __udivmodsi4\n clr r1\n ret\n"
MULTIPLY = "f: call __mulsi3\n ret\n"
SHIFT = """f: andi r24, 15
 rjmp 2f
1: lsl r22
 rol r23
2: dec r24
 brpl 1b
 ret
"""


EEPROM = """f: sbi EECR, EERE
 nop
 sbi EECR, EEMPE
 sbi EECR, EEPE
 ret
"""


def build(folder: Path, source: str) -> Path:
    """The image of a program in assembler."""
    program, image = folder / "program.S", folder / "program.elf"
    program.write_text(HEAD + source, encoding="ascii")
    command = ["avr-gcc", "-mmcu=atmega328p", "-o", str(image), str(program)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return image


def measured(image: Path, given: Sequence[int]) -> int:
    """Cycles of `f` with these bytes as its input."""
    board = BoardAccess(create(image))
    board.write_memory(INPUT, bytes(given))
    return span(board)


def span(board: BoardAccess) -> int:
    """Cycles of `f` in a board that is about to run it."""
    board.run(CYCLES)
    edges = [edge for edge in board.log() if edge.pin == PIN]
    (high,) = [edge.cycle for edge in edges if edge.level == Level.HIGH]
    low = [edge.cycle for edge in edges if edge.level == Level.LOW and edge.cycle > high]
    return low[0] - high - CALL - CLEAR


def bound(program: Program) -> int:
    return WorstCase(program).of("f").cycles


@pytest.mark.parametrize(
    ("source", "worst"),
    [
        # r24 = 1: what is shifted out comes back in, and ones give a carry every time: 0xFF, and zeros after it.
        (CRC, [1, 8, 0, 0, 0, 0, 0, 0, 0xFF, 0, 0, 0, 0, 0, 0, 0]),
        (SEARCH, [0, 0, 1, 0, 31, 0, 0, 0, *[0] * 30, 1]),
        (DIVIDE, [0xFF, 0xFF, 1, 0]),  # 65,535 / 1: every bit of the quotient is one
        (DIVIDE_LONG, [0xFF, 0xFF, 0xFF, 0xFF, 1, 0, 0, 0]),
        (MULTIPLY, []),
        (SHIFT, [15, 0, 0, 0]),
        (EEPROM, []),
    ],
    ids=["crc", "search", "16-bit division", "32-bit division", "multiplication", "shift", "EEPROM"],
)
def test_bound_is_what_the_worst_input_takes(tmp_path: Path, source: str, worst: list[int]) -> None:
    image = build(tmp_path, source)
    assert measured(image, worst) == bound(load_program(image))


@pytest.mark.parametrize(
    ("old", "new", "more"),
    [("eor r18, r24", "nop\n eor r18, r24", 64), ("dec r25", "nop\n dec r25", 8), ("eor r18, r19", "rcall h", 8 * 7)],
)
def test_planted_change_costs_what_the_bound_says(tmp_path: Path, old: str, new: str, more: int) -> None:
    worst = [1, 8, 0, 0, 0, 0, 0, 0, 0xFF, 0, 0, 0, 0, 0, 0, 0]
    times = []
    for source in (CRC, CRC.replace(old, new)):
        image = build(tmp_path, source + "h: eor r18, r19\n ret\n")
        assert measured(image, worst) == bound(load_program(image))
        times.append(bound(load_program(image)))
    assert times[1] - times[0] == more


@pytest.mark.parametrize("source", [CRC, SEARCH, TRIANGLE, DIVIDE, DIVIDE_LONG, SHIFT])
def test_no_input_takes_longer(tmp_path: Path, source: str) -> None:
    image = build(tmp_path, source)
    most = bound(load_program(image))
    chance = random.Random(1)
    for _ in range(12):
        given = [*chance.randbytes(64)]
        given[1] = 8 if source == CRC else given[1]
        if source in (DIVIDE, DIVIDE_LONG):
            given[:4] = [chance.choice((0, 1, 255)) for _ in range(4)]
        assert measured(image, given) <= most


# Timer1 counts every cycle and comes when it has counted r24: its interrupt lets others in, and then runs deepest.
NESTED = """f: push r2
 call deep
 pop r2
 ldi r18, 0
 sts TCCR1A, r18
 ldi r18, 1
 sts OCR1AH, r1
 sts OCR1AL, r24
 sts OCR1BH, r1
 sts OCR1BL, r25
 sts TCCR1B, r18
 ldi r18, 6
 sts TIMSK1, r18
 call deep
 sei
 call deeper
 cli
 ret
deep: push r3
 push r4
 pop r4
 pop r3
 ret
deeper: push r3
 push r4
 push r5
 ldi r18, 0
1: dec r18
 brne 1b
 pop r5
 pop r4
 pop r3
 ret
.global TIMER1_COMPA_vect
TIMER1_COMPA_vect: push r16
 in r16, SREG
 push r16
 sei
 push r17
 ldi r17, 60
1: dec r17
 brne 1b
 pop r17
 pop r16
 out SREG, r16
 pop r16
 reti
.global TIMER1_COMPB_vect
TIMER1_COMPB_vect: push r0
 rcall .+0
 rcall .+0
 pop r0
 pop r0
 pop r0
 pop r0
 pop r0
 reti
"""
PAINT = 0xA5


def test_stack_goes_as_deep_as_bounded_with_nested_interrupts(tmp_path: Path) -> None:
    """COMPA comes within `deeper`, COMPB within COMPA: the lowest byte of the stack that is not as painted."""
    image = build(tmp_path, NESTED)
    board = BoardAccess(create(image))
    board.write_memory(INPUT, bytes((120, 200, *[1] * 6)))
    board.write_memory(0x800, bytes([PAINT]) * 0x100)
    board.run(CYCLES)
    memory = board.read_memory(0x800, 0x100)
    lowest = next(address for address, byte in enumerate(memory, 0x800) if byte != PAINT)
    assert 0x900 - lowest == Stack(load_program(image)).image()


# Interrupts off for a while, once a round of 8 + the stretch: each interrupt stores how late it is.
LATE = """f: sts TCCR1A, r1
 ldi r16, 0
 ldi r17, 255
 ldi r18, 0x09
 sts OCR1AH, r1
 sts OCR1AL, r24
 sts TCCR1B, r18
 ldi r18, 2
 sts TIMSK1, r18
 sei
1: nop
 cli
{off} sei
 nop
 nop
 nop
 nop
 rjmp 1b
.global TIMER1_COMPA_vect
TIMER1_COMPA_vect: lds r20, TCNT1L
 cp r20, r16
 brlo 1f
 mov r16, r20
 sts 0x600, r16
1: cp r20, r17
 brsh 2f
 mov r17, r20
 sts 0x601, r17
2: reti
"""


@pytest.mark.parametrize("length", [0, 1, 2, 17])
def test_interrupt_is_as_late_as_the_longest_stretch(tmp_path: Path, length: int) -> None:
    """The timer's clear on compare counts from the request; the earliest is one that comes when it is awaited.

    Nothing but one-cycle instructions is outside the stretch but for the `rjmp`, so that every delay from none to the
    longest occurs. A request in the first cycle of a stretch of n waits for the n - 1 others.
    """
    image = build(tmp_path, LATE.format(off=" nop\n" * length))
    stretch = InterruptsOff(load_program(image)).of("f").cycles
    assert stretch == length + 3
    late: list[int] = []
    for period in range(200, 230):  # so that they meet in every phase
        board = BoardAccess(create(image))
        board.write_memory(INPUT, bytes((period,)))
        board.run(60_000)
        late += board.read_memory(0x600, 2)
    assert max(late) - min(late) == stretch - 1
