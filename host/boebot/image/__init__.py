"""What a firmware image says: its chip, its flash, symbols and source lines, from its ELF file. Here: one section by
its name.

Every run with a board reads one, so this needs no library, which knows all of ELF and takes longer to load. Format:
"Tool Interface Standard, Executable and Linking Format", version 1.2, book I: the file's header, its section headers,
and the table of their names.
"""

from __future__ import annotations

import struct

MAGIC = b"\x7fELF\x01\x01"  # 32 bits, little-endian
HEADER = struct.Struct("<16sHHIIIIIHHHHHH")
SECTION = struct.Struct("<IIIIII16x")


def section_of(data: bytes, name: str) -> bytes:
    """The contents of that section of a file; empty where there is none.

    Raises:
        struct.error: it is no ELF file of 32 bits, or ends before what it says of itself.
    """
    if not data.startswith(MAGIC):
        raise struct.error("expected one of 32 bits, little-endian")
    header = HEADER.unpack_from(data)
    start, (size, count, names) = header[6], header[-3:]
    if count == 0:
        return b""
    strings = SECTION.unpack_from(data, start + names * size)[4]
    for number in range(count):
        name_at, _, _, _, begin, length = SECTION.unpack_from(data, start + number * size)
        if data.startswith(name.encode() + b"\0", strings + name_at):
            if begin + length > len(data):
                raise struct.error(f"section {name} is cut off")
            return data[begin : begin + length]
    return b""
