"""Prepares a PlatformIO core directory of this project's own, build/platformio-core, without the registry.

Afterwards `tools/pio` builds the same platformio.ini that plain `pio` does, with the compilers of the
distribution and SCons from PyPI. The user's own PlatformIO directory is never touched. Needs the packages
`platformio` and `scons`.

    python tools/prepare_platformio.py [FOLDER]
"""

from __future__ import annotations

import json
import shutil
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

PROJECT = Path(__file__).resolve().parents[1]
PLATFORMS = PROJECT / "tools" / "platformio" / "platforms"

# PlatformIO starts its builds by running this file with its own Python.
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


def add_tool(core: Path, name: str, tool_version: str, description: str) -> Path:
    folder = core / "packages" / name
    write_json(folder / "package.json", {"name": name, "version": tool_version, "description": description})
    mark_installed(folder, "tool", name, tool_version)
    return folder


def prepare(core: Path) -> None:
    """Makes the core directory anew: SCons, avrdude, the two platforms, quiet settings."""
    shutil.rmtree(core, ignore_errors=True)

    scons = add_tool(core, "tool-scons", platformio_version_of_scons(), "SCons from PyPI")
    (scons / "scons.py").write_text(SCONS, encoding="utf-8")
    add_tool(core, "tool-avrdude", "1.0.0+path", "Whatever avrdude is on PATH")
    cppcheck = add_tool(core, "tool-cppcheck", "1.21100.0+path", "Whatever cppcheck is on PATH") / "cppcheck"
    cppcheck.write_text('#!/bin/sh\nexec cppcheck "$@"\n', encoding="utf-8")
    cppcheck.chmod(0o755)

    for source in sorted(path for path in PLATFORMS.iterdir() if path.is_dir()):
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


if __name__ == "__main__":
    prepare(Path(sys.argv[1]) if len(sys.argv) > 1 else PROJECT / "build" / "platformio-core")
