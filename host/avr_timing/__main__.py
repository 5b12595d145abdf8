"""`python -m avr_timing IMAGE [FUNCTION ...]`: what functions of an AVR image take at most, interrupts not counted."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from avr_timing.bounds.stack import Stack
from avr_timing.bounds.wcet import WorstCase
from avr_timing.bounds.worst_path import worst_path
from avr_timing.errors import AnalysisError
from avr_timing.flow.graph import program_of
from avr_timing.image.elf import read_image


def main(arguments: list[str] | None = None) -> int:
    """Prints a row for each function. Exit code: 0, or 2 where the image or a function is refused."""
    parser = argparse.ArgumentParser("python -m avr_timing", description="Worst case of functions of an AVR image.")
    parser.add_argument("image", type=Path, help="ELF file for the ATmega328P, with symbols")
    parser.add_argument("function", nargs="*", help="names; else all functions of the image")
    parser.add_argument("--path", action="store_true", help="the worst path of the functions that are named, by line")
    given = parser.parse_args(arguments)
    try:
        (_show_paths if given.path else _show_bounds)(given.image, given.function)
    except AnalysisError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _show_bounds(path: Path, names: list[str]) -> None:
    image = read_image(path)
    program = program_of(image)
    worst, stack = WorstCase(program), Stack(program)
    names = names or sorted(name for name, entry in program.by_name.items() if entry)  # without the reset
    entries = {name: program.entry(name) for name in names}
    print(f"{path.name}: {image.flash_bytes:,} bytes of flash, {image.ram_bytes:,} of RAM without the stack")
    print(f"{'cycles':>10} {'stack':>6}  function")
    for name, entry in entries.items():
        cycles, no_cycles = _text(lambda entry: worst.of(entry).cycles, entry)
        depth, no_depth = _text(lambda entry: stack.of(entry).bytes, entry)
        reasons = "; ".join(dict.fromkeys(reason for reason in (no_cycles, no_depth) if reason))
        print(f"{cycles:>10} {depth:>6}  {name}{reasons and f': {reasons}'}")


def _text(bound: Callable[[int], int], entry: int) -> tuple[str, str]:
    """The bound of a function as text, and why there is none."""
    try:
        return f"{bound(entry):,}", ""
    except AnalysisError as error:
        return "-", str(error)


def _show_paths(path: Path, names: list[str]) -> None:
    program = program_of(read_image(path))
    for name in names:
        rows = worst_path(WorstCase(program), program.entry(name))
        print(f"{sum(row.cycles for row in rows):>10,}  {name}")
        for row in rows:
            print(f"{row.cycles:>10,}  {row.function} {row.line or '-'}, {row.runs:,} times")


if __name__ == "__main__":
    sys.exit(main())
