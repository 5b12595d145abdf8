"""The timing table of an image, read from its section alone: as another reader of ELF finds it, and damaged files."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile
from timing_program import build

from boebot import resources
from boebot.errors import TimingError
from boebot.timing.table import read_table, table_of


@pytest.mark.parametrize("pin_map", ["boebot", "shieldbot", "shieldbot-basic", "shieldbot-line", "shieldbot-quad"])
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
def test_what_is_no_image_is_refused(tmp_path: Path, data: bytes, sentence: str) -> None:
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
