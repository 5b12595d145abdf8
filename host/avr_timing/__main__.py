"""`python -m avr_timing IMAGE [FUNCTION ...]`: what functions of an AVR image take at most, interrupts not counted."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from avr_timing.bounds.stack import Stack
from avr_timing.bounds.wcet import WorstCase
from avr_timing.bounds.worst_path import worst_path
from avr_timing.flow.graph import program_of
from avr_timing.program import Program
from boebot.errors import AnalysisError
from boebot.image.elf import Image, read_image


def main(arguments: list[str] | None = None) -> int:
    """Prints a row for each function. Exit code: 0; 1 where a function that is named has no bound, or any could not be
    followed; 2 where the image is refused, or the path of a function."""
    parser = argparse.ArgumentParser("python -m avr_timing", description="Worst case of functions of an AVR image.")
    parser.add_argument("image", type=Path, help="ELF file for the ATmega328P, with symbols")
    parser.add_argument("function", nargs="*", help="names; else all functions of the image")
    parser.add_argument("--path", action="store_true", help="the worst path of the functions that are named, by line")
    given = parser.parse_args(arguments)
    try:
        image = read_image(given.image)
        if image.assumed_chip:
            print(image.assumed_chip, file=sys.stderr)
        program = program_of(image)
        entries = {name: program.entry(name) for name in given.function}
        if given.path:
            _show_paths(program, entries)
            return 0
        return 0 if _show_bounds(image, program, entries) else 1
    except AnalysisError as error:
        print(error, file=sys.stderr)
        return 2


def _show_bounds(image: Image, program: Program, asked: dict[str, int]) -> bool:
    """Whether all functions have bounds that were asked for; of a whole image, whether all could be followed."""
    worst, stack = WorstCase(program), Stack(program)
    unnamed = program.functions if not program.by_name else program.unproven
    found = program.by_name | {program.functions[entry].name: entry for entry in unnamed}
    # Without the reset, where that can be followed.
    entries = asked or {name: entry for name, entry in sorted(found.items()) if entry or entry in program.unproven}
    judged, name = bool(asked) or not program.unproven, Path(image.path).name
    print(f"{name}: {image.flash_bytes:,} bytes of flash, {image.ram_bytes:,} of RAM without the stack")
    print(f"{'cycles':>10} {'stack':>6}  function")
    for name, entry in entries.items():
        cycles, no_cycles = _text(lambda entry: worst.of(entry).cycles, entry)
        depth, no_depth = _text(stack.of, entry)
        reasons = "; ".join(dict.fromkeys(reason for reason in (no_cycles, no_depth) if reason))
        judged = judged and not (asked and reasons)
        print(f"{cycles:>10} {depth:>6}  {name}{reasons and f': {reasons}'}")
    return judged


def _text(bound: Callable[[int], int], entry: int) -> tuple[str, str]:
    """The bound of a function as text, and why there is none."""
    try:
        return f"{bound(entry):,}", ""
    except AnalysisError as error:
        return "-", str(error)


def _show_paths(program: Program, asked: dict[str, int]) -> None:
    """Raises AnalysisError where one has no bound."""
    for name, entry in asked.items():
        rows = worst_path(WorstCase(program), entry)
        print(f"{sum(row.cycles for row in rows):>10,}  {name}")
        for row in rows:
            print(f"{row.cycles:>10,}  {row.function} {row.line or '-'}, {row.runs:,} times")


if __name__ == "__main__":
    if sys.platform != "win32":
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # what is behind a pipe may not read to the end
    sys.exit(main())
