"""Where an address of a program is, for people: its function and source line."""

from __future__ import annotations

from bisect import bisect_right

from boebot.image.elf import Image


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
