"""What is left of a test that failed: what happened at the board, in a folder with the test's name: pins.vcd for
GTKWave and PulseView, serial.txt, run with its record where there is a robot, and again.txt, the command that repeats
it."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim_bridge.bench.uno import Uno

LONGEST_NAME = 80  # letters of a folder's name, before its hash


def folder_of(folder: Path, name: str) -> Path:
    """Where below that one the files of a test go."""
    short = re.sub(r"[^\w.]+", "-", name.rpartition("/")[2])[:LONGEST_NAME].strip("-")
    return folder / f"{short}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def keep(uno: Uno, folder: Path, again: str) -> None:
    """Writes what happened at a board into a folder; `again`: the command that repeats it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "again.txt").write_text(f"{again}\n", encoding="utf-8")
    (folder / "serial.txt").write_bytes(uno.serial.heard)
    uno.save_pins(folder / "pins.vcd")
    uno.save_record(folder / "run")
