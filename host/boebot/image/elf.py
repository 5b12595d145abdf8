"""Reads a firmware image: an ELF file for the ATmega328P, as avr-gcc or another compiler links it.

Read are the bytes of the flash, symbols, the sizes of flash and RAM, source lines, and the section `.boebot.loops`, in
which a firmware may say how often its loops run. The file need not have the last two.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from functools import lru_cache
from io import BytesIO
from pathlib import Path

from elftools.common.exceptions import DWARFError, ELFError
from elftools.construct import ConstructError
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from boebot.errors import AnalysisError
from boebot.files import regular
from boebot.image import section_of
from boebot.image.chip import assumed_chip
from boebot.image.source_lines import source_lines

LOOPS = ".boebot.loops"  # section of the loop bounds, as boebot's bounds.h writes it in any firmware
FLASH_SIZE = 0x8000  # bytes
RAM_START = 0x800100  # avr-gcc gives data memory the addresses from 0x800000
RAM_END = 0x800900
DATA_SPACE = 0x800000
PT_LOAD, EXECUTABLE, ALLOCATED = "PT_LOAD", 0x4, 0x2
NOT_SAID = 0xFFFFFFFF
# What pyelftools raises on a damaged file.
DAMAGE: tuple[type[Exception], ...] = (
    *(ELFError, DWARFError, ConstructError, struct.error, ValueError, LookupError),
    *(AttributeError, TypeError, AssertionError, OverflowError, RecursionError),
)
STRENGTH = {"STB_GLOBAL": 0, "STB_WEAK": 1}


@dataclass(frozen=True, slots=True)
class Symbol:
    """A name of an address in flash: "STT_FUNC" a function, "STT_OBJECT" data, "STT_NOTYPE" a label."""

    name: str
    address: int
    size: int
    kind: str
    strength: int  # 0 global, 1 weak, 2 local


@dataclass(frozen=True, slots=True)
class LoopBound:
    """What the source says of a loop: `address` lies in its body.

    At most `passes` of the body for each time that the loop is entered; and, for loops that wait for a time, at most
    `cycles` in all, to which one more pass may come. None: not said.
    """

    address: int
    passes: int | None
    cycles: int | None


@dataclass(frozen=True, slots=True)
class Image:
    """What an ELF file says. Addresses are byte addresses, those of RAM without the 0x800000 of the file."""

    path: str
    code: bytes  # the flash from address 0; bytes that the file does not give are 0xFF
    entry: int  # where the program begins after a reset
    executable: tuple[range, ...]  # addresses that can hold instructions
    symbols: tuple[Symbol, ...]  # those of flash, by address
    flash_bytes: int  # written to flash: code, constants, initial values of variables
    ram_bytes: int  # of all variables
    stack_start: int  # first value of the stack pointer
    lines: dict[int, str] = field(default_factory=dict)  # "file.c:123" by address, where that is known
    sources: dict[int, tuple[str, int]] = field(default_factory=dict)  # the same with the file's folders
    bounds: tuple[LoopBound, ...] = ()
    assumed_chip: str = ""  # for people, where the file does not say for which chip it is


def read_image(path: Path) -> Image:
    """Reads an ELF file. Raises AnalysisError when it is not a linked program for the ATmega328P, or is damaged."""
    try:
        data = regular(path).read_bytes()
    except OSError as error:
        raise AnalysisError(f"{path} cannot be read: {error.strerror or error}") from error
    return _read(path, data)


@lru_cache(maxsize=4)
def _read(path: Path, data: bytes) -> Image:
    """Read once for the same bytes."""
    assumed = assumed_chip(path, data)
    try:
        return _image(path, data, assumed)
    except DAMAGE as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise AnalysisError(f"{path} is not an ELF file, or is damaged: {reason}") from error


def _image(path: Path, data: bytes, assumed: str) -> Image:
    elf = ELFFile(BytesIO(data))
    if elf["e_type"] != "ET_EXEC":
        raise AnalysisError(f"{path} is not linked ({elf['e_type']}): an image as it is written to flash is expected")
    code, written = _flash(path, elf)
    symbols, stack_start = _symbols(elf)
    sources = _sources(elf, len(code))
    return Image(
        path=str(path),
        code=code,
        entry=elf["e_entry"],
        executable=_executable(elf, len(code)),
        symbols=symbols,
        flash_bytes=written,
        ram_bytes=_ram(elf),
        stack_start=stack_start,
        lines={address: f"{file.rpartition('/')[2]}:{line}" for address, (file, line) in sources.items()},
        sources=sources,
        bounds=_bounds(path, section_of(data, LOOPS), len(code)),
        assumed_chip=assumed,
    )


def _sources(elf: ELFFile, end: int) -> dict[int, tuple[str, int]]:
    """The source lines; none where the debugging information is not one that pyelftools reads. The program is all the
    same what it is."""
    try:
        return source_lines(elf, end)
    except DAMAGE:
        return {}


def _flash(path: Path, elf: ELFFile) -> tuple[bytes, int]:
    """The bytes of flash from address 0, and how many the file gives."""
    flash, written, end = bytearray(b"\xff" * FLASH_SIZE), 0, 0
    for segment in elf.iter_segments(PT_LOAD):
        start, size = segment["p_paddr"], segment["p_filesz"]
        if start >= RAM_START or size == 0:  # EEPROM, fuses
            continue
        data = segment.data()
        if len(data) < size:
            raise AnalysisError(
                f"{path} is cut off: {size} bytes of flash at 0x{start:04X} are said, {len(data)} are there"
            )
        if start + size > FLASH_SIZE:
            raise AnalysisError(f"{path} needs flash up to 0x{start + size:X}: the ATmega328P has {FLASH_SIZE} bytes")
        flash[start : start + size] = data
        written, end = written + size, max(end, start + size)
    if end == 0:
        raise AnalysisError(f"{path} has nothing for the flash: an image for the ATmega328P is expected")
    return bytes(flash[:end]), written


def _ram(elf: ELFFile) -> int:
    """Bytes of the sections in RAM."""
    return sum(
        section["sh_size"]
        for section in elf.iter_sections()
        if section["sh_flags"] & ALLOCATED and RAM_START <= section["sh_addr"] < RAM_END
    )


def _executable(elf: ELFFile, end: int) -> tuple[range, ...]:
    """The sections with instructions; the whole flash where the file has no sections."""
    found = tuple(
        range(section["sh_addr"], min(section["sh_addr"] + section["sh_size"], end))
        for section in elf.iter_sections()
        if section["sh_flags"] & EXECUTABLE
    )
    return found or (range(end),)


def _symbols(elf: ELFFile) -> tuple[tuple[Symbol, ...], int]:
    """The symbols of flash, and the first value of the stack pointer."""
    stack_start = RAM_END - 1 - DATA_SPACE
    found = []
    for section in elf.iter_sections():
        if not isinstance(section, SymbolTableSection):
            continue
        for symbol in section.iter_symbols():
            info, address = symbol["st_info"], symbol["st_value"]
            if symbol.name == "__stack":
                stack_start = address & 0xFFFF
            if not isinstance(symbol["st_shndx"], int) or not symbol.name or address >= FLASH_SIZE:
                continue  # of no section, as __SP_L__
            if info["type"] in ("STT_FUNC", "STT_OBJECT", "STT_NOTYPE"):
                strength = STRENGTH.get(info["bind"], 2)
                found.append(Symbol(symbol.name, address, symbol["st_size"], info["type"], strength))
    return tuple(sorted(found, key=lambda symbol: (symbol.address, symbol.name))), stack_start


def _bounds(path: Path, data: bytes, end: int) -> tuple[LoopBound, ...]:
    """The records of the section LOOPS: address in a loop's body, most passes, most cycles, of 32 bits each."""
    if len(data) % 12:
        raise AnalysisError(f"{path}: section {LOOPS} has {len(data)} bytes: records of 12 bytes are expected")
    bounds = []
    for address, passes, cycles in struct.iter_unpack("<III", data):
        if address >= end or address % 2:
            raise AnalysisError(
                f"{path}: a loop's bound names address 0x{address:X}, which is not one of an instruction"
            )
        most, longest = (None if number == NOT_SAID else number for number in (passes, cycles))
        if (most, longest) != (None, None):
            bounds.append(LoopBound(address, most, longest))
    return tuple(bounds)
