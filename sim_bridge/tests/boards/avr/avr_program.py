"""Small AVR programs for tests: made by avr-gcc when the test runs, and a board that runs them."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

from sim_bridge.boards.avr import AvrBoard, create
from sim_bridge.boards.board import Edge
from sim_bridge.tests.boards.access import BoardAccess

PREAMBLE = """
#define __SFR_OFFSET 0
#include <avr/io.h>
.global main
"""


@cache
def assemble(source: str) -> bytes:
    """The ELF image of an assembler program with `main`, start-up code and interrupt vectors of the ATmega328P."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "program.S")
        image = Path(folder, "program.elf")
        program.write_text(PREAMBLE + source, encoding="ascii")
        command = ["avr-gcc", "-mmcu=atmega328p", "-o", str(image), str(program)]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
        return image.read_bytes()


def compiled(source: str, image: Path, *options: str) -> Path:
    """The ELF file of a C program; its source lies beside it, for lines."""
    program = image.with_suffix(".c")
    program.write_text(source, encoding="ascii")
    flags = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-Wall", "-Wno-array-bounds", "-gdwarf-4", *options]
    subprocess.run(["avr-gcc", *flags, "-o", image, program], check=True)
    return image


class Machine:
    """A board that runs a program: `avr` owns it, `board` has its operations."""

    def __init__(self, source: str) -> None:
        """Powers on a board with the program in flash."""
        with tempfile.TemporaryDirectory() as folder:
            image = Path(folder, "program.elf")
            image.write_bytes(assemble(source))
            self.avr: AvrBoard = create(image)
        self.board = BoardAccess(self.avr)


def edges_of(log: Iterable[Edge], pin: int) -> list[int]:
    """Cycles of the edges of one pin."""
    return [edge.cycle for edge in log if edge.pin == pin]


def gaps(values: Iterable[int]) -> list[int]:
    """From each value to the next."""
    return [later - earlier for earlier, later in pairwise(values)]


def pairs(values: list[int]) -> Iterator[tuple[int, int]]:
    """(first, second), (third, fourth), ..."""
    return zip(values[::2], values[1::2], strict=True)
