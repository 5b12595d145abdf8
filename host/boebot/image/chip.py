"""Which chip a program is built for, as its ELF file says: the core in the header's flags (`e_flags`, numbers of
binutils' elf/avr.h), the chip's name and memories in the note that avr-libc's start-up code has
(`.note.gnu.avr.deviceinfo`).

Everything that takes an image asks here, so this module needs no other library.
"""

from __future__ import annotations

import re
import struct

from boebot.errors import AnalysisError
from boebot.image import HEADER, MAGIC, section_of

CHIP = "ATmega328P"
SAME_PROGRAM = (CHIP, "ATmega328")  # one data sheet; they differ in the signature and the brown-out detector's switch
NOTE = ".note.gnu.avr.deviceinfo"
EM_AVR = 83
CORE_BITS, CORE = 0x7F, 5


def assumed_chip(path: object, data: bytes) -> str:
    """What is assumed of the chip of an image, the bytes `data` of the ELF file `path`: a sentence for people where
    the file does not name it, nothing where it does.

    Raises:
        AnalysisError: it is no ELF file for an AVR, or is for another chip than the ATmega328P.
    """
    header = HEADER.unpack(data[: HEADER.size].ljust(HEADER.size, b"\0"))
    if not data.startswith(MAGIC) or header[2] != EM_AVR:
        raise AnalysisError(
            f"{path} is not an ELF file for an AVR; expected the ELF file of a program for the {CHIP} "
            "(a HEX file has neither the chip's name nor symbols)"
        )
    core, name = header[7] & CORE_BITS, _name(data)
    if name not in ("", *SAME_PROGRAM):
        raise AnalysisError(f"{path} is for the {name}; expected an image for the {CHIP}")
    if core != CORE:
        raise AnalysisError(f"{path} is for the core avr:{core} (avr-readelf -h); expected avr:{CORE}, the {CHIP}'s")
    return "" if name else f"{path} does not say which chip it is for: it is taken for an {CHIP}"


def _name(data: bytes) -> str:
    """The chip's name in the note; empty where no note can be found.

    Behind the note's header (16 bytes) are six words of memories, the size of a table of offsets, that table, the
    name's offset first, and strings.
    """
    try:
        note = section_of(data, NOTE)
        table, offset = struct.unpack_from("<II", note, 40)
    except struct.error:  # there is none, or the file ends before
        return ""
    text = note[40 + table + offset :].split(b"\0")[0]
    name = ascii(text.decode("latin-1"))[1:-1]  # a damaged one may hold orders to the terminal
    return re.sub(r"^at(\D+)(.*)", lambda m: f"AT{m[1]}{m[2].upper()}", name) or "chip without a name"
