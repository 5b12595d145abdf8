"""The timing table of an image, read from its section alone: as another reader of ELF finds it, and damaged files."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

import avr_image
from boebot import resources
from boebot.errors import TimingError
from boebot_timing.table import InterruptRow, SensorRow, Table, TaskRow, read_table, table_of
from boebot_timing.tests.timing_program import build
from tools.tests.avr_program import IMAGES

ROWS = """
main: ret
.section .boebot.timing, "", @progbits
"""


@pytest.mark.parametrize("pin_map", IMAGES)
def test_table_is_that_of_the_section(pin_map: str) -> None:
    image = resources.folder("images") / f"{pin_map}.elf"
    with image.open("rb") as stream:
        section = ELFFile(stream).get_section_by_name(".boebot.timing")
        assert section is not None
        data = section.data()
    table = read_table(image)
    assert table == table_of(image, data)
    rows = (*table.tasks, *table.interrupts, *table.sensors)
    assert table.constants is not None and len(rows) + data.count(b"CONSTANT ") == data.count(b"\0")


def test_file_without_a_table_has_no_rows(tmp_path: Path) -> None:
    bare = tmp_path / "bare.elf"
    bare.write_bytes(build(tmp_path).read_bytes().replace(b".boebot.timing", b".nobody.timing"))
    assert read_table(bare).tasks == ()


@pytest.mark.parametrize(
    ("data", "sentence"),
    [(b"", "is not an ELF file"), (b"\x7fELF\x02\x01" + bytes(60), "32 bits"), (b"\x7fELF\x01\x01", "damaged")],
)
def test_a_file_that_is_no_image_is_refused(tmp_path: Path, data: bytes, sentence: str) -> None:
    path = tmp_path / "garbage.elf"
    path.write_bytes(data)
    with pytest.raises(TimingError, match=sentence):
        read_table(path)
    with pytest.raises(TimingError, match="cannot be read"):
        read_table(tmp_path / "none.elf")


def test_damaged_files_end_in_a_table_or_in_one_sentence(tmp_path: Path) -> None:
    whole = build(tmp_path).read_bytes()
    chance, read, refused = random.Random(1), 0, 0
    path = tmp_path / "damaged.elf"
    for number in range(300):
        data = bytearray(whole[: chance.randrange(len(whole))] if number % 3 == 0 else whole)
        for _ in range(number % 3):
            place = chance.choice((chance.randrange(52), chance.randrange(len(whole) - 900, len(whole))))
            data[place] = chance.randrange(256)
        path.write_bytes(data)
        try:
            read_table(path)
            read += 1
        except TimingError:
            refused += 1
    assert refused > 50 and read > 50


def rows(folder: Path, *lines: str) -> Table:
    text = "".join(f'.asciz "{line}"\n' for line in lines)
    return read_table(avr_image.build(folder, ROWS + text, assembler=True))


def test_the_rows_of_the_timing_table_are_read_in_their_order(tmp_path: Path) -> None:
    lines = ["TASK whisker 1 0 200", "INTERRUPT receive 18 48 600 320", "SENSOR ping 18500 5 20000", "TASK ir 2 1 900"]
    table = rows(tmp_path, *lines)
    assert table.tasks == (TaskRow("whisker", 1, 0, 200), TaskRow("ir", 2, 1, 900))
    assert table.interrupts == (InterruptRow("receive", 18, 48, 600, 320),)
    assert table.sensors == (SensorRow("ping", 18500, 5, 20000),)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("TASK whisker 1 0", "a name and 3 whole numbers are expected"),
        ("TASK whisker 1 0 -200", "a name and 3 whole numbers are expected"),
        ("TASK whisker 1 0 2e2", "a name and 3 whole numbers are expected"),
        ("INTERRUPT receive 18 48 600", "a name and 4 whole numbers are expected"),
        ("SENSOR", "a name and 3 whole numbers are expected"),
        ("JOB whisker 1 0 200", "is of no known kind: TASK, INTERRUPT, SENSOR, CONSTANT are expected"),
        ("CONSTANT slot_cycles", "a name and 1 whole numbers are expected"),
        ("CONSTANT slot_cycles 0", "a constant of 0; expected at least 1"),
        ("   ", "is of no known kind"),
        ("TASK first 2 0 10", "two rows of the name 'first'"),
        ("TASK whisker 0 0 200", "phase 0 of period 0; expected a phase below its period"),
        ("TASK whisker 4 4 200", "phase 4 of period 4"),
        ("TASK whisker 4 0 0", "a budget of 0 cycles"),
        ("TASK whisker 4 0 4294967296", "4294967296 is too large; expected at most 4294967295"),
        ("TASK whisker 4 0 " + "9" * 5000, "999999999999 is too large"),
        ("TASK whisker 4099 0 200", "repeat after 4099 slots only; expected at most 4096"),
        ("INTERRUPT receive 0 48 600 320", "vector 0; expected 1 to 25"),
        ("INTERRUPT receive 26 48 600 320", "vector 26; expected 1 to 25"),
        ("INTERRUPT receive 18 48 600 0", "a budget or an interval of 0 cycles"),
        ("SENSOR ping 18500 0 20000", "a period of 0 ticks"),
    ],
)
def test_a_broken_row_is_refused(tmp_path: Path, line: str, expected: str) -> None:
    with pytest.raises(TimingError) as caught:
        rows(tmp_path, "TASK first 1 0 10", line)
    assert expected in str(caught.value) and str(tmp_path) in str(caught.value)
    assert repr(line) in str(caught.value) or "two rows" in expected or "slots" in expected
