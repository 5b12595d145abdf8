"""Builds programs for the ATmega328P from the firmware's sources, with the flags of the image (platformio.ini)."""

from __future__ import annotations

import configparser
import shlex
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "firmware" / "src"
# What PlatformIO gives to every program for this chip without a framework.
PLATFORM_FLAGS = ["-Os", "-mmcu=atmega328p", "-DF_CPU=16000000UL", "-ffunction-sections", "-fdata-sections"]
PLATFORM_FLAGS += ["-Wl,--gc-sections", "-Wl,--relax"]

_PROJECT = configparser.ConfigParser(interpolation=None)
_PROJECT.read(ROOT / "platformio.ini", encoding="utf-8")
# The names of the images: those of their pin maps and of their environments in platformio.ini.
IMAGES = _PROJECT["platformio"]["default_envs"].split(", ")


def flags(image: str = "shieldbot") -> list[str]:
    """Those of an image, for the compiler and the linker."""

    def option(section: str, name: str) -> str:
        text = _PROJECT[section][name]
        while "${" in text:
            before, _, rest = text.partition("${")
            reference, _, after = rest.partition("}")
            text = before + option(*reference.split(".")) + after
        return text

    return [*PLATFORM_FLAGS, *shlex.split(option(f"env:{image}", "build_flags")), "-std=gnu11"]


def build(
    target: Path,
    main: Path | None = None,
    extra: tuple[str, ...] = (),
    image: str = "shieldbot",
    folder: Path | None = None,
    compiler: str = "avr-gcc",
) -> Path:
    """The ELF file of that image at `target`, with `main` in place of its main.c; its sources may be a copy in a
    `folder`. Raises CalledProcessError."""
    folder = folder or SOURCES
    own = folder / "main.c"
    firmware = [path for path in sorted(folder.rglob("*.c")) if "native" not in path.parts]
    sources = [str(main or path) if path == own else str(path) for path in firmware]
    subprocess.run([compiler, *flags(image), *extra, f"-I{folder}", "-o", str(target), *sources], check=True)
    return target
