"""Commands on the record of a run: `boebot report`, `boebot plot`, `boebot run --again` and `boebot replay`."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest
from PIL import Image

import boebot as library
from boebot import resources
from boebot.record.reading import attachments_of
from boebot.running.again import again, recorded
from command import boebot


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of two seconds on the native board."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    library.run("wander", seconds=2, out=folder)
    return folder


def test_report_prints_figures_though_its_files_cannot_be_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, folder: Path
) -> None:
    (tmp_path / "record.mcap").write_bytes((folder / "record.mcap").read_bytes())
    (tmp_path / "summary.json").mkdir()
    code, out, err = boebot(capsys, "report", str(tmp_path), "--json")
    assert code == 1 and json.loads(out)["ticks"] == 201 and json.loads(out)["files"] == []
    assert err == f"boebot: the run's files cannot be written to {tmp_path}: Is a directory\n"


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


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of two robots, one of them without a board; two seconds."""
    folder = tmp_path_factory.mktemp("runs") / "two"
    first = library.Member(robot="arsim", seed=7, pose=(1.0, 0.8, 0.5))
    library.run_together([first, library.Member(pose=(0.5, 0.5, 0.0), without=["slip"])], seconds=2, out=folder)
    return folder


def test_one_of_several_robots_is_chosen(capsys: pytest.CaptureFixture[str], tmp_path: Path, two: Path) -> None:
    """Else all of them are drawn, those that have the column."""
    titles = {(): "wander on arsim; wander on shieldbot", ("--robot", "2"): "wander on shieldbot"}
    for number, (asked, title) in enumerate(titles.items()):
        picture = tmp_path / f"{number}.png"
        columns = ("true_x_m", "ping_distance_m")
        assert boebot(capsys, "plot", str(two), *columns, *asked, "--out", str(picture))[0] == 0
        with Image.open(picture) as opened:
            assert opened.info["Title"] == title
    for robot in ("1", "2"):
        code, out, _ = boebot(capsys, "replay", str(two), "--brain", "wander", "--robot", robot)
        assert code == 0 and "all 40 commands are the same" in out
    refused = {
        ("plot", str(two), "tick", "--robot", "3"): "there is no robot 3 in the run; expected 1 to 2",
        ("plot", str(two), "ping_distance_m", "--robot", "1"): "the run has no column 'ping_distance_m'",
        ("replay", str(two), "--brain", "wander", "--robot", "3"): "there is no robot 3 in the run; expected 1 to 2",
        ("replay", str(two), "--brain", "wander"): "is a run of 2 robots; expected --robot 1 to 2",
    }
    for asked, sentence in refused.items():
        code, out, err = boebot(capsys, *asked)
        assert code != 0 and out == "" and sentence in " ".join(err.split()) and "Traceback" not in err


def test_runs_are_repeated_bit_by_bit(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: Path, two: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "run", "--again", str(folder))
    assert (code, err) == (0, "") and " ".join(out.split()).endswith(": 40 steps") and "bit-equal to" in out
    assert boebot(capsys, "run", "--again", str(two))[0] == 0
    avr = ("--on", "avr", "--period", "100ms", "--seconds", "0.5")
    assert boebot(capsys, "run", "wander", *avr, "--out", "avr")[0] == 0
    assert boebot(capsys, "run", "--again", "avr")[1].endswith(": 5 steps\n")


def test_repetition_uses_the_recorded_files(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Brains of one name, what one of them imports, and an arena: all of them changed or gone since."""
    monkeypatch.chdir(tmp_path)
    brains = {
        "one/brain.py": "from one_speed import SPEED\ndef step(robot):\n    robot.drive(SPEED, 0.1)\n",
        "one/one_speed.py": "SPEED = 0.2\n",
        "two/brain.py": "def step(robot):\n    robot.drive(-0.1, 1 / (robot.time < 0.5))\n",
    }
    for name, source in brains.items():
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(source)
    Path("mine.toml").write_bytes((resources.folder("arenas") / "room.toml").read_bytes())
    Path("bot.toml").write_bytes((resources.folder("robots") / "shieldbot.toml").read_bytes())
    asked = ("one/brain.py", "two/brain.py", "--robot", "bot.toml", "--arena", "mine.toml", "--seconds", "1")
    assert boebot(capsys, "run", *asked, "--out", "run")[0] == 1
    attached = attachments_of("run")
    assert {
        name: data.decode() for name, data in attached.items() if name.startswith("robot-") and "brain/" in name
    } == {
        f"robot-{number}/brain/{name.partition('/')[2]}": source
        for name, source in brains.items()
        for number in (1 if name.startswith("one") else 2,)
    }
    assert attached["arena/mine.toml"] == Path("mine.toml").read_bytes()
    assert attached["robot-2/robot/bot.toml"] == Path("bot.toml").read_bytes()
    for name in ("one/brain.py", "mine.toml", "bot.toml"):
        Path(name).unlink()
    Path("one/one_speed.py").write_text("SPEED = 0.3\n")
    Path("two/brain.py").write_text("# another one\n" + brains["two/brain.py"])
    sys.modules.pop("one_speed")  # as in a new process
    code, out, err = boebot(capsys, "run", "--again", "run")
    assert (code, err) == (0, "") and "bit-equal to run: " in out
    sys.modules.pop("one_speed")


def test_run_that_ctrl_c_ended_is_repeated_up_to_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    source = "from pathlib import Path\ndef step(robot):\n    robot.drive(0.1, robot.time / 5)\n"
    source += "    if robot.time > 0.7 and Path('interrupt').exists():\n        raise KeyboardInterrupt\n"
    Path("brain.py").write_text(source)
    Path("interrupt").touch()
    with pytest.raises(KeyboardInterrupt):
        library.run("brain.py", out="run")
    Path("interrupt").unlink()
    code, out, err = boebot(capsys, "run", "--again", "run")
    assert code == 0 and "bit-equal to run, as far as it goes" in out and "ended by Ctrl-C after 0.75 s" in err
    Path("interrupt").touch()
    with pytest.raises(KeyboardInterrupt):
        again(recorded(Path("run")))


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
    assert code == 1 and re.match(r"step 0 \((tick \d+, )?0\.00 s\) differs: ", out)
