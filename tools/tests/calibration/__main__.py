"""Measures the calibration's rows and prints them beside the data sheet: `python -m tools.tests.calibration`.

The exit code is 1 when the emulator or the board differs from the data sheet in a row where that is not known, 2 when
something could not be measured at all.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from boebot.errors import BoebotError
from tools.tests.calibration import board, emulator, table
from tools.tests.printed import reprint


def measured(port: str | None, flash: bool) -> table.Calibration:
    """All columns that can be had."""
    real = None
    if port is not None:
        if flash:
            board.flash(port)
        real = board.listen(port)
    return table.Calibration(emulator.measure(), real)


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tools.tests.calibration",
        description="Calibration of the emulated board against the data sheet.",
    )
    parser.add_argument("--port", help="serial port of a board, which is flashed and measured too")
    parser.add_argument("--no-flash", action="store_true", help="the board holds the program already")
    parser.add_argument("--page", type=Path, metavar="FILE", help="print the table onto this page of the documentation")
    chosen = parser.parse_args(arguments)
    try:
        result = measured(chosen.port, not chosen.no_flash)
        if chosen.page is not None:
            reprint(chosen.page, table.printed(result))
    except (BoebotError, OSError) as error:
        print(f"calibration: {error}", file=sys.stderr)
        return 2
    wrong = table.wrong_rows(result)
    print(table.printed(result), *(f"Not as expected: {line}" for line in wrong), sep="\n")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
