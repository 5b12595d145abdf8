"""Where a variable of an AVR image lies, by its name in the ELF file's symbol table."""

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


def find_symbol(image: Path | bytes, name: str) -> Symbol:
    """The variable of that name in an ELF image; KeyError if there is none, ValueError if the name is not unique."""
    elf = ELFFile(io.BytesIO(image if isinstance(image, bytes) else image.read_bytes()))
    table = elf.get_section_by_name(".symtab")
    if not isinstance(table, SymbolTableSection):
        raise KeyError(name)
    found = {
        Symbol(symbol["st_value"] & 0xFFFF, symbol["st_size"])
        for symbol in table.iter_symbols()
        if symbol.name == name and symbol["st_value"] >= DATA_BASE
    }
    if not found:
        raise KeyError(name)
    if len(found) > 1:
        raise ValueError(f"{name} names {len(found)} variables")
    return found.pop()
