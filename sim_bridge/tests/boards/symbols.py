"""Where a variable or a function of an AVR image lies, by its name in the ELF file's symbol table."""

from __future__ import annotations

import io
from pathlib import Path
from typing import NamedTuple

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

DATA_BASE = 0x800000  # where the linker puts the data space of an AVR, and behind it the EEPROM


class Symbol(NamedTuple):
    """A variable: address in the data space, or in the EEPROM, and size in bytes."""

    address: int
    size: int


def _symbols(image: Path | bytes) -> list[tuple[str, int, int]]:
    """Name, value and size of all."""
    elf = ELFFile(io.BytesIO(image if isinstance(image, bytes) else image.read_bytes()))
    table = elf.get_section_by_name(".symtab")
    if not isinstance(table, SymbolTableSection):
        return []
    return [(symbol.name, symbol["st_value"], symbol["st_size"]) for symbol in table.iter_symbols()]


def entry_of(image: Path | bytes, name: str) -> int:
    """Where the function, or label, of that name begins: a byte address in flash. KeyError if there is none."""
    found = {value for label, value, _ in _symbols(image) if label == name and value < DATA_BASE}
    if len(found) != 1:
        raise KeyError(name)
    return found.pop()


def find_symbol(image: Path | bytes, name: str) -> Symbol:
    """The variable of that name in an ELF image; KeyError if there is none, ValueError if the name is not unique."""
    found = {
        Symbol(value & 0xFFFF, size) for label, value, size in _symbols(image) if label == name and value >= DATA_BASE
    }
    if not found:
        raise KeyError(name)
    if len(found) > 1:
        raise ValueError(f"{name} names {len(found)} variables")
    return found.pop()
