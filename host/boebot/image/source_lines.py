"""Source lines of an image's instructions, from its debugging information (DWARF, section 6.2 of its standard).

avr-gcc before version 8 writes DWARF with `-gdwarf-4`; its `-g` means stabs, whose addresses the linker's relaxation
(`--relax`) leaves as they were. They are wrong then, and are not read. clang's addresses have two bytes, of which its
DWARF 5 has.
"""

from __future__ import annotations

from collections.abc import Iterator

from elftools.construct import ULInt16
from elftools.dwarf.dwarfinfo import DWARFInfo
from elftools.dwarf.lineprogram import LineProgram
from elftools.dwarf.structs import DWARFStructs
from elftools.elf.elffile import ELFFile


def source_lines(elf: ELFFile, end: int) -> dict[int, str]:
    """ "file.c:123" of each even address below `end` that the debugging information covers; none without it."""
    lines: dict[int, str] = {}
    if not elf.has_dwarf_info():
        return lines
    for program in _programs(elf.get_dwarf_info(relocate_dwarf_sections=False)):
        first = 0 if program["version"] >= 5 else 1  # DWARF 5 numbers its files from 0
        files = [entry.name.decode("utf-8", "replace").rsplit("/", 1)[-1] for entry in program["file_entry"]]
        before = None
        for entry in program.get_entries():
            state = entry.state
            if state is None:
                continue
            if before is not None:
                text = f"{files[before.file - first]}:{before.line}"
                for address in range(before.address, min(state.address, end), 2):
                    lines[address] = text
            before = None if state.end_sequence else state
    return lines


def _programs(dwarf: DWARFInfo) -> Iterator[LineProgram]:
    """The line programs that are not empty. Before DWARF 5 only the units say how long addresses are; pyelftools raises
    AssertionError where that is neither 4 nor 8 bytes."""
    offset = 0
    while dwarf.debug_line_sec is not None and offset < dwarf.debug_line_sec.size:
        program = dwarf._parse_line_program_at_offset(offset, dwarf.structs)
        offset = program.program_end_offset
        if program.program_start_offset == offset:
            continue
        if program["version"] < 5:
            list(dwarf.iter_CUs())
        elif program["address_size"] == 2:
            program.structs = _Narrow()
        yield program


class _Narrow(DWARFStructs):
    """Little-endian, with addresses of two bytes."""

    def __new__(cls) -> _Narrow:
        self = object.__new__(cls)
        self.little_endian, self.dwarf_format, self.address_size, self.dwarf_version = True, 32, 4, 5
        self._create_structs()
        self.the_Dwarf_target_addr = ULInt16("")
        return self
