"""Variables of a program by their names in the source: where each lies in RAM, and what type it has, from the debugging
information (DWARF 4, section 4.1 "Data objects", 5 "Types"; 7.7.1 for the one expression that is read, an address).

Those that the compiler keeps in registers or left out have no address, and cannot be found. Addresses are those of the
data space: RAM begins at 0x100.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from elftools.dwarf.compileunit import CompileUnit
from elftools.dwarf.die import DIE
from elftools.elf.elffile import ELFFile

from boebot.errors import AnalysisError, did_you_mean
from boebot.image.elf import DAMAGE, DATA_SPACE, RAM_END, RAM_START, read_image

ADDRESS = 0x03  # DW_OP_addr
KINDS = {0x02: "b", 0x04: "f", 0x05: "i", 0x06: "i", 0x07: "u", 0x08: "u", 0x10: "u"}  # of numpy, for DW_ATE_..., 7.8
KNOWN = [f"{kind}{size}" for kind in "iu" for size in (1, 2, 4, 8)] + ["b1", "f4", "f8"]
FILE, LINE = "DW_AT_decl_file", "DW_AT_decl_line"
SAME = ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type")


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable with a place in RAM.

    Attributes:
        name: as in the source.
        file: the source file that declares it, without its folder.
        address: its first byte in the data space.
        dtype: little-endian; of an array with its shape; of what is neither a number nor one of those (a structure, 24
            bits) the kind "V", bytes.
    """

    name: str
    file: str
    address: int
    dtype: np.dtype[Any]


@dataclass(frozen=True, slots=True)
class Variables:
    """Those of a program."""

    path: Path
    all: tuple[Variable, ...]

    def find(self, name: str) -> Variable:
        """By its name; `file.c:name` where several files have one.

        Raises:
            AnalysisError: there is none, or more than one.
        """
        found = [each for each in self.all if name in (each.name, f"{each.file}:{each.name}")]
        if len(found) == 1:
            return found[0]
        if found:
            places = ", ".join(sorted(f"{each.file}:{each.name}" for each in found))
            raise AnalysisError(f"{self.path} has {len(found)} variables {name}; expected one: {places}")
        hint = did_you_mean(name, [each.name for each in self.all])
        raise AnalysisError(
            f"{self.path} has no variable {name} in RAM (the compiler keeps some in registers or flash, or leaves them "
            f"out); expected one that is global, static or volatile{hint}"
        )


def read_variables(path: Path) -> Variables:
    """Those of an ELF file.

    Raises:
        AnalysisError: it is no program for the ATmega328P, is damaged, or has no debugging information.
    """
    read_image(path)  # refuses what is no program
    try:
        return _read(path, path.read_bytes())
    except DAMAGE as error:
        raise AnalysisError(
            f"the debugging information of {path} cannot be read ({type(error).__name__}); expected DWARF as avr-gcc "
            "-gdwarf-4 writes it"
        ) from error


@lru_cache(maxsize=4)
def _read(path: Path, data: bytes) -> Variables:
    elf = ELFFile(BytesIO(data))
    units = elf.get_dwarf_info(relocate_dwarf_sections=False).iter_CUs() if elf.has_dwarf_info() else ()
    named = [
        die for unit in units for die in unit.iter_DIEs() if die.tag == "DW_TAG_variable" and _attribute(die, LINE)
    ]
    if not named:  # avr-libc's start-up code has the registers, of no line
        raise AnalysisError(f"{path} has no debugging information; expected a program built with avr-gcc -gdwarf-4")
    found: dict[tuple[Any, int], Variable] = {}
    for die in named:
        name, address = _attribute(die, "DW_AT_name"), _address(die)
        if name and address is not None and (name, address) not in found:
            found[name, address] = Variable(name.decode("utf-8", "replace"), _file(die), address, _type(die))
    return Variables(path, tuple(found.values()))


def _holder(die: DIE, attribute: str) -> DIE | None:
    """The entry that has an attribute: this one, or what it is a copy or the definition of."""
    if attribute in die.attributes:
        return die
    links = [link for link in ("DW_AT_specification", "DW_AT_abstract_origin") if link in die.attributes]
    return _holder(die.get_DIE_from_attribute(links[0]), attribute) if links else None


def _attribute(die: DIE, attribute: str) -> Any:
    """Its value; None: it has none."""
    holder = _holder(die, attribute)
    return holder and holder.attributes[attribute].value


def _file(die: DIE) -> str:
    """In which it is declared, without its folder."""
    holder = _holder(die, FILE)
    lines = holder.dwarfinfo.line_program_for_CU(holder.cu) if holder and isinstance(holder.cu, CompileUnit) else None
    if lines is None:
        return ""
    number = _attribute(die, FILE) - (0 if lines["version"] >= 5 else 1)
    return PurePosixPath(lines["file_entry"][number].name.decode("utf-8", "replace")).name


def _address(die: DIE) -> int | None:
    """In the data space; None: it has no place in RAM."""
    said = _attribute(die, "DW_AT_location")
    if not isinstance(said, list) or len(said) != 5 or said[0] != ADDRESS:
        return None
    address = int.from_bytes(said[1:], "little")
    return address - DATA_SPACE if RAM_START <= address < RAM_END else None


def _type(die: DIE) -> np.dtype[Any]:
    """Of a variable, an element, or what has another name for a type."""
    holder = _holder(die, "DW_AT_type")
    kind = holder and holder.get_DIE_from_attribute("DW_AT_type")
    if kind is None or kind.tag in SAME:
        return np.dtype("V0") if kind is None else _type(kind)
    size, children, code = _attribute(kind, "DW_AT_byte_size") or 0, [*kind.iter_children()], "V"
    if kind.tag == "DW_TAG_array_type":
        most = [_attribute(each, "DW_AT_upper_bound") for each in children if each.tag == "DW_TAG_subrange_type"]
        return np.dtype((_type(kind), tuple(0 if last is None else last + 1 for last in most)))
    if kind.tag == "DW_TAG_base_type":
        code = KINDS.get(_attribute(kind, "DW_AT_encoding"), "V")
    elif kind.tag == "DW_TAG_pointer_type":
        code, size = "u", 2
    elif kind.tag == "DW_TAG_enumeration_type":
        code = "i" if any(_attribute(each, "DW_AT_const_value") < 0 for each in children) else "u"
    return np.dtype(f"<{code}{size}" if f"{code}{size}" in KNOWN else f"V{size}")
