"""Static bounds of what avr-gcc makes of C with the firmware's options, beside the emulator."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from avr_timing.bounds.wcet import WorstCase
from avr_timing.flow.graph import load_program
from boebot.errors import AnalysisError
from test_emulated import HEAD, measured

# The input: r24 and r25 are `a`, r22 and r23 are `b`; r20 and r21 are `c`.
PROGRAM = """
#include <stdint.h>
#include <string.h>
__asm__(".macro bounded row, passes\\n\\\\row:\\n.pushsection .boebot.loops, \\"\\", @progbits\\n"
        ".long \\\\row, \\\\passes, 0xFFFFFFFF\\n.popsection\\n.endm");
#define BOUNDED(n) __asm__ volatile("bounded .Lrow%=, %0" ::"n"(n))
volatile uint8_t x;
volatile uint16_t y;
struct block {{ uint8_t bytes[30]; }} from, to;
uint8_t area[40];
uint16_t f(uint16_t a, uint16_t b, uint16_t c) {{
  {body}
}}
"""
SWITCH = (
    "switch ((uint8_t)a) { "
    + " ".join(f"case {n}: x = {n * 7};{' y = 1;' * n} break;" for n in range(8))
    + " } return b;"
)
BITS = "for (uint8_t i = 0; i < (uint8_t)b; i++) { BOUNDED(10); if (a & 1) { y = c; y = b; } a >>= 1; } return a;"


def words(*numbers: int) -> list[int]:
    """The bytes of 16-bit numbers."""
    return [byte for number in numbers for byte in number.to_bytes(2, "little")]


# Bodies, and inputs among which is the one that takes longest.
CASES: dict[str, tuple[str, list[list[int]]]] = {
    "counted": ("for (uint8_t i = 0; i < 20; i++) { x = a; } return b;", [words(1)]),
    "counted to 1000": ("for (uint16_t i = 0; i < 1000; i++) { x = a; } return b;", [words(1)]),
    "nested": ("for (uint8_t i = 0; i < 5; i++) for (uint8_t k = 0; k < 7; k++) x = k; return b;", [words(1)]),
    "bounded": (BITS, [words(0x3FF, 10, 5), words(0, 10, 5)]),
    "switch": (SWITCH, [words(n) for n in range(9)]),
    "shift": ("return a >> (b & 15);", [words(0xFFFF, n) for n in range(16)]),
    "division": ("return a / b;", [words(0xFFFF, 1)]),
    "copy": ("to = from; return a;", [words(1)]),
    "memcpy": ("memcpy(area, &from, 30); return a;", [words(1)]),
    "memset": ("memset(area, a, 40); return a;", [words(1)]),
    "buffer": ("volatile uint8_t buffer[20]; for (uint8_t i = 0; i < 20; i++) { buffer[i] = a; } return buffer[3];",
               [words(1)]),
}  # fmt: skip


def build(folder: Path, body: str, *options: str) -> Path:
    """The image of `f` with this body, called by the program in assembler."""
    frame, source, code, image = (folder / name for name in ("frame.S", "f.c", "f.o", "f.elf"))
    frame.write_text(HEAD.replace(".type f, @function", ""), encoding="ascii")
    source.write_text(PROGRAM.format(body=body), encoding="ascii")
    for options_of in (
        ["-Os", *options, "-c", "-o", str(code), str(source)],
        ["-o", str(image), str(frame), str(code)],
    ):
        result = subprocess.run(
            ["avr-gcc", "-mmcu=atmega328p", *options_of], capture_output=True, text=True, check=False
        )
        assert result.returncode == 0, result.stderr
    return image


@pytest.mark.parametrize("case", CASES)
def test_bound_is_what_the_longest_takes(tmp_path: Path, case: str) -> None:
    body, inputs = CASES[case]
    image = build(tmp_path, body)
    assert WorstCase(load_program(image)).of("f").cycles == max(measured(image, given) for given in inputs)


def test_refusal_names_the_line(tmp_path: Path) -> None:
    image = build(tmp_path, "while (x != 0) { y = a; }\n  return b;", "-gdwarf-2")
    line = PROGRAM.splitlines().index("  {body}") + 1
    with pytest.raises(AnalysisError, match=rf"the loop at 0x[0-9A-F]{{4}} \(f\.c:{line}\) has no bound"):
        WorstCase(load_program(image)).of("f")
