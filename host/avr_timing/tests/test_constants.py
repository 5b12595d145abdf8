"""The analysis' arithmetic of known registers and flags beside the emulator's: long chains of random instructions."""

from __future__ import annotations

import random
import subprocess
from pathlib import Path

import pytest

from avr_timing.flow.constants import State, step
from avr_timing.flow.instructions import decode
from boebot.image.elf import read_image
from sim_bridge.boards.avr import create
from sim_bridge.boards.board import Level
from sim_bridge.tests.boards.access import BoardAccess

PIN = 13  # PB5 goes high when the program has ended
STORED = 0x200  # of the program in data memory: from here on the flags and 16 registers after each instruction
LENGTH = 90
FIRST, LAST = 16, 25  # registers in use
FLAGS = {"C": 0, "Z": 1, "N": 2, "V": 3}  # bits of SREG
TWO = ("add", "adc", "sub", "sbc", "cp", "cpc", "and", "or", "eor", "mov")
ONE = ("com", "neg", "inc", "dec", "lsr", "ror", "asr", "swap")
CONSTANT = ("subi", "sbci", "cpi", "andi", "ori", "ldi")
EDGES = (0, 1, 0x7F, 0x80, 0xFF)


def chain(chance: random.Random) -> list[str]:
    """Instructions of every kind, with numbers and registers at random; numbers at the edges more often."""
    found = []
    for _ in range(LENGTH):
        one, other = (chance.randint(FIRST, LAST) for _ in range(2))
        number = chance.choice((*EDGES, chance.randrange(256)))
        kind = chance.randrange(10)
        if kind < 4:
            found.append(f"{chance.choice(TWO)} r{one}, r{other}")
        elif kind < 6:
            found.append(f"{chance.choice(ONE)} r{one}")
        elif kind < 8:
            found.append(f"{chance.choice(CONSTANT)} r{one}, {number}")
        elif kind == 8:
            found.append(f"{chance.choice(('adiw', 'sbiw'))} r24, {number % 64}")
        else:
            found.append(chance.choice(("sec", "clc", "movw r20, r18")))
    return found


@pytest.mark.parametrize("seed", range(4))
def test_known_values_are_those_of_the_emulator(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    instructions = chain(chance)
    begin = [f"ldi r{r}, {chance.choice((*EDGES, chance.randrange(256)))}" for r in range(FIRST, LAST + 1)]
    stored = ["in r0, SREG", "st X+, r0", *(f"st X+, r{r}" for r in range(FIRST, LAST + 1))]
    lines = ["ldi r26, lo8(0x200)", "ldi r27, hi8(0x200)", *begin, "cp r16, r16"]
    for line in instructions:
        lines += [line, *stored]
    source = "#define __SFR_OFFSET 0\n#include <avr/io.h>\n.global main, begin\nmain: sbi DDRB, 5\nbegin: "
    source += "\n".join(lines) + "\nend: sbi PORTB, 5\n1: rjmp 1b\n"
    program, image = tmp_path / "program.S", tmp_path / "program.elf"
    program.write_text(source, encoding="ascii")
    subprocess.run(["avr-gcc", "-mmcu=atmega328p", "-o", str(image), str(program)], check=True)
    board = BoardAccess(create(image))
    board.run(50_000)
    assert [edge.level for edge in board.log() if edge.pin == PIN][-1] == Level.HIGH
    width = 1 + LAST - FIRST + 1
    seen = board.read_memory(STORED, LENGTH * width)

    code = read_image(image)
    (address,) = (symbol.address for symbol in code.symbols if symbol.name == "begin")
    state, compared = State(), 0
    for number in range(len(lines)):
        instruction = decode(code.code, address)
        assert instruction is not None
        state = step(instruction, state)
        address += instruction.size
        at = number - len(begin) - 3
        if at >= 0 and at % (1 + len(stored)) == 0:
            sreg, *registers = seen[at // (1 + len(stored)) * width :][:width]
            assert [state.registers.get(r) for r in range(FIRST, LAST + 1)] == registers, lines[number]
            assert state.flags == {name: sreg >> bit & 1 == 1 for name, bit in FLAGS.items()}, lines[number]
            compared += 1
    assert compared == LENGTH
