"""Builds programs for the ATmega328P from the firmware's sources, with the flags of the image (platformio.ini)."""

from __future__ import annotations

import configparser
import shlex
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "firmware" / "src"
ENVIRONMENT = "env:uno"
# What PlatformIO gives to every program for this chip without a framework.
PLATFORM_FLAGS = ["-Os", "-mmcu=atmega328p", "-DF_CPU=16000000UL", "-ffunction-sections", "-fdata-sections"]
PLATFORM_FLAGS += ["-Wl,--gc-sections", "-Wl,--relax"]


def flags(environment: str = ENVIRONMENT) -> list[str]:
    """Those of an image, by default the Shield-Bot's, for the compiler and the linker."""
    project = configparser.ConfigParser(interpolation=None)
    project.read(ROOT / "platformio.ini", encoding="utf-8")

    def option(section: str, name: str) -> str:
        text = project[section][name]
        while "${" in text:
            before, _, rest = text.partition("${")
            reference, _, after = rest.partition("}")
            text = before + option(*reference.split(".")) + after
        return text

    return [*PLATFORM_FLAGS, *shlex.split(option(environment, "build_flags")), "-std=gnu11"]


def build(
    image: Path,
    main: Path | None = None,
    extra: tuple[str, ...] = (),
    environment: str = ENVIRONMENT,
    folder: Path | None = None,
    compiler: str = "avr-gcc",
) -> Path:
    """The firmware's ELF file at `image`, with `main` in place of its main.c; its sources may be a copy in a `folder`.
    Raises CalledProcessError."""
    folder = folder or SOURCES
    own = folder / "main.c"
    firmware = [path for path in sorted(folder.rglob("*.c")) if "native" not in path.parts]
    sources = [str(main or path) if path == own else str(path) for path in firmware]
    subprocess.run([compiler, *flags(environment), *extra, f"-I{folder}", "-o", str(image), *sources], check=True)
    return image
