"""Prepares a PlatformIO core directory of this project's own, build/platformio-core, without the registry.

Afterwards `tools/pio` builds the same platformio.ini that plain `pio` does: with what users build their sketches with
(host/boebot/sketch/core_directory.py), the compiler of this computer, and the distribution's cppcheck. Needs the
packages `platformio` and `scons`.

    python tools/prepare_platformio.py [FOLDER]
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(PROJECT / "host"))

from boebot.sketch.core_directory import add_package, prepare  # noqa: E402


def main(core: Path) -> None:
    """Makes the core directory anew."""
    shutil.rmtree(core, ignore_errors=True)
    cppcheck = add_package(core, "tool-cppcheck", "1.21100.0+path", "Whatever cppcheck is on PATH") / "cppcheck"
    cppcheck.write_text('#!/bin/sh\nexec cppcheck "$@"\n', encoding="utf-8")
    cppcheck.chmod(0o755)
    prepare(core, [PROJECT / "tools" / "platformio" / "native"])


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else PROJECT / "build" / "platformio-core")
