"""Prepares a core directory for PlatformIO without its registry: platforms, tools and frameworks of the distribution.

Builds in such a directory take the compilers from PATH, SCons from PyPI and Arduino's framework from Debian's package
arduino-core-avr. The user's own PlatformIO directory is never touched. Python's standard library is enough for it.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

PLATFORMS = Path(__file__).resolve().parent / "platforms"
ARDUINO = Path("/usr/share/arduino/hardware/arduino/avr")  # where Debian has the framework
FRAMEWORK = "5.2.0"  # PlatformIO's number of that package, for releases 1.8 of the framework

# PlatformIO starts its builds by running this file with its own Python.
SCONS_FILE = "packages/tool-scons/scons.py"
SCONS = """\
\"\"\"Runs the SCons that is installed beside PlatformIO.\"\"\"

import SCons.Script

SCons.Script.main()
"""


def write_json(path: Path, content: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def mark_installed(folder: Path, kind: str, name: str, package_version: str) -> None:
    """Writes the file by which PlatformIO knows an installed package, its owner and its version."""
    spec = {"owner": "platformio", "id": None, "name": name, "requirements": None, "uri": None}
    write_json(folder / ".piopm", {"type": kind, "name": name, "version": package_version, "spec": spec})


def platformio_version_of_scons() -> str:
    """PlatformIO numbers its SCons package 4.MMmmpp.0: SCons 4.11.1 is 4.41101.0."""
    major, minor, patch = (int(part) for part in version("scons").split(".")[:3])
    return f"4.{major}{minor:02d}{patch:02d}.0"


def add_package(core: Path, name: str, package_version: str, description: str, kind: str = "tool") -> Path:
    """The folder of a package that counts as installed."""
    folder = core / "packages" / name
    write_json(folder / "package.json", {"name": name, "version": package_version, "description": description})
    mark_installed(folder, kind, name, package_version)
    return folder


def prepare(core: Path, platforms: Iterable[Path] = ()) -> None:
    """Fills a folder: SCons, avrdude, Arduino's framework, the platform for AVRs and others, quiet settings."""
    add_package(core, "tool-scons", platformio_version_of_scons(), "SCons from PyPI")
    (core / SCONS_FILE).write_text(SCONS, encoding="utf-8")
    add_package(core, "tool-avrdude", "1.0.0+path", "Whatever avrdude is on PATH")
    framework = add_package(core, "framework-arduino-avr", f"{FRAMEWORK}+distribution", "Debian's arduino-core-avr")
    for part in ("cores", "variants", "libraries"):
        (framework / part).symlink_to(ARDUINO / part)

    for source in (*PLATFORMS.iterdir(), *platforms):
        folder = core / "platforms" / source.name
        shutil.copytree(source, folder, ignore=shutil.ignore_patterns("__pycache__"))
        manifest = json.loads((source / "platform.json").read_text(encoding="utf-8"))
        mark_installed(folder, "platform", manifest["name"], manifest["version"])

    write_json(
        core / "appstate.json",
        {
            "last_version": version("platformio"),
            "settings": {"enable_telemetry": False, "check_platformio_interval": 36500},
        },
    )
