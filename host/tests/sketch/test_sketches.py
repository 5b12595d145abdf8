"""Sketches drive the emulated robot: built, run, recorded, repeated."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import boebot
from boebot.errors import CallError
from boebot.record.reading import attachments_of

# Both wheels forward; after 0.6 s it goes wild.
SOURCE = """\
#include <Servo.h>
Servo left, right;
void setup() {
  Serial.begin(9600);
  left.attach(13);
  right.attach(12);
  drive();
  Serial.println("driving");
}
void loop() {
  if (millis() > 600)
    ((void (*)())0x3F00)();
}
void drive() { // both wheels, whose servos look the other way
  left.writeMicroseconds(1600);
  right.writeMicroseconds(1400);
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sketch, and beside it a bundled brain's name."""
    folder = tmp_path_factory.mktemp("sketches") / "forward"
    folder.mkdir()
    (folder / "forward.ino").write_text(SOURCE)
    (folder.parent / "wander").mkdir()
    return folder


def command(*words: object) -> subprocess.CompletedProcess[str]:
    called = [sys.executable, "-m", "boebot", *map(str, words)]
    return subprocess.run(called, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)


def test_a_sketch_drives_and_its_run_is_repeated_without_it(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    result = boebot.run("forward", seconds=0.5, arena="empty", without=["slip"], out=tmp_path / "run")
    assert (result.brain, result.error) == ("forward.ino", None)
    assert b"".join(data for _, data in result.record.rows("to_host")) == b"driving\r\n"
    assert result.true_distance is not None and result.true_distance > 0.01
    attached = attachments_of(tmp_path / "run")
    assert attached["sketch/forward.ino"] == SOURCE.encode()
    assert attached["brain/forward.elf"][:4] == b"\x7fELF"

    copy = Path(shutil.copytree(tmp_path / "run", tmp_path / "copy"))
    monkeypatch.setenv("BOEBOT_CACHE", str(tmp_path / "none"))
    again = command("replay", copy, "--again")
    assert again.returncode == 0 and "bit-equal" in again.stdout, again.stderr
    assert not (tmp_path / "none").exists()  # nothing is built


def test_the_command_runs_it_and_a_fault_names_its_line(folder: Path) -> None:
    done = command("run", folder / "forward.ino", "--timeout", 1000)
    assert done.returncode == 1 and "forward.ino on shieldbot (avr)" in done.stdout
    assert "crashed at 0.601 s" in done.stderr and "in main (forward.ino:12)" in done.stderr


def test_a_bundled_brain_wins_over_a_folder_of_its_name(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder.parent)
    assert boebot.run("wander", on="native", seconds=0.1).steps
    with pytest.raises(CallError, match="wander is neither a sketch nor a PlatformIO project"):
        boebot.run("./wander")
