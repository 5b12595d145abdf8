"""Bounds of loops (firmware/src/bounds.h): every loop has one, the image tells it and where, and it costs nothing; a
loop that breaks its bound ends a run on this computer with file, line and bound."""

from __future__ import annotations

import re
import struct
import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest
from elftools.elf.elffile import ELFFile

from boebot.errors import BoardError
from sim_bridge._core import ffi, lib
from sim_bridge.boards.board import BoardAccess
from sim_bridge.boards.emulated import native_board
from sim_bridge.tests.native_program import native_program
from tools import fuzz
from tools.bench.avr_program import SOURCES, flags

IMAGES = Path(__file__).resolve().parents[2] / "build" / "images"
PIN_MAPS = ("shieldbot", "shieldbot-quad", "boebot")
NOT_SAID = 0xFFFFFFFF
UNROLLED = 4  # passes up to which the compiler may write a loop out

# What runs for ever, by its nature: the main loop, and sleep until something is due.
ENDLESS = {("main.c", "for (;;) {"), ("hal/avr/hal_avr.h", "while (!due()) {")}


class Row(NamedTuple):
    """A record of .boebot.loops."""

    address: int
    passes: int
    cycles: int


def rows_of(image: Path) -> list[Row]:
    with image.open("rb") as file:
        section = ELFFile(file).get_section_by_name(".boebot.loops")
        return [] if section is None else [Row(*words) for words in struct.iter_unpack("<III", section.data())]


def loops_of(image: Path) -> list[tuple[int, int]]:
    """First and last address of each backward jump's span within a function, as avr-objdump reads the code."""
    text = subprocess.run(["avr-objdump", "-d", str(image)], capture_output=True, text=True, check=True).stdout
    found, function = [], ""
    for line in text.splitlines():
        if head := re.match(r"[0-9a-f]+ <(.+)>:$", line):
            function = head[1]
        jump = re.match(r"\s*([0-9a-f]+):\t[0-9a-f ]+\t(?:br\w\w|r?jmp)\s.*; 0x([0-9a-f]+) <([^+>]+)", line)
        if jump and jump[3] == function and int(jump[2], 16) <= int(jump[1], 16):
            found.append((int(jump[2], 16), int(jump[1], 16)))
    return found


@pytest.mark.parametrize("pin_map", PIN_MAPS)
def test_rows_of_an_image_lie_in_loops(pin_map: str) -> None:
    image = IMAGES / f"{pin_map}.elf"
    rows, loops = rows_of(image), loops_of(image)
    assert len(rows) >= 30
    astray = [
        row
        for row in rows
        if (row.passes == NOT_SAID or row.passes > UNROLLED)
        and not any(first <= row.address <= last for first, last in loops)
    ]
    assert not astray
    assert all((row.passes == NOT_SAID) != (row.cycles == NOT_SAID) for row in rows)


@pytest.mark.parametrize("pin_map", PIN_MAPS)
def test_rows_are_not_loaded(pin_map: str) -> None:
    with (IMAGES / f"{pin_map}.elf").open("rb") as file:
        elf = ELFFile(file)
        sections = {section.name: section for section in elf.iter_sections()}
        for name in (".boebot.loops", ".boebot.timing", ".boebot.ids"):
            assert sections[name]["sh_size"] > 0
            assert sections[name]["sh_flags"] == 0
        loaded = sections[".text"]["sh_size"] + sections[".data"]["sh_size"]
    records = (IMAGES / f"{pin_map}.hex").read_text(encoding="ascii").split()
    assert sum(int(record[1:3], 16) for record in records if record[7:9] == "00") == loaded


PROGRAM = """
#include <stdint.h>
#include "bounds.h"
#ifdef PLAIN
#undef BOUNDED
#undef BOUNDED_TIME
#undef BOUNDED_ASM
#define BOUNDED(most, loop) loop
#define BOUNDED_TIME(cycles, loop) loop
#define BOUNDED_ASM(most) ""
#endif
volatile uint8_t port;
void unused(void) { BOUNDED(77, for (uint8_t i = 0; i < 77; i++)) { port = i; } }
static __attribute__((noinline)) void used(uint8_t n) {
  BOUNDED(200, for (uint8_t i = 0, k = 1; i < n && i < 200; i++, k++)) {
    if (port == 3) continue;
    if (port == 4) break;
    port = k;
  }
}
static __attribute__((noinline)) void waits(void) { BOUNDED_TIME(70000, while (port != 0)) { port = 1; } }
static __attribute__((noinline)) void by_hand(uint8_t n) {
  __asm__ volatile("1: dec %[n] \\n" BOUNDED_ASM("%[most]") "brne 1b \\n" : [n] "+r"(n) : [most] "n"(2 * 20));
}
int main(void) {
  used(port);
  waits();
  by_hand(port);
  for (;;) {}
}
"""


def small_program(folder: Path, name: str, *more: str) -> Path:
    source, image = folder / "program.c", folder / f"{name}.elf"
    source.write_text(PROGRAM, encoding="ascii")
    kept = [flag for flag in flags() if "section-start" not in flag and "Tdata" not in flag]
    subprocess.run(["avr-gcc", *kept, *more, f"-I{SOURCES}", "-o", str(image), str(source)], check=True)
    return image


def section(image: Path, name: str) -> bytes:
    with image.open("rb") as file:
        found = ELFFile(file).get_section_by_name(name)
        assert found is not None
        return bytes(found.data())


def test_a_bound_takes_no_code_and_follows_its_function(tmp_path: Path) -> None:
    bounded = small_program(tmp_path, "bounded")
    assert section(bounded, ".text") == section(small_program(tmp_path, "plain", "-DPLAIN"), ".text")
    rows = rows_of(bounded)
    assert sorted(row[1:] for row in rows) == [(40, NOT_SAID), (200, NOT_SAID), (NOT_SAID, 70000)], "none of `unused`"
    loops = loops_of(bounded)
    assert all(any(first <= row.address <= last for first, last in loops) for row in rows)


def test_every_loop_of_the_firmware_has_a_bound() -> None:
    without = set()
    for path in sorted([*SOURCES.rglob("*.c"), *SOURCES.rglob("*.h")]):
        name = path.relative_to(SOURCES).as_posix()
        if "native" in name or "generated" in name or name == "bounds.h":
            continue
        text = re.sub(r"/\*.*?\*/", " ", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        for line in text.splitlines():
            if re.search(r"(?<!, )\b(for|while|do)\b ?[({]", line) and not re.search(r"BOUNDED(_TIME)?\(", line):
                without.add((name, line.strip()))
        for loop in re.finditer(r'"\s*(\d): [^"]*"(?:(?!"\s*\d: ).)*?"br\w\w \1b', text, re.DOTALL):
            if "BOUNDED_ASM" not in loop[0]:
                without.add((name, loop[0]))
    assert {(name, line) for name, line in without if not line.startswith("while (schedule_waiting()")} == ENDLESS


# ---- the check at run time ----


def planted(path: Path, bound: str, instead: str) -> str:
    """The text of a source with another bound."""
    text = path.read_text(encoding="utf-8")
    assert text.count(bound) == 1, f"{path.name} does not hold {bound!r} once"
    return text.replace(bound, instead)


def test_a_fuzzer_stops_at_a_broken_bound(tmp_path: Path) -> None:
    mutant = tmp_path / "frame.c"
    mutant.write_text(planted(fuzz.FRAME, "size, ACCEPTED_MAX - 2u", "size, 0u"), encoding="utf-8")
    done = fuzz.run(fuzz.build("frame-board", tmp_path, {fuzz.FRAME: mutant}), tmp_path, ["-seed=1", "-runs=20000"])
    assert done.returncode != 0
    assert re.search(r"cobs\.h:\d+: a loop makes more than the 0 passes that bound it", done.stderr), done.stderr[
        -2000:
    ]


COUNTER = """
#include "bounds.h"
static void start(void) {}
static void slot(void) {
  static uint8_t slots;
  uint8_t n = 0;
  slots++;
  BOUNDED(5, while (n < slots)) { n++; }
  say(&n, 1);
}
"""


def test_a_native_board_stops_at_a_broken_bound_and_says_which() -> None:
    board = native_program(COUNTER)
    board.advance(int(5.5 * 40_000))
    assert board.fault is None
    assert [byte.byte for byte in board.receive()] == [1, 2, 3, 4, 5], "as often as the bound allows"
    for until in (7 * 40_000, 9 * 40_000):
        with pytest.raises(BoardError, match=r"program\.c:\d+: a loop makes more than the 5 passes that bound it\.$"):
            board.advance(until)
    assert not board.receive()


def test_the_firmware_on_a_native_board_stops_at_a_broken_bound(tmp_path: Path) -> None:
    source = SOURCES / "analog.c"
    mutant, library = tmp_path / "analog.c", tmp_path / "firmware.so"
    mutant.write_text(planted(source, "BOUNDED(ANALOG_INPUTS, ", "BOUNDED(ANALOG_INPUTS - 1u, "), encoding="utf-8")
    sources = [str(mutant if path == source else path) for path in fuzz.firmware_sources()]
    command = ["cc", "-std=gnu11", "-shared", "-fPIC", "-fvisibility=hidden", "-w", "-DPIN_MAP_SHIELDBOT"]
    subprocess.run([*command, f"-I{SOURCES}", "-o", str(library), *sources], check=True)
    owner = native_board(library)
    board = BoardAccess(lib, ffi, ffi.cast("board *", owner.address), owner=owner)
    with pytest.raises(BoardError, match=r"analog\.c:\d+: a loop makes more than"):
        board.advance(40_000)
