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
NOTE = b".note.gnu.avr.deviceinfo\0"
EM_AVR, HEADER, SECTION = 83, struct.Struct("<16sHHIIIIIHHHHHH"), "<IIIIII"
CORE_BITS, CORE = 0x7F, 5


def assumed_chip(path: object, data: bytes) -> str:
    """What is assumed of the chip of an image, the bytes `data` of the ELF file `path`: a sentence for people where
    the file does not name it, nothing where it does.

    Raises:
        AnalysisError: it is no ELF file for an AVR, or is for another chip than the ATmega328P.
    """
    header = HEADER.unpack(data[: HEADER.size].ljust(HEADER.size, b"\0"))
    if data[:6] != b"\x7fELF\1\1" or header[2] != EM_AVR:
        raise AnalysisError(
            f"{path} is not an ELF file for an AVR; expected the ELF file of a program for the {CHIP} "
            "(a HEX file has neither the chip's name nor symbols)"
        )
    core, name = header[7] & CORE_BITS, _name(data, *header[-3:], sections=header[6])
    if name not in ("", *SAME_PROGRAM):
        raise AnalysisError(f"{path} is for the {name}; expected an image for the {CHIP}")
    if core != CORE:
        raise AnalysisError(f"{path} is for the core avr:{core} (avr-readelf -h); expected avr:{CORE}, the {CHIP}'s")
    return "" if name else f"{path} does not say which chip it is for: it is taken for an {CHIP}"


def _name(data: bytes, size: int, count: int, names: int, *, sections: int) -> str:
    """The chip's name in the note, by the table of sections; empty where no note can be found.

    Behind the note's header (16 bytes) are six words of memories, the size of a table of offsets, that table, the
    name's offset first, and strings.
    """
    try:
        strings = struct.unpack_from(SECTION, data, sections + names * size)[4]
        for place in range(sections, sections + count * size, size or 1):
            name, _, _, _, begin, length = struct.unpack_from(SECTION, data, place)
            if data.startswith(NOTE, strings + name):
                table, offset = struct.unpack_from("<II", data, begin + 40)
                text = data[begin + 40 + table + offset : begin + length].split(b"\0")[0]
                name = ascii(text.decode("latin-1"))[1:-1]  # a damaged one may hold orders to the terminal
                return re.sub(r"^at(\D+)(.*)", lambda m: f"AT{m[1]}{m[2].upper()}", name) or "chip without a name"
    except struct.error:  # the file ends before
        pass
    return ""
