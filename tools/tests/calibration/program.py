"""All rows, and the image that measures them: program.S with the rows' code, assembled by avr-gcc."""

from __future__ import annotations

import subprocess
import tempfile
import zlib
from functools import cache
from pathlib import Path

from boebot.errors import BoardError
from tools.tests.calibration import instructions, interrupts, peripherals, timers
from tools.tests.calibration.rows import Row

FRAME = Path(__file__).with_name("program.S")
ROWS: tuple[Row, ...] = (*instructions.ROWS, *interrupts.ROWS, *timers.ROWS, *peripherals.ROWS)


def _code(row: Row) -> str:
    return f"{row.code}\ncall {'report_number' if row.is_number else 'report'}\n"


def source() -> str:
    """The rows' part of the program."""
    return "\n".join(map(_code, ROWS))


def name() -> str:
    """The name that the program sends; another name means another program."""
    return f"boebot calibration {zlib.crc32((FRAME.read_text(encoding='ascii') + source()).encode()):08X}"


@cache
def image() -> bytes:
    """The ELF image.

    Raises:
        BoardError: avr-gcc is missing or refuses the program.
    """
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "rows.inc").write_text(source(), encoding="ascii")
        elf = Path(folder, "calibration.elf")
        options = ["-mmcu=atmega328p", f"-I{folder}", f'-DPROGRAM_NAME="{name()}"']
        _run(["avr-gcc", *options, "-o", str(elf), str(FRAME)], "assembles the calibration program")
        return elf.read_bytes()


def _run(command: list[str], purpose: str) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        raise BoardError(f"{command[0]}, which {purpose}, cannot be run: {error.strerror}") from error
    if done.returncode:
        raise BoardError(f"{command[0]}, which {purpose}, failed: {done.stderr.strip()}")
