"""Small programs for the ATmega328P, built by avr-gcc when a test runs, and what avr-objdump says of a program."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from avr_timing.flow.graph import load_program
from avr_timing.program import Function, Program
from boebot.errors import AnalysisError

# `main` and the vectors come from avr-libc's start-up code.
ASSEMBLER = """
#define __SFR_OFFSET 0
#include <avr/io.h>
.global main
"""
# What firmware/src/bounds.h writes: a loop's bound.
MARKS = """
.macro bounded passes
.Lloop\\@:
.pushsection .boebot.loops, "", @progbits
.long .Lloop\\@, \\passes, 0xFFFFFFFF
.popsection
.endm
"""
LINE = re.compile(r"^ *([0-9a-f]+):\t(?:[0-9a-f]{2} )+ *\t(.*)$")


def build(folder: Path, source: str, *flags: str, assembler: bool = False) -> Path:
    """The ELF file of a program in C or assembler."""
    program = folder / ("program.S" if assembler else "program.c")
    program.write_text((ASSEMBLER if assembler else "") + source, encoding="ascii")
    image = folder / "program.elf"
    command = ["avr-gcc", "-mmcu=atmega328p", "-Os", *flags, "-o", str(image), str(program)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return image


def disassembly(image: Path, *options: str) -> dict[int, str]:
    """Instruction text by address, as `avr-objdump` writes it, zeros too, less its comment."""
    command = ["avr-objdump", "-z", *(options or ("-d",)), str(image)]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = (LINE.match(line) for line in text.replace("; undefined", "").splitlines())
    return {int(match[1], 16): match[2] for match in found if match}


def operands(text: str, address: int) -> tuple[int, ...]:
    """The numbers of an instruction as objdump writes it: "ldd r24, Z+3" is (24, 30, 3), "ld r0, -X" (0, 26, -1)."""
    numbers: list[int] = []
    for word in text.split(";")[0].replace(",", " ").split()[1:]:
        pointer = re.fullmatch(r"(-?)([XYZ])(\+?)(\d*)", word)
        if pointer:
            before, name, after, displacement = pointer.groups()
            step = -1 if before else int(displacement or bool(after))
            numbers += ["XYZ".index(name) * 2 + 26, step]
        elif word.startswith("."):
            numbers.append(address + 2 + int(word[1:]))
        else:
            numbers.append(int(word.removeprefix("r"), 0))
    return tuple(numbers)


def assembled(folder: Path, source: str, *flags: str) -> Program:
    return load_program(build(folder, source, *flags, assembler=True))


def compiled(folder: Path, source: str, *flags: str) -> Program:
    return load_program(build(folder, source, *flags))


def function(program: Program, name: str) -> Function:
    return program.functions[program.by_name[name]]


def refusal(folder: Path, source: str, *flags: str, assembler: bool = True) -> str:
    """Why a program is refused, or why it is not known where one of its functions leads."""
    try:
        (text,) = load_program(build(folder, source, *flags, assembler=assembler)).unproven.values()
    except AnalysisError as error:
        text = str(error)
    assert "\n" not in text
    return text
