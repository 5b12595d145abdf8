"""Which chip a program is built for, as its ELF file says: the core in the header's flags (`e_flags`, numbers of
binutils' elf/avr.h), the chip's name and memories in the note that avr-libc's start-up code has
(`.note.gnu.avr.deviceinfo`).

Everything that takes an image asks here, so this module needs no other library.
"""

from __future__ import annotations

import re
import struct

from avr_timing.errors import AnalysisError

CHIP = "ATmega328P"
SAME_PROGRAM = (CHIP, "ATmega328")  # one data sheet; they differ in the signature and the brown-out detector's switch
MEMORIES = (0x0, 0x8000, 0x100, 0x800)  # begin and size of flash, begin and size of RAM, in bytes
NOTE = b".note.gnu.avr.deviceinfo"
EM_AVR, HEADER, SECTION = 83, "<16sHHIIIIIHHHHHH", "<IIIIII"
CORE_BITS, CORE, AVRTINY = 0x7F, 5, 100  # e_flags; avr5 is 5, avrxmega1 is 101


def assumed_chip(path: object, data: bytes) -> str:
    """What is assumed of the chip of an image, the bytes `data` of the ELF file `path`: a sentence for people where
    the file does not name it, nothing where it does.

    Raises:
        AnalysisError: it is no ELF file for an AVR, or is for another chip than the ATmega328P.
    """
    header = data[: struct.calcsize(HEADER)].ljust(struct.calcsize(HEADER), b"\0")
    _, _, machine, _, _, _, sections, flags, *_, size, count, names = struct.unpack(HEADER, header)
    if data[:6] != b"\x7fELF\1\1" or machine != EM_AVR:
        raise AnalysisError(f"{path} is not an ELF file for an AVR; expected an image for the {CHIP}")
    note = _note(data, sections, size, count, names)
    name, memories = ("", MEMORIES) if note is None else _said(path, note)
    if name not in ("", *SAME_PROGRAM):
        raise AnalysisError(f"{path} is for the {name}; expected an image for the {CHIP}")
    if flags & CORE_BITS != CORE:
        raise AnalysisError(f"{path} is for the core {_core(flags & CORE_BITS)}; expected {_core(CORE)}, the {CHIP}'s")
    if memories != MEMORIES:
        raise AnalysisError(f"{path}: its note gives the {name} memories {memories}; expected {MEMORIES}")
    return "" if name else f"{path} does not say which chip it is for: it is taken for an {CHIP}"


def _core(number: int) -> str:
    """As avr-gcc calls it: avr6 is that of the ATmega2560."""
    if number <= AVRTINY:
        return "avrtiny" if number == AVRTINY else f"avr{number}"
    return f"avrxmega{number - AVRTINY}"


def _note(data: bytes, sections: int, size: int, count: int, names: int) -> bytes | None:
    """The bytes of the chip's note; None where the file has none that can be found."""
    try:
        strings = struct.unpack_from(SECTION, data, sections + names * size)[4]
        for number in range(count):
            name, _, _, _, begin, length = struct.unpack_from(SECTION, data, sections + number * size)
            if data.startswith(NOTE + b"\0", strings + name):
                return data[begin : begin + length]
    except struct.error:
        pass
    return None


def _said(path: object, note: bytes) -> tuple[str, tuple[int, ...]]:
    """The chip's name and memories: behind the note's header six words of memories, the size of a table of offsets
    with the name's offset first, and strings."""
    try:
        memories = struct.unpack_from("<4I", note, 16)
        table, offset = struct.unpack_from("<II", note, 40)
        name = note[40 + table + offset :].split(b"\0")[0].decode("ascii")
    except (struct.error, ValueError):
        name = ""
    if not re.fullmatch(r"[a-z0-9_]+", name):
        raise AnalysisError(f"{path}: its note {NOTE.decode()} names no chip; expected the {CHIP}")
    return re.sub(r"^at(\D+)(.*)", lambda m: f"AT{m[1]}{m[2].upper()}", name), memories
