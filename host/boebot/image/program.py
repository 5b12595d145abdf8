"""A program as it lies in the chip's memories, from an ELF file or from one in Intel's HEX format.

Of an ELF file it takes what a loader takes: the segments, whose physical addresses say where their bytes go: flash from
0, EEPROM from 0x810000; fuses and lock bits from 0x820000 are not heeded. The fuses are an Uno's; for a program that
begins in the boot section they are so that a reset leads there. Segments also say where the code ends, and where the
variables do. A HEX file says only which bytes the flash has.

Every emulated board reads one, so an ELF file needs no library here.
"""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass
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
# Where a boot section can begin, and the high fuse byte by which it does and a reset leads there: BOOTSZ and BOOTRST
# (ATmega328P data sheet, tables 27-13 and 28-8).
BOOT_SECTIONS = {0x7E00: 0xDE, 0x7C00: 0xDC, 0x7800: 0xDA, 0x7000: 0xD8}
BOOT_BEGIN = min(BOOT_SECTIONS)
HIGH_FUSE = 0xDF  # the boot section from 0x7E00 on, a reset leads to 0
DATA_SPACE, EEPROM_SPACE = 0x800000, 0x810000  # where ELF files have these memories
OTHER_SPACES = 0x820000  # from here on fuses, lock bits, signature
SIZE_MAXIMUM = 64 << 20  # bytes of a file
HEX_MAXIMUM = 1 << 20  # of a HEX file: one with a record for each byte of flash and EEPROM has 0.5 MB
OTHER_BYTES = 5  # of a record besides its data


@dataclass(frozen=True, slots=True)
class Program:
    """What is in the chip before its first reset.

    Attributes:
        flash: from address 0; a byte that the file does not give is 0xFF.
        eeprom: all of it, likewise.
        high_fuse: says where the boot section begins, and whether a reset leads there or to 0.
        code_end: behind the last byte that can be an instruction.
        variables_end: the first address of RAM behind the variables; RAM_BEGIN where the file does not say it.
        elf: the file, if it can say more of addresses (boebot.image.elf).
        assumed: a sentence where the file does not say for which chip it is, or "".
    """

    flash: bytes
    eeprom: bytes
    high_fuse: int
    code_end: int
    variables_end: int
    elf: Path | None
    assumed: str

    @property
    def begin(self) -> int:
        """Where a reset leads, by the fuse: 0, or the begin of the boot section."""
        return next((section for section, fuse in BOOT_SECTIONS.items() if fuse == self.high_fuse), 0)


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


def behind_bootloader(path: Path, program: Program | None) -> Program:
    """A chip whose reset leads into the boot loader in a file; with a program in the flash before it, or none.

    Nothing is known of the code then, as another program may be written at any time.

    Raises:
        AnalysisError: as `read_program`; that is no boot loader, or the program reaches into its section.
    """
    loader = read_program(path)
    first = FLASH_SIZE - len(loader.flash.lstrip(b"\xff"))
    if first < BOOT_BEGIN:
        raise AnalysisError(f"{path} is no boot loader: it begins at 0x{first:04X}; expected 0x7000 at least")
    begin, erased = boot_section(first), b"\xff" * FLASH_SIZE
    flash, eeprom = (erased, loader.eeprom) if program is None else (program.flash, program.eeprom)
    if flash[begin:] != erased[begin:]:
        end = len(flash.rstrip(b"\xff"))
        raise AnalysisError(f"the program fills {end} bytes of flash; expected {begin} at most before the boot loader")
    return Program(flash[:begin] + loader.flash[begin:], eeprom, BOOT_SECTIONS[begin], FLASH_SIZE, RAM_BEGIN, None, "")


def boot_section(first: int) -> int:
    """Where the smallest boot section begins that has code from `first` on."""
    return next(section for section in BOOT_SECTIONS if section <= first)


def elf_program(path: Path, data: bytes) -> Program:
    """The program in the bytes of an ELF file at that path. Raises as `read_program`."""
    what = f"the firmware image {path}"
    assumed = assumed_chip(what, data)
    memory = _Memory(what)
    begin, table, size, count = (HEADER.unpack_from(data)[number] for number in (4, 5, 9, 10))
    code_end, variables_end, boot = 0, RAM_BEGIN, FLASH_SIZE
    for number in range(count):
        at = table + number * size
        if size < SEGMENT.size or at + SEGMENT.size > len(data):
            raise AnalysisError(f"{what} cannot be loaded: its segment table is damaged")
        kind, offset, place, address, length, in_memory, flags, _ = SEGMENT.unpack_from(data, at)
        if kind != LOADED:
            continue
        if flags & EXECUTABLE and address < FLASH_SIZE:
            code_end = max(code_end, address + length)
            boot = min(boot, address) if address >= BOOT_BEGIN else boot
        first = place - DATA_SPACE
        if 0 <= first < RAM_END and in_memory < RAM_END - first:  # else they leave no memory for a stack
            variables_end = max(variables_end, first + in_memory)
        if offset + length > len(data):
            raise AnalysisError(f"{what} cannot be loaded: it is cut short")
        if wrong := memory.unfit(address, data[offset : offset + length]):
            raise AnalysisError(f"{what} cannot be loaded: {wrong}")
    starts_there = BOOT_BEGIN <= begin < code_end
    high_fuse = BOOT_SECTIONS[boot_section(min(boot, begin))] if starts_there else HIGH_FUSE
    return memory.program(high_fuse, code_end, variables_end, path, assumed)


def hex_program(path: Path, data: bytes) -> Program:
    """The program in the bytes of a HEX file at that path. Raises as `read_program`, naming the line.

    A record (Intel, "Hexadecimal Object File Format", revision A): a colon, and in hexadecimal digits the number of
    data bytes, their address (two bytes), the record's type, the data, and what makes the sum of all bytes 0.
    """
    what, base, is_over = f"the firmware image {path}", 0, False
    memory = _Memory(what)
    if len(data) > HEX_MAXIMUM:
        raise AnalysisError(
            f"{what} is no HEX file for an {CHIP}: it has {len(data)} B; expected {HEX_MAXIMUM} at most"
        )
    for number, line in enumerate(data.splitlines(), 1):
        record = line.strip()
        if not record:
            continue
        row, wrong = _bytes_of(record), ""
        if len(row) < OTHER_BYTES or len(row) != row[0] + OTHER_BYTES:
            wrong = "expected a colon, and two digits for each byte of a record as long as it says"
        elif sum(row) & 0xFF:
            wrong = f"its checksum is 0x{row[-1]:02X}; expected 0x{-sum(row[:-1]) & 0xFF:02X}"
        elif is_over:
            wrong = "it follows the record that ends the file"
        else:
            address, body = int.from_bytes(row[1:3], "big"), row[4:-1]
            match row[3], len(body):
                case 0, _:
                    wrong = memory.unfit(base + address, body)
                case 1, 0:
                    is_over = True
                case 2, 2:  # a segment's begin, in paragraphs of 16 bytes
                    base = int.from_bytes(body, "big") << 4
                case 4, 2:  # the upper half of an address
                    base = int.from_bytes(body, "big") << 16
                case 3 | 5, 4:  # where a PC's program begins; an AVR's begins at its reset
                    pass
                case kind, length:
                    wrong = f"there is no record of type {kind} with {length} bytes of data"
        if wrong:
            raise AnalysisError(f"{what} cannot be loaded: line {number}: {wrong}")
    if not is_over and memory.flash_end:
        raise AnalysisError(f"{what} is cut short: its last line is not the record that ends it, :00000001FF")
    assumed = f"{what} does not say which chip it is for: it is taken for an {CHIP}"
    return memory.program(HIGH_FUSE, memory.flash_end, RAM_BEGIN, None, assumed)


def _bytes_of(record: bytes) -> bytes:
    """Of a line of a HEX file; none where it is no record."""
    try:
        return binascii.unhexlify(record[1:]) if record.startswith(b":") else b""
    except binascii.Error:
        return b""


class _Memory:
    """Flash and EEPROM while they are being filled."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._flash, self._eeprom = bytearray(b"\xff" * FLASH_SIZE), bytearray(b"\xff" * EEPROM_SIZE)
        self._given = bytearray(FLASH_SIZE + EEPROM_SIZE)  # of each byte of flash, then of EEPROM: 1, if it is given
        self.flash_end = 0

    def unfit(self, address: int, data: bytes) -> str:
        """Puts bytes at an address as files have it; or says why they do not fit."""
        is_flash = address < DATA_SPACE
        into, at = (self._flash, address) if is_flash else (self._eeprom, address - EEPROM_SPACE)
        if not data or address >= OTHER_SPACES:
            return ""
        what = f"its {len(data)} bytes at address 0x{address:X}"
        if at < 0 or at + len(data) > len(into):
            return f"{what} do not fit into an {CHIP}"
        given = slice(first := at + (0 if is_flash else FLASH_SIZE), first + len(data))
        if any(self._given[given]):
            return f"some of {what} are there twice"
        self._given[given] = b"\1" * len(data)
        into[at : at + len(data)] = data
        if is_flash:
            self.flash_end = max(self.flash_end, at + len(data))
        return ""

    def program(self, high_fuse: int, code_end: int, variables_end: int, elf: Path | None, assumed: str) -> Program:
        """All of it."""
        if not code_end or not self.flash_end:
            raise AnalysisError(f"{self._what} cannot be loaded: it holds no program")
        return Program(bytes(self._flash), bytes(self._eeprom), high_fuse, code_end, variables_end, elf, assumed)
