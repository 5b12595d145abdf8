"""Prints how much flash and static RAM firmware images use, and fails when one uses more than it may.

python tools/image_size.py build/images/shieldbot.elf ...
"""

from __future__ import annotations

import sys
from pathlib import Path

from elftools.elf.elffile import ELFFile

FLASH_LIMIT = 16_384  # bytes, of 32,256 below the boot loader: all devices are built in
RAM_LIMIT = 1400  # bytes, so that 200 of stack make 1,600 of the chip's 2,048; `boebot timing` bounds the stack

FLASH_SECTIONS = (".text", ".data")
RAM_SECTIONS = (".data", ".ring_receive", ".ring_changes", ".ring_send", ".bss", ".noinit")


def sizes(path: Path) -> tuple[int, int]:
    """Flash and static RAM of an image, in bytes."""
    with path.open("rb") as file:
        section_sizes = {section.name: int(section["sh_size"]) for section in ELFFile(file).iter_sections()}
    return (
        sum(section_sizes.get(name, 0) for name in FLASH_SECTIONS),
        sum(section_sizes.get(name, 0) for name in RAM_SECTIONS),
    )


def main(paths: list[str]) -> int:
    too_large = False
    for path in map(Path, paths):
        flash, ram = sizes(path)
        print(f"{path.name:22} flash {flash} of {FLASH_LIMIT} bytes, static RAM {ram} of {RAM_LIMIT} bytes")
        too_large |= flash > FLASH_LIMIT or ram > RAM_LIMIT
    if too_large:
        print("image_size.py: an image is larger than it may be", file=sys.stderr)
    return int(too_large)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
