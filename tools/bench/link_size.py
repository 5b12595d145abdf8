"""Flash and RAM of the link's modules in the linked image: `python -m tools.bench.link_size`.

The image is built once more with debugging information, which changes nothing of it. Code counts for the
source file of its line, wherever the compiler has put it, for the program is optimised as a whole; tables
in flash, variables and what initialises them for the file that declares them. What all of the firmware
shares (the C library, the code that saves registers) belongs to no module.
"""

from __future__ import annotations

import functools
import itertools
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from elftools.dwarf.die import DIE
from elftools.dwarf.dwarf_expr import DWARFExprParser
from elftools.dwarf.lineprogram import LineProgram
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import Symbol, SymbolTableSection

from tools.bench.avr_program import SOURCES, build

FRAME = ("link/frame.c", "link/crc21.h", "link/cobs.h")
DELIVERY = ("link/send.c", "link/requests.c", "link/events.c")
SESSION = ("link/session.c", "link/link.c")
COUNTED = FRAME + DELIVERY + SESSION  # what the 3 KB are for
BESIDE = (
    "link/counters.c",
    "link/dispatch.c",
    "link/identity.c",
    "link/parameters.c",
    "link/telemetry.c",
    "hal/avr/serial_avr.c",
)
RINGS = ("hal_receive_ring", "hal_send_ring")
DATA_SPACE = 0x800000  # where the linker puts RAM
ADDRESS = 0x03  # DW_OP_addr
STEMS_FROM = {"DW_AT_abstract_origin", "DW_AT_specification"}


@dataclass(frozen=True)
class Size:
    """In bytes. Initialised variables count in both."""

    flash: int
    ram: int


def _files(elf: ELFFile) -> dict[int, str]:
    """By address of a variable or table: the source file that declares it, from SOURCES on."""
    dwarf = elf.get_dwarf_info()
    found: dict[int, str] = {}
    for unit in dwarf.iter_CUs():
        expressions, lines = DWARFExprParser(unit.structs), dwarf.line_program_for_CU(unit)
        for entry in unit.iter_DIEs():
            address = _address(entry, expressions)
            if address is None or lines is None:
                continue
            while (reference := STEMS_FROM & entry.attributes.keys()) and "DW_AT_decl_file" not in entry.attributes:
                entry = entry.get_DIE_from_attribute(min(reference))
            if (number := entry.attributes.get("DW_AT_decl_file")) is not None:
                found[address] = _file(lines, number.value)
    return found


def _file(lines: LineProgram, number: int) -> str:
    """From SOURCES on; "": one of a library."""
    file = lines["file_entry"][number - 1]
    path = Path(lines["include_directory"][file.dir_index - 1].decode()) / file.name.decode()
    return path.relative_to(SOURCES).as_posix() if path.is_relative_to(SOURCES) else ""


def _code(elf: ELFFile) -> Counter[str]:
    """Bytes of code by source file."""
    dwarf = elf.get_dwarf_info()
    found: Counter[str] = Counter()
    for unit in dwarf.iter_CUs():
        lines = dwarf.line_program_for_CU(unit)
        if lines is None:
            continue
        rows = [entry.state for entry in lines.get_entries() if entry.state is not None]
        for row, following in itertools.pairwise(rows):
            if not row.end_sequence:
                found[_file(lines, row.file)] += following.address - row.address
    return found


def _address(entry: DIE, expressions: DWARFExprParser) -> int | None:
    """Of a variable; None: of anything else, or of one without a place of its own."""
    if entry.tag != "DW_TAG_variable" or "DW_AT_location" not in entry.attributes:
        return None
    location = entry.attributes["DW_AT_location"]
    operation = expressions.parse_expr(location.value)[0] if location.form == "DW_FORM_exprloc" else None
    return int(operation.args[0]) if operation is not None and operation.op == ADDRESS else None


def _symbols(elf: ELFFile) -> Iterator[Symbol]:
    table = elf.get_section_by_name(".symtab")
    assert isinstance(table, SymbolTableSection)
    yield from table.iter_symbols()


def _span(elf: ELFFile, name: str) -> range:
    """The addresses of a section."""
    section = elf.get_section_by_name(name)
    assert section is not None
    return range(section["sh_addr"], section["sh_addr"] + section["sh_size"])


def _modules_of_tables(elf: ELFFile) -> dict[int, str]:
    """By address: the file that a local symbol belongs to, for tables that the compiler made without telling DWARF."""
    found, file = {}, ""
    for symbol in _symbols(elf):
        if symbol["st_info"]["type"] == "STT_FILE":
            file = symbol.name
        elif symbol["st_info"]["bind"] == "STB_LOCAL" and symbol["st_size"]:
            found[symbol["st_value"]] = file
    return found


@functools.cache
def sizes() -> dict[str, Size]:
    """By source file, "" for what belongs to none: what it takes of the image. The rings are left out."""
    with tempfile.TemporaryDirectory() as folder:
        image = build(Path(folder) / "image.elf", extra=("-gdwarf-4",))
        with image.open("rb") as file:
            return _sizes(ELFFile(file))


def _sizes(elf: ELFFile) -> dict[str, Size]:
    files, tables = _files(elf), _modules_of_tables(elf)
    by_name = {Path(name).name: name for name in files.values()}
    initialised = _span(elf, ".data")
    flash, ram = _code(elf), Counter[str]()
    seen = set()
    for symbol in _symbols(elf):
        address, size = symbol["st_value"], symbol["st_size"]
        if not size or symbol.name in RINGS or address in seen or symbol["st_info"]["type"] != "STT_OBJECT":
            continue
        seen.add(address)
        module = files.get(address) or by_name.get(tables.get(address, ""), "")
        if address < DATA_SPACE or address in initialised:
            flash[module] += size
        if address >= DATA_SPACE:
            ram[module] += size
    image = len(_span(elf, ".text")) + len(initialised)
    flash[""] += image - sum(flash.values())  # vectors, start-up, libraries
    return {module: Size(flash[module], ram[module]) for module in sorted({*flash, *ram})}


def total(modules: tuple[str, ...] = COUNTED) -> Size:
    """Of several source files together. Raises KeyError if the image has nothing of one of them."""
    found = [sizes()[module] for module in modules]
    return Size(sum(size.flash for size in found), sum(size.ram for size in found))


if __name__ == "__main__":
    for group, modules in (("frame", FRAME), ("delivery", DELIVERY), ("session", SESSION)):
        for module in modules:
            print(f"{module:24} {sizes()[module].flash:5} B flash {sizes()[module].ram:4} B RAM")
        print(f"{'  ' + group:24} {total(modules).flash:5} B flash {total(modules).ram:4} B RAM")
    print(f"{'  together':24} {total().flash:5} B flash {total().ram:4} B RAM\nbeside them:")
    for module in BESIDE:
        print(f"{module:24} {sizes()[module].flash:5} B flash {sizes()[module].ram:4} B RAM")
    print(f"{'of no module':24} {sizes()[''].flash:5} B flash {sizes()[''].ram:4} B RAM")
