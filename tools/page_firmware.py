"""The firmware as a page of the documentation changes it: a copy of the project with the blocks of the page in it.

The first line of such a block is a comment: `firmware/src/heartbeat.c: what it is` (a new file), or where in a file its
other lines go: `FILE, behind TEXT`, `FILE, before TEXT`, `FILE, in place of TEXT`. TEXT begins a line of the file; of
several the last one is meant. Blocks of the language `sh` are commands.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
HEAD = re.compile(
    r"(?:/\*|#|;) (?P<file>[\w./-]+\.\w+)(?:: .*|, (?P<how>behind|before|in place of) (?P<text>.*?))(?: \*/)?\n"
)
# Tests and what each build makes are left out.
NOT_COPIED = shutil.ignore_patterns("test", "generated", "messages.py", "attributes.pyi")
COPIED = ("firmware", "host", "protocol", "tools")
LINKED = ("sim_bridge", "hil_tests", "build/venv", "build/platformio-core")


class PageFirmware:
    """The copy, in a folder of its own."""

    def __init__(self, page: Path, folder: Path) -> None:
        """Makes the copy and puts the page's blocks into it.

        Raises:
            ValueError: a block names a place that its file does not have.
        """
        self.folder = folder
        for name in COPIED:
            shutil.copytree(ROOT / name, folder / name, ignore=NOT_COPIED)
        for name in LINKED:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).symlink_to(ROOT / name)
        shutil.copy(ROOT / "platformio.ini", folder)
        self.commands: list[str] = []
        for language, code in BLOCK.findall(page.read_text(encoding="utf-8")):
            if language == "sh":
                self.commands += code.splitlines()
            elif head := HEAD.match(code):
                self._put(folder / head["file"], head["how"], head["text"], code, code[head.end() :])

    @staticmethod
    def _put(file: Path, how: str | None, text: str, whole: str, lines: str) -> None:
        if how is None:
            file.write_text(whole, encoding="utf-8")
            return
        there = file.read_text(encoding="utf-8").splitlines(keepends=True)
        found = [number for number, line in enumerate(there) if line.strip().startswith(text)]
        if not found:
            raise ValueError(f"no line of {file.name} begins with {text!r}")
        at = found[-1]
        there[at + (how == "behind") : at + (how != "before")] = [lines]
        file.write_text("".join(there), encoding="utf-8")

    def run(self, command: str) -> subprocess.CompletedProcess[str]:
        """Runs a command in the copy, whose Python packages and images are used."""
        environment = {**os.environ, "PYTHONPATH": f"{self.folder / 'host'}{os.pathsep}{self.folder}", "COLUMNS": "200"}
        return subprocess.run(
            shlex.split(command), cwd=self.folder, env=environment, capture_output=True, text=True, timeout=120
        )
