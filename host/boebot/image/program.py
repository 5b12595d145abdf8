"""A program as it lies in the chip's memories, from an ELF file or from one in Intel's HEX format.

Of an ELF file it takes what a loader takes: the segments, whose physical addresses say where their bytes go: flash from
0, EEPROM from 0x810000; fuses and lock bits from 0x820000 are not needed. A program that begins in the boot section has
its reset there (ATmega328P data sheet 27.6: the fuse BOOTRST). Segments also say where the code ends, and where the
variables do. A HEX file says only which bytes the flash has.

Every emulated board reads one, so an ELF file needs no library here.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from boebot.errors import AnalysisError
from boebot.files import regular
from boebot.image import HEADER
from boebot.image.chip import CHIP, assumed_chip

ELF, HEX = ".elf", ".hex"
SEGMENT = struct.Struct("<8I")  # type, offset, virtual and physical address, bytes in the file and in memory, flags
LOADED, EXECUTABLE = 1, 1  # a segment's type, and one of its flags
FLASH_SIZE, EEPROM_SIZE = 0x8000, 1024  # bytes
RAM_BEGIN, RAM_END = 0x100, 0x900
BOOT_BEGIN = 0x7000  # of the largest boot section
DATA_SPACE, EEPROM_SPACE = 0x800000, 0x810000  # where ELF files have these memories
OTHER_SPACES = 0x820000  # from here on fuses, lock bits, signature
SIZE_MAXIMUM = 64 << 20  # bytes of a file


@dataclass(frozen=True, slots=True)
class Program:
    """What is in the chip before its first reset.

    Attributes:
        flash: from address 0; a byte that the file does not give is 0xFF.
        eeprom: all of it, likewise.
        begin: where the reset leads: 0, or an address in the boot section.
        code_end: behind the last byte that can be an instruction.
        variables_end: the first address of RAM behind the variables; RAM_BEGIN where the file does not say it.
        elf: the file, if it can say more of addresses (boebot.image.elf).
        assumed: a sentence where the file does not say for which chip it is, or "".
    """

    flash: bytes
    eeprom: bytes
    begin: int
    code_end: int
    variables_end: int
    elf: Path | None
    assumed: str


def read_program(path: Path) -> Program:
    """The program in an ELF or HEX file.

    Raises:
        AnalysisError: it cannot be read, is neither of them, is damaged, or is no program for the ATmega328P.
    """
    try:
        data = regular(path, SIZE_MAXIMUM).read_bytes()
    except OSError as error:
        raise AnalysisError(f"the firmware image {path} cannot be read: {error.strerror or error}") from error
    return hex_program(path, data) if path.suffix.lower() == HEX else elf_program(path, data)


def elf_program(path: Path, data: bytes) -> Program:
    """The program in the bytes of an ELF file at that path. Raises as `read_program`."""
    what = f"the firmware image {path}"
    assumed = assumed_chip(what, data)
    memory = _Memory(what)
    begin, table, size, count = (HEADER.unpack_from(data)[number] for number in (4, 5, 9, 10))
    code_end, variables_end = 0, RAM_BEGIN
    for number in range(count):
        at = table + number * size
        if size < SEGMENT.size or at + SEGMENT.size > len(data):
            raise AnalysisError(f"{what} cannot be loaded: its segment table is damaged")
        kind, offset, place, address, length, in_memory, flags, _ = SEGMENT.unpack_from(data, at)
        if kind != LOADED:
            continue
        if flags & EXECUTABLE and address < FLASH_SIZE:
            code_end = max(code_end, address + length)
        first = place - DATA_SPACE
        if 0 <= first < RAM_END and in_memory < RAM_END - first:  # else they leave no memory for a stack
            variables_end = max(variables_end, first + in_memory)
        if offset + length > len(data):
            raise AnalysisError(f"{what} cannot be loaded: it is cut short")
        memory.put(address, data[offset : offset + length])
    return memory.program(begin if BOOT_BEGIN <= begin < code_end else 0, code_end, variables_end, path, assumed)


def hex_program(path: Path, data: bytes) -> Program:
    """The program in the bytes of a HEX file at that path. Raises as `read_program`."""
    from intelhex import IntelHex, IntelHexError

    what = f"the firmware image {path}"
    found = IntelHex()
    try:
        found.loadhex(StringIO(data.decode("ascii")))
    except (IntelHexError, UnicodeDecodeError) as error:
        raise AnalysisError(f"{what} is no HEX file, or is damaged: {' '.join(str(error).split())}") from None
    memory = _Memory(what)
    for begin, end in found.segments():
        memory.put(begin, found.tobinstr(begin, end - 1))
    assumed = f"{what} does not say which chip it is for: it is taken for an {CHIP}"
    return memory.program(0, memory.flash_end, RAM_BEGIN, None, assumed)


class _Memory:
    """Flash and EEPROM while they are being filled."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._flash, self._eeprom = bytearray(b"\xff" * FLASH_SIZE), bytearray(b"\xff" * EEPROM_SIZE)
        self.flash_end = 0

    def put(self, address: int, data: bytes) -> None:
        """Bytes at an address as files have it."""
        into, at = (self._flash, address) if address < DATA_SPACE else (self._eeprom, address - EEPROM_SPACE)
        if not data or address >= OTHER_SPACES:
            return
        if at < 0 or at + len(data) > len(into):
            what = f"its {len(data)} bytes at address 0x{address:X}"
            raise AnalysisError(f"{self._what} cannot be loaded: {what} do not fit into an {CHIP}")
        into[at : at + len(data)] = data
        if into is self._flash:
            self.flash_end = max(self.flash_end, at + len(data))

    def program(self, begin: int, code_end: int, variables_end: int, elf: Path | None, assumed: str) -> Program:
        """All of it."""
        if not code_end or not self.flash_end:
            raise AnalysisError(f"{self._what} cannot be loaded: it holds no program")
        return Program(bytes(self._flash), bytes(self._eeprom), begin, code_end, variables_end, elf, assumed)
