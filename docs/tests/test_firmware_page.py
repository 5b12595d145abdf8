"""docs/how-to/change-the-firmware.md: all that it adds, built by its own commands in a copy, keeps the firmware's
promises; a task that calculates with floating point counts with its budget."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.soak  # three builds of a whole image, and its analysis

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "how-to" / "change-the-firmware.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
HEAD = re.compile(
    r"(?:/\*|#|;) (?P<file>[\w./-]+\.\w+)(?:: .*|, (?P<how>behind|before|in place of) (?P<text>.*?))(?: \*/)?\n"
)
# Tests and what each build makes are left out.
NOT_COPIED = shutil.ignore_patterns("test", "generated", "messages.py", "attributes.pyi")
COPIED = ("firmware", "host", "protocol", "tools")
LINKED = ("sim_bridge", "hil_tests", "build/venv", "build/platformio-core")


class PageFirmware:
    """A copy of the project with the blocks of the page in it.

    The first line of such a block is a comment: `firmware/src/heartbeat.c: text` (a new file), or where in a file its
    other lines go: `FILE, behind TEXT`, `FILE, before TEXT`, `FILE, in place of TEXT`. TEXT begins a line of the file;
    of several the last one is meant. Blocks of the language `sh` are commands.
    """

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


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> PageFirmware:
    """The copy, its image built: the commands up to the first that asks something of the image."""
    copy = PageFirmware(PAGE, tmp_path_factory.mktemp("changed"))
    for command in copy.commands:
        if "/boebot " not in command:
            done = copy.run(command)
            assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return copy


def answer(copy: PageFirmware, command: str) -> dict[str, Any]:
    """What the page's `boebot COMMAND` says, as JSON."""
    (line,) = (one for one in copy.commands if f"/boebot {command}" in one)
    done = copy.run(f"{line} --json")
    assert not done.stderr, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_the_analysis_takes_the_budget_of_what_it_cannot_bound(changed: PageFirmware) -> None:
    image = answer(changed, "timing")["image"]
    tasks = {task["name"]: task for task in image["tasks"]}
    assert tasks["ride"]["bound_cycles"] is None
    assert 0 < tasks["ride"]["emulator_max_cycles"] <= tasks["ride"]["budget_cycles"]
    assert tasks["heartbeat"]["emulator_max_cycles"] <= tasks["heartbeat"]["bound_cycles"]
    note = next(line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("note: "))
    said = ".*".join(map(re.escape, note.removeprefix("note: ").split("…")))
    assert any(re.fullmatch(said, one) for one in image["notes"]), image["notes"]
    assert not image["faults"]


def test_wander_drives_it_and_hears_of_each_tick(changed: PageFirmware) -> None:
    run = answer(changed, "run")
    assert run["true_distance_m"] > 0.5 and run["ticks"] >= 1000
    assert run["lost_frames"] == run["overruns"] == run["resets"] == run["dead_man_stops"] == 0


def test_pulses_stay_exact_and_what_was_added_works(changed: PageFirmware) -> None:
    probe = Path(__file__).with_name("changed_board.py")
    done = changed.run(f"{sys.executable} {probe} build/images/labbot.elf")
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert min(seen["pulses"]) > 90 and seen["broken pulses"] == 0, "exact to 16 cycles"
    assert not any(seen["lost"].values()), seen["lost"]
    assert seen["ride to steady"] == pytest.approx(1, abs=0.02)
    assert seen["cycles between clicks"] and seen["lamp"] == [True, False]
    assert all(abs(cycles - 8_000_000) < 40_000 for cycles in seen["cycles between clicks"])
