"""Programs from ELF and HEX files: what lies in flash, and files that are none."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from hypothesis import example, given
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
        (END, "holds no program"),
        ("hello\n", "is no HEX file, or is damaged: .*line 1"),
        (record(0, b"\x01\x02")[:-3] + "00\n" + END, "is no HEX file, or is damaged: .*line 1"),
        (record(0, b"\x01") + record(0, b"\x02") + END, "is no HEX file, or is damaged"),
        (record(0x7FFF, b"\x01\x02") + END, "its 2 bytes at address 0x7FFF do not fit into an ATmega328P"),
        (record(0, b"\x00\x01", 4) + record(0, b"\x01") + END, "its 1 bytes at address 0x10000 do not fit"),
        ("\x80\xff", "is no HEX file, or is damaged"),
    ],
)
def test_a_wrong_hex_file_is_one_sentence(text: str, sentence: str) -> None:
    with pytest.raises(AnalysisError, match=rf"the firmware image a\.hex .*{sentence}") as refused:
        hex_program(Path("a.hex"), text.encode("latin-1"))
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(AnalysisError, match=r"a\.hex cannot be read: No such file"):
        read_program(tmp_path / "a.hex")


@given(st.binary(max_size=200))
@example(b":00000001FF\n:")
@example(b":020000021000EC\n:0100000001FE\n")
def test_any_hex_file_is_a_program_or_one_sentence(data: bytes) -> None:
    try:
        assert len(hex_program(Path("a.hex"), data).flash) == FLASH_SIZE
    except AnalysisError:
        return


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
