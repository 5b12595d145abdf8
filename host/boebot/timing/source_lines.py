"""Source lines of an image's instructions, from its debugging information (DWARF, section 6.2 of its standard).

avr-gcc before version 8 writes DWARF with `-gdwarf-4`; its `-g` means stabs, whose addresses the linker's relaxation
(`--relax`) leaves as they were. They are wrong then, and are not read.
"""

from __future__ import annotations

from elftools.elf.elffile import ELFFile


def source_lines(elf: ELFFile, end: int) -> dict[int, str]:
    """ "file.c:123" of each even address below `end` that the debugging information covers; none without it."""
    lines: dict[int, str] = {}
    if not elf.has_dwarf_info():
        return lines
    dwarf = elf.get_dwarf_info(relocate_dwarf_sections=False)
    for unit in dwarf.iter_CUs():
        program = dwarf.line_program_for_CU(unit)
        if program is None:
            continue
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
