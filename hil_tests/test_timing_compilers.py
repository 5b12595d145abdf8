"""Static bounds of what several compilers make of the same C: avr-gcc and clang, beside the emulator; and the firmware
itself as it comes from other options than its own."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from boebot.errors import TimingError
from boebot.timing import budget
from boebot.timing.graph import load_program
from boebot.timing.loads import LOADS
from boebot.timing.wcet import WorstCase
from hil_tests.test_timing_bounds import HEAD, measured
from tools import compilers
from tools.bench import avr_program

INCLUDES = "/usr/lib/avr/include"  # avr-libc's, as Debian has it; avr-gcc knows its place
COMPILERS = {
    "avr-gcc": ["avr-gcc"],
    "clang": ["clang", "--target=avr", f"-isystem{INCLUDES}", "-Wno-unknown-attributes"],
}
# The input: r24 and r25 are `a`, r22 and r23 are `b`; r20 and r21 are `c`.
PROGRAM = """
#include <stdint.h>
#include <string.h>
#include <avr/pgmspace.h>
__asm__(".macro bounded row, passes\\n\\\\row:\\n.pushsection .boebot.loops, \\"\\", @progbits\\n"
        ".long \\\\row, \\\\passes, 0xFFFFFFFF\\n.popsection\\n.endm");
#define BOUNDED(n) __asm__ volatile("bounded .Lrow%=, %0" ::"n"(n))
volatile uint8_t x;
volatile uint16_t y;
struct block {{ uint8_t bytes[30]; }} from, to;
uint8_t area[40];
static void one(void) {{ x = 1; }}
static void two(void) {{ y = 2; x = 3; }}
static void (*const table[])(void) __attribute__((section(".progmem.data"))) = {{one, two}};
uint16_t f(uint16_t a, uint16_t b, uint16_t c) {{
  {body}
}}
"""
SWITCH = "switch (a) { " + " ".join(f"case {n}: x = {n * 7};{' y = 1;' * n} break;" for n in range(8)) + " } return b;"
BITS = "for (uint8_t i = 0; i < (uint8_t)b; i++) { BOUNDED(10); if (a & 1) { y = c; y = b; } a >>= 1; } return a;"
POINTERS = "uint8_t i = a; if (i < 2) { ((void (*)(void))pgm_read_word(&table[i]))(); } return b;"


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
    "pointers": (POINTERS, [words(n) for n in range(3)]),
    "shift": ("return a >> (b & 15);", [words(0xFFFF, n) for n in range(16)]),
    "division": ("return a / b;", [words(0xFFFF, 1)]),
    "copy": ("to = from; return a;", [words(1)]),
    "memcpy": ("memcpy(area, &from, 30); return a;", [words(1)]),
    "memset": ("memset(area, a, 40); return a;", [words(1)]),
    "buffer": ("volatile uint8_t buffer[20]; for (uint8_t i = 0; i < 20; i++) { buffer[i] = a; } return buffer[3];",
               [words(1)]),
}  # fmt: skip


def clang_knows_the_processor() -> bool:
    if shutil.which("clang") is None:
        return False
    targets = subprocess.run(["clang", "--print-targets"], capture_output=True, text=True, check=False).stdout
    return "avr" in targets.split()


def build(folder: Path, compiler: str, body: str, *options: str) -> Path:
    """The image of `f` with this body, called by the program in assembler."""
    if compiler == "clang" and not clang_knows_the_processor():
        pytest.skip("this machine's clang does not know the AVR")
    frame, source, code, image = (folder / name for name in ("frame.S", "f.c", "f.o", "f.elf"))
    frame.write_text(HEAD.replace(".type f, @function", ""), encoding="ascii")
    source.write_text(PROGRAM.format(body=body), encoding="ascii")
    for command in (
        [*COMPILERS[compiler], *options, "-mmcu=atmega328p", "-c", "-o", str(code), str(source)],
        ["avr-gcc", "-mmcu=atmega328p", "-o", str(image), str(frame), str(code)],
    ):
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
    return image


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("level", ["-Os", "-O2"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_bound_is_what_the_longest_takes(tmp_path: Path, compiler: str, level: str, case: str) -> None:
    body, inputs = CASES[case]
    image = build(tmp_path, compiler, body, level)
    assert WorstCase(load_program(image)).of("f").cycles == max(measured(image, given) for given in inputs)


@pytest.mark.parametrize(("compiler", "debug"), [("avr-gcc", "-gdwarf-2"), ("clang", "-g")])
def test_refusal_names_the_line(tmp_path: Path, compiler: str, debug: str) -> None:
    image = build(tmp_path, compiler, "while (x != 0) { y = a; }\n  return b;", "-Os", debug)
    line = PROGRAM.splitlines().index("  {body}") + 1
    with pytest.raises(TimingError, match=rf"the loop at 0x[0-9A-F]{{4}} \(f\.c:{line}\) has no bound"):
        WorstCase(load_program(image)).of("f")


@pytest.fixture(scope="module", params=["-O2 by source", "-O3 unrolled"])
def speedy(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The firmware, optimised for speed."""
    return compilers.build(tmp_path_factory.mktemp("firmware") / "firmware.elf", compilers.OPTIONS[request.param])


def test_firmware_optimised_for_speed_is_proved(speedy: Path) -> None:
    """No task and no interrupt takes longer than its bound, and the bounds are not far above."""
    rows = compilers.rows_of(speedy)
    assert [row.name for row in rows if row.seen > row.bound] == []
    ran = {row.name: row.bound / row.seen for row in rows if row.seen > 0}
    assert len(ran) > 25 and max(ran.values()) < 2


def test_a_bound_taken_out_is_missed(tmp_path: Path) -> None:
    """The loop over the changes at the pins, of which avr-gcc 5 makes two with -O2."""
    folder = tmp_path / "src"
    shutil.copytree(avr_program.SOURCES, folder)
    source = folder / "encoder.c"
    text = source.read_text(encoding="utf-8")
    bounded = "BOUNDED(HAL_CHANGES - 1u, while (tail != head))"
    assert text.count(bounded) == 1
    source.write_text(text.replace(bounded, "while (tail != head)"), encoding="utf-8")
    mutant = avr_program.build(tmp_path / "mutant.elf", extra=("-fno-lto", "-O2"), folder=folder)
    with pytest.raises(TimingError, match=r"the loop at 0x[0-9A-F]{4} \(encoder\.c:\d+\) has no bound"):
        budget.prove(mutant, LOADS["figures"])
