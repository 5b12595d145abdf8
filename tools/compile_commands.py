"""Writes compile_commands.json, from which editors know how each C file is compiled: `make compile_commands.json`.

The firmware as the microcontroller sees it, the firmware's native hardware layer and the simulator as this
computer does.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
DATABASE = PROJECT / "compile_commands.json"
FLAGS = ["cc", "-std=gnu11", "-Wall", "-Wextra", "-Wconversion", "-Wshadow"]


def entries(folder: str, *options: str) -> list[dict[str, object]]:
    """One entry for each C file below a folder of the project."""
    found = sorted((PROJECT / folder).rglob("[!_]*.c"))
    files = [str(path.relative_to(PROJECT)) for path in found]
    return [{"directory": str(PROJECT), "file": file, "arguments": [*FLAGS, *options, "-c", file]} for file in files]


def main() -> None:
    subprocess.run([PROJECT / "tools" / "pio", "run", "--silent", "-e", "uno", "-t", "compiledb"], check=True)
    database = json.loads(DATABASE.read_text(encoding="utf-8"))
    database += entries("firmware/src/hal/native", "-DPIN_MAP_SHIELDBOT", "-Ifirmware/src")
    simavr = [f"-I{header.parent}" for header in (PROJECT / "build" / "simavr").rglob("sim_avr.h")]
    database += entries("host", "-Ihost/boebot/arenas", "-Ihost/boebot/link", "-Ifirmware/src")
    database += entries("sim_bridge", "-Isim_bridge", "-Isim_bridge/boards", "-Ihost/boebot/arenas", *simavr)
    DATABASE.write_text(json.dumps(database, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
