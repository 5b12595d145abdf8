"""Programs from ELF and HEX files: what lies in flash, and files that are none."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot import resources
from boebot.errors import AnalysisError
from boebot.image.elf import read_image
from boebot.image.program import FLASH_SIZE, RAM_BEGIN, elf_program, hex_program, read_program

ELF, HEX = (resources.folder("images") / f"shieldbot{suffix}" for suffix in (".elf", ".hex"))


def record(address: int, data: bytes, kind: int = 0) -> str:
    """A line of a HEX file."""
    line = struct.pack(">BHB", len(data), address, kind) + data
    return f":{(line + bytes([-sum(line) & 0xFF])).hex().upper()}\n"


END = record(0, b"", 1)


def test_both_files_of_one_program_give_the_same_flash() -> None:
    of_elf, of_hex, image = read_program(ELF), read_program(HEX), read_image(ELF)
    assert of_elf.flash == of_hex.flash == image.code.ljust(FLASH_SIZE, b"\xff")
    assert of_elf.code_end == max(part.stop for part in image.executable)
    assert of_elf.variables_end == RAM_BEGIN + image.ram_bytes
    assert (of_elf.elf, of_hex.elf, of_elf.begin) == (ELF, None, 0)
    assert not of_elf.assumed and "does not say which chip" in of_hex.assumed


def test_bytes_lie_where_a_hex_file_says() -> None:
    program = hex_program(Path("a.hex"), (record(0x10, b"\x01\x02") + record(0x7FFE, b"\x03\x04") + END).encode())
    assert program.flash[0x0F:0x13] == b"\xff\x01\x02\xff" and program.flash[-2:] == b"\x03\x04"
    assert program.code_end == FLASH_SIZE


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "holds no program"),
        (record(0, b"\x01"), "is cut short: its last line is not the record that ends it"),
        (END + record(0, b"\x01"), "line 2: it follows the record that ends the file"),
        (record(0, b"\x01\x02")[:-3] + "00\n" + END, r"line 1: its checksum is 0x00; expected 0xFB"),
        ("\n" + record(0, b"\x01")[1:], "line 2: expected a colon"),
        (record(0, b"\x01")[:-2] + "\n", "line 1: expected a colon, and two digits for each byte"),
        (record(0, b"\x01", 6), "line 1: there is no record of type 6 with 1 bytes of data"),
        (record(0, b"\x01", 4), "line 1: there is no record of type 4 with 1 bytes of data"),
        (record(0, b"\x10\x00", 2) + record(0, b"\x01"), "line 2: its 1 bytes at address 0x10000 do not fit"),
        (record(0, b"\x00\x81", 4) + record(1020, b"\x01" * 5), "line 2: its 5 bytes at address 0x8103FC do not fit"),
        (record(8, b"\1" * 8) + record(0, b"\1" * 9), "line 2: some of its 9 bytes at address 0x0 are there twice"),
        (END * 100_000, "it has 1200000 B; expected 1048576 at most"),
        (END, "holds no program"),
        ("hello\n", "cannot be loaded: line 1: expected a colon"),
        (record(0x7FFF, b"\x01\x02") + END, "its 2 bytes at address 0x7FFF do not fit into an ATmega328P"),
        (record(0, b"\x00\x01", 4) + record(0, b"\x01") + END, "its 1 bytes at address 0x10000 do not fit"),
        ("\x80\xff", "cannot be loaded: line 1: expected a colon"),
    ],
)
def test_a_wrong_hex_file_is_one_sentence(text: str, sentence: str) -> None:
    with pytest.raises(AnalysisError, match=rf"the firmware image a\.hex .*{sentence}") as refused:
        hex_program(Path("a.hex"), text.encode("latin-1"))
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(AnalysisError, match=r"a\.hex cannot be read: No such file"):
        read_program(tmp_path / "a.hex")


def test_segments_starts_and_eeprom_are_where_records_say() -> None:
    lines = (
        *(record(0, b"\x01\x00", 2), record(0, b"\xaa"), record(0, b"\0\0\0\0", 3), record(0, b"\0\0\0\0", 5)),
        *(record(0, b"\x00\x81", 4), record(3, b"\xbb"), record(0, b"\x00\x82", 4), record(0, b"\xcc"), END, "\r\n"),
    )
    program = hex_program(Path("a.hex"), "".join(lines).replace("\n", "\r\n").encode())
    assert (program.flash[0x1000], program.eeprom[3], program.code_end) == (0xAA, 0xBB, 0x1001)
    assert program.flash.count(0xFF) == FLASH_SIZE - 1


RECORDS = st.builds(
    record, st.sampled_from((0, 1, 8, 0x7FF0, 0xFFFF)), st.binary(max_size=9) | st.just(b"\0\0"), st.integers(0, 6)
)


@given(st.lists(RECORDS | st.just(END) | st.text(":0F\n", max_size=9), max_size=9), st.integers(0, 5))
def test_any_hex_file_is_a_program_or_one_sentence(lines: list[str], cut: int) -> None:
    data = "".join(lines).encode()
    with contextlib.suppress(AnalysisError):
        assert len(hex_program(Path("a.hex"), data[: len(data) - cut]).flash) == FLASH_SIZE
    with contextlib.suppress(AnalysisError):
        elf_program(ELF, data)


@given(st.integers(0, FLASH_SIZE - 300), st.binary(min_size=1, max_size=300), st.randoms(use_true_random=False))
def test_a_hex_file_is_read_in_any_order_and_one_changed_digit_is_found(at: int, data: bytes, chance: Random) -> None:
    lines = [record(at + place, data[place : place + 16]) for place in range(0, len(data), 16)]
    chance.shuffle(lines)
    text = "".join([*lines, END])
    assert hex_program(Path("a.hex"), text.encode()).flash[at : at + len(data)] == data
    place = chance.choice([place for place, digit in enumerate(text) if digit in "0123456789"])
    changed = text[:place] + chance.choice("0123456789".replace(text[place], "")) + text[place + 1 :]
    with pytest.raises(AnalysisError):
        hex_program(Path("a.hex"), changed.encode())


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        (4, 2, "is not an ELF file for an AVR"),  # 64 bits
        (5, 2, "is not an ELF file for an AVR"),  # big-endian
        (18, 62, "is not an ELF file for an AVR"),  # of a PC
        (36, 0x86, r"is for the core avr:6 .*; expected avr:5, the ATmega328P's"),
    ],
)
def test_an_elf_file_for_another_computer_is_one_sentence(place: int, value: int, sentence: str) -> None:
    data = bytearray(ELF.read_bytes())
    data[place] = value
    with pytest.raises(AnalysisError, match=sentence):
        elf_program(ELF, bytes(data))


def test_an_elf_file_cut_anywhere_is_the_program_or_one_sentence() -> None:
    data, whole = ELF.read_bytes(), read_program(ELF)
    for length in range(0, len(data), 97):
        with contextlib.suppress(AnalysisError):
            assert elf_program(ELF, data[:length]).flash == whole.flash


@given(st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 255)), max_size=10), st.integers(0, 4000))
def test_a_damaged_elf_file_is_a_program_or_one_sentence(changes: list[tuple[int, int]], cut: int) -> None:
    data = bytearray(ELF.read_bytes())
    for place, value in changes:
        data[place] = value
    try:
        program = elf_program(ELF, bytes(data[: len(data) - cut]))
        assert 0 < program.code_end <= FLASH_SIZE and len(program.flash) == FLASH_SIZE
    except AnalysisError:
        return
