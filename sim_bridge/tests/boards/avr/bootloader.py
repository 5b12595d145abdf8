"""Boot loaders for tests: the kit's, as it says another chip's signature, and Debian's Optiboot."""

from __future__ import annotations

import subprocess
from pathlib import Path

from boebot import resources

KITS = resources.folder("images") / "bootloader.elf"
SOURCE = Path(__file__).resolve().parents[4] / "firmware" / "bootloader" / "bootloader.c"
OPTIBOOT = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot")
BEGIN = 0x7E00
SMALL = ["-Os", "-fno-split-wide-types", "-mrelax", "-fno-tree-scev-cprop", "-fno-move-loop-invariants"]


def _built(source: Path, elf: Path, *options: str) -> Path:
    command = ["avr-gcc", "-mmcu=atmega328p", "-DF_CPU=16000000L", *SMALL, *options, "-nostartfiles", "-w"]
    subprocess.run([*command, f"-Wl,--section-start=.text={BEGIN:#x}", str(source), "-o", str(elf)], check=True)
    return elf


def of_chip(signature: int, folder: Path) -> Path:
    """The kit's, on a chip that says it is another one."""
    return _built(SOURCE, folder / "bootloader.elf", f"-DSIGNATURE={signature:#x}", "-Wl,-e,start")


def optiboot(folder: Path) -> Path:
    """Optiboot 4.4 as Arduino's own makefile builds it for the Uno. The file that the package holds was built so by an
    older compiler, at whose addresses it overruns the flash."""
    options = ["-std=gnu99", "-fgnu89-inline", "-fno-inline-small-functions", "-DLED_START_FLASHES=3"]
    options += ["-DBAUD_RATE=115200", "-Wl,--section-start=.version=0x7ffe"]
    return _built(OPTIBOOT / "optiboot.c", folder / "optiboot.elf", *options)
