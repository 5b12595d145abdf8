"""What is read of an ELF file, against avr-size, avr-nm and avr-addr2line; and files that are damaged."""

from __future__ import annotations

import random
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from avr_image import build, disassembly
from avr_timing.flow.graph import load_program
from boebot.errors import AnalysisError
from boebot.image.elf import Image, LoopBound, read_image

IMAGE = Path(__file__).resolve().parents[3] / "build" / "images" / "shieldbot.elf"
PROGRAM = """
#include <stdint.h>
static uint8_t bytes[37];
uint16_t initial = 0x1234;
uint8_t kept __attribute__((section(".noinit")));
__attribute__((noinline)) static int sum(int n)
{
    int s = 0;
    for (int i = 0; i < n; i++)
        s += bytes[i] + initial;
    return s;
}
int main(void)
{
    kept = (uint8_t)sum(30);
    return sum(kept);
}
"""


def output(*command: str | Path) -> str:
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True).stdout


def test_sizes_are_those_of_avr_size(tmp_path: Path) -> None:
    for path in (IMAGE, build(tmp_path, PROGRAM)):
        image = read_image(path)
        sections = {
            words[0]: (int(words[1]), int(words[2]))
            for words in (line.split() for line in output("avr-size", "-A", path).splitlines())
            if len(words) == 3 and words[1].isdigit()
        }
        ram = {name: where for name, where in sections.items() if where[1] >= 0x800100}
        assert image.flash_bytes == sections[".text"][0] + sections[".data"][0]
        assert image.ram_bytes == sum(size for size, _ in ram.values())
        assert image.stack_start == 0x08FF  # RAMEND, as the start-up code sets it
        assert image.entry == 0


def test_symbols_are_those_of_avr_nm() -> None:
    image = read_image(IMAGE)
    listed = [line.split() for line in output("avr-nm", IMAGE).splitlines()]
    expected = {
        (name, int(address, 16)) for address, kind, name in listed if kind in "tTwW" and int(address, 16) < 0x8000
    }
    assert {(symbol.name, symbol.address) for symbol in image.symbols} >= expected - {
        ("__heap_end", 0),
        ("__stack", 0x8FF),
    }


def test_the_code_is_that_of_avr_objcopy(tmp_path: Path) -> None:
    binary = tmp_path / "flash.bin"
    output("avr-objcopy", "-O", "binary", "-R", ".eeprom", IMAGE, binary)
    assert read_image(IMAGE).code == binary.read_bytes()


@pytest.mark.parametrize("flags", [("-gdwarf-2",), ("-gdwarf-4",), ("-gdwarf-4", "-Wl,--relax", "-mcall-prologues")])
def test_source_lines_are_those_of_addr2line(tmp_path: Path, flags: tuple[str, ...]) -> None:
    path = build(tmp_path, PROGRAM, *flags)
    image = read_image(path)
    addresses = list(disassembly(path))
    found = output("avr-addr2line", "-s", "-e", path, *(hex(address) for address in addresses)).splitlines()
    known = {a: line.split(" ")[0] for a, line in zip(addresses, found, strict=True) if "?" not in line}
    assert len(known) > 20
    assert {address: image.lines.get(address) for address in known} == known


def test_an_image_without_lines_has_none(tmp_path: Path) -> None:
    path = build(tmp_path, PROGRAM)
    assert read_image(path).lines == {}
    assert load_program(path).where(0x1A2).startswith("0x01A2 (in ")


def test_debugging_information_with_addresses_of_two_bytes_gives_no_lines(tmp_path: Path) -> None:
    """As clang writes it: the address size is byte 10 of a unit's header (DWARF 4, section 7.5.1.1)."""
    path = build(tmp_path, PROGRAM, "-gdwarf-4")
    plain = read_image(path)
    with path.open("rb") as stream:
        section = ELFFile(stream).get_section_by_name(".debug_info")
        assert section is not None
        start = section["sh_offset"]
    data = bytearray(path.read_bytes())
    assert data[start + 10] == 4 and plain.lines
    data[start + 10] = 2
    path.write_bytes(data)
    assert read_image(path) == replace(plain, lines={}, sources={})


def test_an_image_without_symbols_is_followed_the_same(tmp_path: Path) -> None:
    path = build(tmp_path, PROGRAM)
    named = load_program(path)
    output("avr-strip", path)
    stripped = load_program(path)
    assert stripped.by_name == {}
    reset = named.functions[0].blocks
    assert stripped.functions[0].blocks == reset
    assert named.by_name["main"] in stripped.functions  # as start-up calls it


def loops(folder: Path, records: bytes) -> Image:
    text = 'main: ret\n.section .boebot.loops, "", @progbits\n' + "".join(f".byte {byte}\n" for byte in records)
    return read_image(build(folder, text, assembler=True))


def test_bounds_of_loops_are_read(tmp_path: Path) -> None:
    records = struct.pack("<6I", 0x6A, 12, 0xFFFFFFFF, 0x70, 0xFFFFFFFF, 4000)
    records += struct.pack("<3I", 0x6A, 0xFFFFFFFF, 0xFFFFFFFF)  # says neither
    assert loops(tmp_path, records).bounds == (LoopBound(0x6A, 12, None), LoopBound(0x70, None, 4000))


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        (struct.pack("<3I", 0x6A, 1, 1)[:-1], "has 11 bytes: records of 12 bytes are expected"),
        (struct.pack("<3I", 0x7000, 1, 1), "0x7000, which is not one of an instruction"),
        (struct.pack("<3I", 0x6B, 1, 1), "0x6B, which is not one of an instruction"),
    ],
)
def test_a_broken_bound_is_refused(tmp_path: Path, records: bytes, expected: str) -> None:
    with pytest.raises(AnalysisError) as caught:
        loops(tmp_path, records)
    assert expected in str(caught.value)


def refused(path: Path) -> str:
    with pytest.raises(AnalysisError) as caught:
        load_program(path)
    text = str(caught.value)
    assert str(path) in text and "\n" not in text
    return text


def test_what_is_no_image_is_refused(tmp_path: Path) -> None:
    assert "cannot be read: No such file" in refused(tmp_path / "none.elf")
    assert "cannot be read" in refused(tmp_path)
    text = tmp_path / "text.elf"
    text.write_text("an image", encoding="ascii")
    assert "is not an ELF file for an AVR" in refused(text)
    text.write_text(":00000001FF\n", encoding="ascii")
    assert "(a HEX file has neither the chip's name nor symbols)" in refused(text)
    text.write_bytes(b"")
    assert "is not an ELF file for an AVR" in refused(text)
    assert "is not an ELF file for an AVR" in refused(Path("/bin/true").resolve())
    program = tmp_path / "part.c"
    program.write_text(PROGRAM, encoding="ascii")
    output("avr-gcc", "-mmcu=atmega328p", "-c", "-o", tmp_path / "part.o", program)
    assert "is not linked" in refused(tmp_path / "part.o")
    beyond = ("-Wl,--section-start=.text=0x9000", "-Wl,--defsym=__TEXT_REGION_LENGTH__=0x20000")
    output("avr-gcc", "-mmcu=atmega328p", *beyond, "-o", tmp_path / "large.elf", program)
    assert "the ATmega328P has 32768 bytes" in refused(tmp_path / "large.elf")


def test_a_file_that_is_cut_off_is_refused_or_read_whole(tmp_path: Path) -> None:
    whole = build(tmp_path, PROGRAM, "-gdwarf-4").read_bytes()
    path = tmp_path / "cut.elf"
    for size in (*range(0, 200, 7), *range(200, len(whole), 61)):
        path.write_bytes(whole[:size])
        refused(path)


def test_a_damaged_file_is_read_or_refused(tmp_path: Path) -> None:
    whole = build(tmp_path, PROGRAM, "-gdwarf-4").read_bytes()
    path = tmp_path / "damaged.elf"
    chance = random.Random(6)
    refusals = 0
    for _ in range(100):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 3, 20))):
            data[chance.randrange(len(data))] = chance.randrange(256)
        path.write_bytes(data)
        try:
            load_program(path)
        except AnalysisError:  # anything else fails the test
            refusals += 1
    assert 0 < refusals < 100
