"""docs/how-to/change-the-firmware.md: all that it adds, built by its own commands in a copy, keeps the firmware's
promises; a task that calculates with floating point counts with its budget."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from tools.page_firmware import ROOT, PageFirmware

PAGE = ROOT / "docs" / "how-to" / "change-the-firmware.md"


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
    assert run["distance_m"] > 0.5 and run["ticks"] >= 1000
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
