"""Source lines of an image's instructions, from its debugging information (DWARF, section 6.2 of its standard).

avr-gcc before version 8 writes DWARF with `-gdwarf-4`; its `-g` means stabs, whose addresses the linker's relaxation
(`--relax`) leaves as they were. They are wrong then, and are not read. clang's addresses have two bytes, of which its
DWARF 5 has.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterator

from elftools.construct import ULInt16
from elftools.dwarf.dwarfinfo import DWARFInfo
from elftools.dwarf.lineprogram import LineProgram
from elftools.dwarf.structs import DWARFStructs
from elftools.elf.elffile import ELFFile


def source_lines(elf: ELFFile, end: int) -> dict[int, tuple[str, int]]:
    """Source file, with its folders, and line of each even address below `end` that the debugging information covers;
    none without it."""
    lines: dict[int, tuple[str, int]] = {}
    if not elf.has_dwarf_info():
        return lines
    for program, folder in _programs(elf.get_dwarf_info(relocate_dwarf_sections=False)):
        first = 0 if program["version"] >= 5 else 1  # DWARF 5 numbers its files from 0, and its folders
        folders = [*([folder] if first else []), *(_text(each) for each in program["include_directory"])]
        files = [
            posixpath.normpath(posixpath.join(folder, folders[entry.dir_index], _text(entry.name)))
            for entry in program["file_entry"]
        ]
        before = None
        for entry in program.get_entries():
            state = entry.state
            if state is None:
                continue
            if before is not None:
                place = (files[before.file - first], before.line)
                for address in range(before.address, min(state.address, end), 2):
                    lines[address] = place
            before = None if state.end_sequence else state
    return lines


def _text(name: bytes) -> str:
    return name.decode("utf-8", "replace")


def _programs(dwarf: DWARFInfo) -> Iterator[tuple[LineProgram, str]]:
    """The line programs that are not empty, and the folder in which the compiler ran; since DWARF 5 it is the first of
    the program's own. Before DWARF 5 only the units say it, and how long addresses are; pyelftools raises
    AssertionError where that is neither 4 nor 8 bytes."""
    offset, folders = 0, dict[int, str]()
    while dwarf.debug_line_sec is not None and offset < dwarf.debug_line_sec.size:
        program, begin = dwarf._parse_line_program_at_offset(offset, dwarf.structs), offset
        offset = program.program_end_offset
        if program.program_start_offset == offset:
            continue
        if program["version"] < 5:
            folders = folders or dict(_folders(dwarf))
        elif program["address_size"] == 2:
            program.structs = _Narrow()
        yield program, folders.get(begin, "")


def _folders(dwarf: DWARFInfo) -> Iterator[tuple[int, str]]:
    """Of each unit where its line program begins, and the folder in which the compiler ran."""
    for unit in dwarf.iter_CUs():
        said = unit.get_top_DIE().attributes
        if "DW_AT_stmt_list" in said:
            yield said["DW_AT_stmt_list"].value, _text(said["DW_AT_comp_dir"].value) if "DW_AT_comp_dir" in said else ""


class _Narrow(DWARFStructs):
    """Little-endian, with addresses of two bytes."""

    def __new__(cls) -> _Narrow:
        self = object.__new__(cls)
        self.little_endian, self.dwarf_format, self.address_size, self.dwarf_version = True, 32, 4, 5
        self._create_structs()
        self.the_Dwarf_target_addr = ULInt16("")
        return self
