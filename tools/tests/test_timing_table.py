"""The rows of tasks.def: in every image as they stand there, on the documentation's page, and as the chip has them."""

from __future__ import annotations

from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from boebot_timing.table import Table
from tools import timing_table
from tools.avr_program import IMAGES

FOLDER = timing_table.ROOT / "build" / "images"
TABLE = timing_table.read_table()


def lines_of(table: Table) -> list[str]:
    """As an image has them."""
    return [
        *(f"TASK {t.name} {t.period} {t.phase} {t.budget}" for t in table.tasks),
        *(f"INTERRUPT {i.name} {i.vector} {i.budget} {i.latency} {i.interval}" for i in table.interrupts),
        *(f"SENSOR {s.name} {s.conversion} {s.period} {s.age}" for s in table.sensors),
    ]


@pytest.mark.parametrize("pin_map", IMAGES)
def test_an_image_carries_the_table(pin_map: str) -> None:
    with (FOLDER / f"{pin_map}.elf").open("rb") as file:
        elf = ELFFile(file)
        rows, symbols = elf.get_section_by_name(".boebot.timing"), elf.get_section_by_name(".symtab")
        assert rows is not None
        assert isinstance(symbols, SymbolTableSection)
        text = rows.data()
        vectors = {
            int(name.removeprefix("__vector_"))
            for symbol in symbols.iter_symbols()
            if (name := symbol.name).removeprefix("__vector_").isdigit() and symbol["st_info"]["bind"] == "STB_GLOBAL"
        }
    *rows_, rest = text.decode("ascii").split("\0")
    assert rest == ""
    expected = [line for line in lines_of(TABLE) if not line.startswith("TASK line ") or pin_map == "shieldbot-line"]
    assert [row for row in rows_ if not row.startswith("CONSTANT ")] == expected
    assert vectors == {row.vector for row in TABLE.interrupts}, "every interrupt in use has a row, and no other"


def test_the_page_is_of_this_table() -> None:
    assert timing_table.PAGE.read_text(encoding="utf-8") == timing_table.page(TABLE), (
        "make it anew: python -m tools.timing_table --page docs/reference/timing-table.md"
    )


def test_a_sensor_is_at_least_as_old_as_a_reading_takes() -> None:
    assert all(row.age >= row.conversion for row in TABLE.sensors)


def test_a_damaged_row_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "tasks.def"
    table.write_text("TASK(whisker, 1, 0, 200)\nTASK(safety, 1, x, 500)\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"tasks\.def: 'TASK\(safety, 1, x, 500\)' is no row"):
        timing_table.read_table(table)
