"""Where an address of a program is, for people: its function and source line, out of the image's ELF file."""

from __future__ import annotations

import contextlib
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path

from boebot.boards import WatchdogReset
from boebot.errors import TimingError
from boebot.timing.elf import Image, read_image

CLOCK_HZ = 16_000_000
PROLOGUE = "__prologue_saves__"  # of libgcc, without source lines: -mcall-prologues


def place(image: Image, address: int) -> str:
    """The function that an address lies in and the line that it came from, as far as the image says:
    `in safety_task (safety.c:57)`; empty where it says neither."""
    functions = sorted(
        (symbol.address, -symbol.size, symbol.strength, symbol.name)
        for symbol in image.symbols
        if symbol.kind == "STT_FUNC" or (symbol.kind == "STT_NOTYPE" and not symbol.name.startswith((".", "L")))
    )
    at = bisect_right(functions, (address, 1, 0, "")) - 1
    within = [name for start, size, _, name in functions[: at + 1] if start <= address < start - size]
    if not within and at >= 0 and functions[at][1] == 0:  # a label of a program in assembler
        within = [functions[at][3]]
    line = image.lines.get(address & ~1)
    parts = [f"in {within[-1].partition('.')[0]}" if within else "", f"({line})" if line else ""]
    return " ".join(part for part in parts if part)


def with_place(fault: str, elf: Path | None, address: int, z: int = 0) -> str:
    """What went wrong, with the place of that address behind it, by the image's file; without where there is none.

    `z`: the register Z then, by which a function says where it goes on to the code that saves registers for all.
    """
    if elf is None or address < 0:
        return fault
    try:
        image = read_image(elf)
    except TimingError:
        return fault
    where = place(image, address)
    if where == f"in {PROLOGUE}" and (caller := place(image, 2 * z)):
        where += f" of {caller.removeprefix('in ')}"
    return f"{fault} {where}".rstrip()


def watchdog_resets(log: Sequence[tuple[int, int]], elf: Path | None) -> list[WatchdogReset]:
    """What the log of a board's watchdog says (`BoardMemory.watchdog_log`), with places by the image's file."""
    places: dict[int, str] = {}
    if log and elf is not None:
        with contextlib.suppress(TimingError):
            image = read_image(elf)
            places = {address: place(image, address) for _, address in log}
    return [
        WatchdogReset(cycle=cycle, time_s=cycle / CLOCK_HZ, address=address, place=places.get(address, ""))
        for cycle, address in log
    ]
