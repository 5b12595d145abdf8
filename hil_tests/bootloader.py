"""Images that begin in the bootloader of bootloader.c, as an Uno does."""

from __future__ import annotations

import io
import struct
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from elftools.elf.elffile import ELFFile

BEGIN = 0x7C00  # of the boot section of 1 KB (BOOTSZ 01), where a reset starts with the fuse BOOTRST programmed
HEADER, SEGMENT = 52, 32  # bytes of an ELF file's header and of an entry of its segment table


@cache
def bootloader(signature: int | None = None) -> bytes:
    """Its machine code, from `BEGIN` on. `signature`: of the chip that it says it is; None: its own."""
    source = Path(__file__).with_name("bootloader.c")
    command = ["avr-gcc", "-mmcu=atmega328p", "-DF_CPU=16000000", "-Os", "-std=gnu11", "-Wall", "-Wextra", "-Werror"]
    command += ["-nostartfiles", "-Wl,-e,start", f"-Wl,--section-start=.text={BEGIN:#x}", str(source)]
    command += [] if signature is None else [f"-DSIGNATURE={signature:#x}"]
    with tempfile.TemporaryDirectory() as folder:
        elf = Path(folder, "bootloader.elf")
        subprocess.run([*command, "-o", str(elf)], check=True)
        text = ELFFile(io.BytesIO(elf.read_bytes())).get_section_by_name(".text")
    assert text is not None
    return bytes(text.data())


def with_bootloader(image: Path | None, folder: Path, signature: int | None = None) -> Path:
    """An image that starts in the bootloader, with the program of another image in flash; None: with none."""
    segments = [(BEGIN, BEGIN, bootloader(signature), len(bootloader(signature)), 5)]
    if image is not None:
        elf = ELFFile(io.BytesIO(image.read_bytes()))
        segments += [
            (s["p_vaddr"], s["p_paddr"], s.data(), s["p_memsz"], s["p_flags"])
            for s in elf.iter_segments()
            if s["p_type"] == "PT_LOAD"
        ]
    place = HEADER + SEGMENT * len(segments)
    table, contents = b"", b""
    for virtual, physical, data, size, flags in segments:
        table += struct.pack("<8I", 1, place + len(contents), virtual, physical, len(data), size, flags, 1)
        contents += data
    magic = b"\x7fELF\x01\x01\x01".ljust(16, b"\0")
    heading = struct.pack("<2H5I6H", 2, 83, 1, BEGIN, HEADER, 0, 5, HEADER, SEGMENT, len(segments), 40, 0, 0)
    path = folder / "with-bootloader.elf"
    path.write_bytes(magic + heading + table + contents)
    return path
