"""Commands on the record of a run: `boebot plot`, `boebot run --again` and `boebot replay`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PIL import Image

from command import boebot


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of two seconds on the native board."""
    import boebot as library

    folder = tmp_path_factory.mktemp("runs") / "run"
    library.run("wander", seconds=2, out=folder)
    return folder


def test_columns_are_drawn(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "plot", str(folder), "ping_distance_m", "true_x_m")
    assert (code, err) == (0, "") and "plot.png" in out
    with Image.open("plot.png") as picture:
        assert picture.info["Title"] == "wander on shieldbot" and picture.width > picture.height
        two = picture.height
    assert boebot(capsys, "plot", str(folder), "tick", "--out", "one.png")[0] == 0
    with Image.open("one.png") as picture:
        assert picture.height < two


@pytest.mark.parametrize(
    ("column", "sentence"),
    [
        ("true_x_mm", "the run has no column 'true_x_mm'; expected one of time_s, tick"),
        ("true_x_mm", "did you mean 'true_x_m'?"),
        ("contact", "'contact' was renamed; expected true_contact"),
        ("command", "column 'command' has words, not numbers"),
    ],
)
def test_unknown_column_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, folder: Path, column: str, sentence: str
) -> None:
    picture = tmp_path / "plot.png"
    code, out, err = boebot(capsys, "plot", str(folder), column, "--out", str(picture))
    assert code != 0 and out == "" and sentence in " ".join(err.split()) and "Traceback" not in err
    assert not picture.exists()


def test_runs_are_repeated_bit_by_bit(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "run", "--again", str(folder))
    assert (code, err) == (0, "") and " ".join(out.split()).endswith(": 40 steps") and "bit-equal to" in out
    asked = ("--robot", "arsim", "--seed", "7", "--pose", "1,0.8,30deg", "--seconds", "2")
    two = ("--robot", "shieldbot", "--pose", "0.5,0.5,0", "--without", "slip")
    assert boebot(capsys, "run", "wander", *asked, *two, "--out", "two")[0] == 0
    assert boebot(capsys, "run", "--again", "two")[0] == 0


def test_repetition_uses_the_recorded_brain(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("fast.py").write_text("def step(robot):\n    robot.drive(0.2, 0.2)\n")
    assert boebot(capsys, "run", "fast.py", "--seconds", "1", "--out", "run")[0] == 0
    Path("fast.py").unlink()
    assert boebot(capsys, "run", "--again", "run")[0] == 0


def test_repetition_says_where_it_differs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A brain that heeds a file, which no record has."""
    monkeypatch.chdir(tmp_path)
    Path("speed").write_text("0.2")
    source = (
        "SPEED = float(open('speed').read())\ndef step(robot):\n    robot.drive(SPEED if robot.time > 0.5 else 0, 0)\n"
    )
    Path("moody.py").write_text(source)
    assert boebot(capsys, "run", "moody.py", "--seconds", "1", "--out", "run")[0] == 0
    Path("speed").write_text("0.1")
    code, out, _ = boebot(capsys, "run", "--again", "run", "--json")
    said = json.loads(out)
    assert code == 1 and not said["equal"]
    assert (said["stream"], said["row"]) == ("command", 11) and said["time_s"] == pytest.approx(0.55)


def test_record_that_is_cut_is_repeated_as_far_as_it_goes(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, folder: Path
) -> None:
    cut = tmp_path / "cut"
    cut.mkdir()
    data = (folder / "record.mcap").read_bytes()
    (cut / "record.mcap").write_bytes(data[: data.rindex(b"end.json") - 50])
    code, out, err = boebot(capsys, "run", "--again", str(cut))
    assert code == 0 and "as far as it goes" in out and "the record is cut" in err


def test_what_cannot_be_repeated_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    assert boebot(capsys, "run", "wander", "--seconds", "0.2", "--realtime", "--out", "paced")[0] == 0
    code, _, err = boebot(capsys, "run", "--again", "paced")
    assert code == 2 and "was run in real time, which no run repeats bit by bit" in " ".join(err.split())
    code, _, err = boebot(capsys, "run", "--again", str(folder), "--seed", "2")
    assert code == 2 and "expected no seed beside it" in err
    assert boebot(capsys, "run", "--again", "nowhere")[0] == 2


BATTERY = """
def step(robot):
    battery = robot.battery
    robot.drive(0.1 * (battery.voltage * 100 % 1 if battery.valid else 0.0), 0.05)
"""


@pytest.mark.parametrize(
    ("robot", "brain"), [("shieldbot-charging", "battery.py"), ("boebot", "battery.py"), ("arsim", "wander")]
)
def test_brain_is_replayed_on_what_was_sensed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, robot: str, brain: str
) -> None:
    """By slow devices on boards, and without a board."""
    monkeypatch.chdir(tmp_path)
    Path("battery.py").write_text(BATTERY)
    Path("other.py").write_text("def step(robot):\n    robot.drive(0.01, 0.01)\n")
    assert boebot(capsys, "run", brain, "--robot", robot, "--seconds", "2", "--out", "run")[0] == 0
    code, out, err = boebot(capsys, "replay", "run", "--brain", brain)
    assert (code, err) == (0, "") and "all 40 commands are the same" in out
    code, out, _ = boebot(capsys, "replay", "run", "--brain", "other.py")
    assert code == 1 and out.startswith("step 0 (0.00 s) differs: ")
