"""What people are told of an image that goes wrong in the emulator: where, by address, function and source line."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from boebot import resources
from boebot.cli import main
from boebot.errors import BoardError
from boebot.robots import load_robot
from hil_tests.test_faults import JUMP_TO_ITSELF, RESERVED_OPCODE, planted
from sim_bridge.tests.symbols import entry_of
from sim_bridge.timing.measure import run

pytestmark = pytest.mark.emulated

FUNCTION = "motion_signals"  # runs when a set-point comes, in the link's poll, which is no task
PLACE = r"in motion_signals \(motion\.c:\d+\)"


def told(
    folder: Path, code: bytes, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> tuple[object, str]:
    """Exit code and standard error of `boebot run` where FUNCTION of the bundled image begins with `code`."""
    Path(planted(folder, FUNCTION, code)).rename(folder / "shieldbot.elf")
    bundled = resources.folder
    monkeypatch.setattr(resources, "folder", lambda kind: folder if kind == "images" else bundled(kind))
    monkeypatch.setattr(sys, "argv", ["boebot", "run", "wander", "--on", "avr", "--arena", "room", "--seconds", "1"])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, " ".join(capsys.readouterr().err.split())


def test_a_crash_ends_a_run_with_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    address = entry_of(resources.folder("images") / "shieldbot.elf", FUNCTION)
    code, error = told(tmp_path, RESERVED_OPCODE, monkeypatch, capsys)
    assert code == 1
    place = rf"invalid instruction 0x00FF at address 0x{address:04X} in cycle \d+ {PLACE}"
    assert re.search(place, error), error
    assert "Traceback" not in error


def test_a_hang_is_told_as_the_watchdog_sees_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As on the robot, where the run goes on after the reset."""
    _, error = told(tmp_path, JUMP_TO_ITSELF, monkeypatch, capsys)
    assert "was by its watchdog, outside of its tasks: the firmware hung there" in error


def test_a_hang_has_its_place_where_the_image_is_measured(tmp_path: Path) -> None:
    image = Path(planted(tmp_path, FUNCTION, JUMP_TO_ITSELF))
    address = entry_of(image, FUNCTION)
    with pytest.raises(BoardError, match=rf"found at address 0x{address:04X} .* {PLACE}"):
        run(image, load_robot("shieldbot"), "figures", 0.5, 1)
