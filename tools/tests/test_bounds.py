"""Bounds of loops (firmware/src/bounds.h): the image holds them and their addresses, and they cost nothing."""

from __future__ import annotations

import struct
import subprocess
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from tools.tests.avr_program import IMAGES, SOURCES, flags

FOLDER = Path(__file__).resolve().parents[2] / "build" / "images"
NOT_SAID = 0xFFFFFFFF
PROGRAM = """
#include <stdint.h>
#include "bounds.h"
#ifdef PLAIN
#undef LOOP_BOUND
#undef LOOP_CYCLES
#define LOOP_BOUND(passes)
#define LOOP_CYCLES(cycles)
#endif
volatile uint8_t port;
void unused(void) { for (uint8_t i = 0; i < port; i++) { LOOP_BOUND(77); port = i; } }
static __attribute__((noinline)) void used(uint8_t n) {
  for (uint8_t i = 0, k = 1; i < n; i++, k++) {
    LOOP_BOUND(100u * 2u);
    if (port == 3) continue;
    if (port == 4) break;
    port = k;
  }
}
static __attribute__((noinline)) void waits(void) {
  while (port != 0) {
    LOOP_CYCLES(70000);
    port = 1;
  }
}
int main(void) {
  used(port);
  waits();
  for (;;) {}
}
"""


def section(image: Path, name: str) -> bytes:
    with image.open("rb") as file:
        found = ELFFile(file).get_section_by_name(name)
        assert found is not None, name
        return bytes(found.data())


def program(folder: Path, name: str, *more: str) -> Path:
    source, image = folder / "program.c", folder / f"{name}.elf"
    source.write_text(PROGRAM, encoding="ascii")
    subprocess.run(["avr-gcc", *flags(), *more, f"-I{SOURCES}", "-o", str(image), str(source)], check=True)
    return image


def test_a_bound_takes_no_code_and_follows_its_function(tmp_path: Path) -> None:
    bounded = program(tmp_path, "bounded")
    assert section(bounded, ".text") == section(program(tmp_path, "plain", "-DPLAIN"), ".text")
    rows = list(struct.iter_unpack("<III", section(bounded, ".boebot.loops")))
    assert sorted(row[1:] for row in rows) == [(200, NOT_SAID), (NOT_SAID, 70000)], "none of `unused`"


@pytest.mark.parametrize("pin_map", IMAGES)
def test_rows_are_not_loaded(pin_map: str) -> None:
    with (FOLDER / f"{pin_map}.elf").open("rb") as file:
        elf = ELFFile(file)
        sections = {section.name: section for section in elf.iter_sections()}
        for name in (".boebot.loops", ".boebot.timing"):
            assert sections[name]["sh_size"] > 0
            assert sections[name]["sh_flags"] == 0
        loaded = sections[".text"]["sh_size"] + sections[".data"]["sh_size"]
    records = (FOLDER / f"{pin_map}.hex").read_text(encoding="ascii").split()
    assert sum(int(record[1:3], 16) for record in records if record[7:9] == "00") == loaded
