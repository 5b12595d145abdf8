"""Where an address of a program is, for people: its function and source line; and which labels are of a function."""

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


def is_of(label: str, name: str) -> bool:
    """A name in the image is that of a function of the source: the compiler may have made a copy of it, or a part, with
    more behind its name (`f.lto_priv.3`, `f.constprop.0`, `f.part.1`); names of C++ (`pulse`, `Servo::write`) have
    lengths before them and types behind (Itanium C++ ABI, 5.1)."""
    coded = "".join(f"{len(word)}{word}" for word in name.split("::"))
    cpp = (f"_ZN{coded}E", f"_ZNK{coded}E") if "::" in name else (f"_Z{coded}", f"_ZL{coded}")
    return label == name or label.startswith((f"{name}.", *cpp))
