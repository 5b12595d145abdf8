"""Commands on the record of a run: `boebot report` and `boebot replay`."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image

import boebot as library
from boebot import resources
from boebot.record.blocks import Block, Group
from boebot.record.reading import attachments_of
from boebot.record.record_file import RecordReader, RecordWriter
from boebot.result import RunResult, read_run
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


def test_without_a_column_all_are_named(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    code, out, err = boebot(capsys, "report", str(folder), "--plot")
    names = out.split()
    assert (code, err) == (0, "") and names[:2] == ["time_s", "tick"]
    assert {"ping_distance_m", "command_left", "true_x_m"} <= set(names)


def test_options_of_another_way_are_refused(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    for asked, sentence in {
        ("report", str(folder), "--as", "csvv"): "there is no format 'csvv'; expected one of csv, foxglove, vcd, can.",
        ("report", str(folder), "tick"): "COLUMN, --robot and --out go with --plot",
        ("replay", str(folder)): "expected --brain BRAIN, or --again",
        ("replay", str(folder), "--brain", "wander", "--trust"): "expected --again with --trust",
    }.items():
        code, out, err = boebot(capsys, *asked)
        assert (code, out) == (2, "") and sentence in " ".join(err.split()), asked


def test_columns_are_drawn(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "report", str(folder), "--plot", "ping_distance_m", "true_x_m")
    assert (code, err) == (0, "") and "plot.png" in out
    with Image.open("plot.png") as picture:
        assert picture.info["Title"] == "wander on shieldbot" and picture.width > picture.height
        two = picture.height
    assert boebot(capsys, "report", str(folder), "--plot", "tick", "--out", "one.png")[0] == 0
    with Image.open("one.png") as picture:
        assert picture.height < two


@pytest.mark.parametrize(
    ("column", "sentence"),
    [
        ("true_x_mm", "the run has no column 'true_x_mm'; expected one of time_s, tick"),
        ("true_x_mm", "did you mean 'true_x_m'?"),
        ("command", "column 'command' has words, not numbers"),
    ],
)
def test_unknown_column_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, folder: Path, column: str, sentence: str
) -> None:
    picture = tmp_path / "plot.png"
    code, out, err = boebot(capsys, "report", str(folder), "--plot", column, "--out", str(picture))
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
        assert boebot(capsys, "report", str(two), "--plot", *columns, *asked, "--out", str(picture))[0] == 0
        with Image.open(picture) as opened:
            assert opened.info["Title"] == title
    for robot in ("1", "2"):
        code, out, _ = boebot(capsys, "replay", str(two), "--brain", "wander", "--robot", robot)
        assert code == 0 and "all 40 commands are the same" in out
    refused = {
        ("report", str(two), "--plot", "tick", "--robot", "3"): "there is no robot 3 in the run; expected 1 to 2",
        ("report", str(two), "--plot", "ping_distance_m", "--robot", "1"): "the run has no column 'ping_distance_m'",
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
    code, out, err = boebot(capsys, "replay", str(folder), "--again")
    assert (code, err) == (0, "") and " ".join(out.split()).endswith(": 40 steps") and "bit-equal to" in out
    assert boebot(capsys, "replay", str(two), "--again")[0] == 0
    avr = ("--on", "avr", "--period", "100ms", "--seconds", "0.5")
    assert boebot(capsys, "run", "wander", *avr, "--out", "avr")[0] == 0
    assert boebot(capsys, "replay", "avr", "--again")[1].endswith(": 5 steps\n")


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
    ran = Path("ran")
    Path("two/brain.py").write_text(f"open({str(ran)!r}, 'w')\n" + brains["two/brain.py"])
    code, out, err = boebot(capsys, "replay", "run", "--again")
    sentence = (
        "the record brings a brain that is not the file on this computer, brain.py, one_speed.py, brain.py; it could"
    )
    assert (code, out) == (2, "") and sentence in err and "expected --trust" in err
    with pytest.raises(library.BoebotError, match=r"expected --trust \(trust=True\)"):
        again(recorded(Path("run")))
    assert not ran.exists()
    code, out, err = boebot(capsys, "replay", "run", "--again", "--trust")
    assert (code, err) == (0, "") and "bit-equal to run: " in out and not ran.exists()
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
    code, out, err = boebot(capsys, "replay", "run", "--again")
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
    code, out, _ = boebot(capsys, "replay", "run", "--again")
    assert code == 1 and "differs from run first at robot 1, stream command, 0.5500 s, row 11" in out


def test_record_that_is_cut_is_repeated_as_far_as_it_goes(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, folder: Path
) -> None:
    cut = tmp_path / "cut"
    cut.mkdir()
    data = (folder / "record.mcap").read_bytes()
    (cut / "record.mcap").write_bytes(data[: data.rindex(b"end.json") - 50])
    code, out, err = boebot(capsys, "replay", str(cut), "--again")
    assert code == 0 and "as far as it goes" in out and "the record is cut" in err


def test_what_cannot_be_repeated_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    assert boebot(capsys, "run", "wander", "--seconds", "0.2", "--realtime", "--out", "paced")[0] == 0
    code, _, err = boebot(capsys, "replay", "paced", "--again")
    assert code == 2 and "was run in real time, which no run repeats bit by bit" in " ".join(err.split())
    code, _, err = boebot(capsys, "replay", str(folder), "--again", "--seed", "2")
    assert code == 2 and "expected no --seed" in err
    assert boebot(capsys, "replay", "nowhere", "--again")[0] == 2


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


# ---- records that are damaged, or a stranger's -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of two seconds in eight groups, as a run of some seconds of the wall clock has; by a file."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "mine.py").write_text("def step(robot):\n    robot.drive(0.2, 0.2 * robot.random.random())\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("boebot.record.record.STEPS_AT_MOST", 5)
        library.run(folder / "mine.py", seconds=2, out=folder / "run")
    return folder / "run"


def copied(folder: Path, to: Path, change: Callable[[bytearray], object]) -> Path:
    """A run's record, changed."""
    data = bytearray((folder / "record.mcap").read_bytes())
    change(data)
    to.mkdir()
    (to / "record.mcap").write_bytes(data)
    return to


def chunk(data: bytearray, number: int) -> int:
    """Where the data of that chunk of a record begins."""
    return [match.end() for match in re.finditer(rb"\x04\0\0\0zstd", data)][number]


def bit(data: bytearray) -> None:
    data[chunk(data, 4) + 100] ^= 1


def zeros(data: bytearray) -> None:
    begin = chunk(data, 4)
    data[begin : begin + 512] = bytes(512)


@pytest.mark.parametrize("change", [bit, pytest.param(zeros, marks=pytest.mark.soak)])
def test_damaged_record_is_not_silent_anywhere(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    many: Path,
    change: Callable[[bytearray], object],
) -> None:
    monkeypatch.chdir(tmp_path)
    copied(many, tmp_path / "run", change)
    lost = "the run from 1.00 s to 1.25 s is lost; figures are of what is left"
    code, out, err = boebot(capsys, "report", "run", "--mend", "--as", "csv", "--json")
    said = json.loads(out)
    assert code == 1 and lost in err and lost in said["ended"]
    assert (said["steps"], said["ticks"]) == (40, 201 - 25)
    assert json.loads(Path("run/summary.json").read_text())["ended"] == said["ended"]
    assert lost in Path("run/replay.html").read_text() and len(Path("run/run.csv").read_text().splitlines()) == 177
    for asked, expected in {
        (
            "replay",
            "run",
            "--brain",
            str(many.parent / "mine.py"),
        ): "all 20 commands are the same, as far as it goes",
        ("report", "run", "--plot", "true_x_m"): "plot.png",
        ("replay", "run", "--again"): "",
        ("report", "run/record-mended.mcap"): "record is damaged",
        ("replay", "run/record-mended.mcap", "--brain", str(many.parent / "mine.py")): "all 20 commands are the same",
    }.items():
        code, out, err = boebot(capsys, *asked)
        assert code == 1 and lost in err and expected in " ".join(out.split()), asked
    with Image.open("plot.png") as picture:
        assert picture.info["Title"] == "mine on shieldbot, record damaged"
    rows = {
        number: boebot_rows(Path(name)) for number, name in enumerate(("run/record.mcap", "run/record-mended.mcap"))
    }
    assert rows[0] == rows[1]


def boebot_rows(record: Path) -> dict[str, list[tuple[float, bytes]]]:
    result = read_run(record)
    assert isinstance(result, RunResult)
    return {stream: result.record.rows(stream) for stream in result.record.streams()}


def test_damaged_attachment_is_not_believed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, many: Path
) -> None:
    monkeypatch.chdir(tmp_path)

    def seed(name: bytes) -> Callable[[bytearray], object]:
        def change(data: bytearray) -> None:
            data[data.index(b'"seed": 1', data.index(name)) + 8] = ord("3")

        return change

    for name in ("end", "begin"):
        run = copied(many, tmp_path / name, seed(f"{name}.json".encode()))
        code, out, err = boebot(capsys, "report", name, "--json")
        said = json.loads(out)
        assert code == 1 and f"attachment '{name}.json' is lost" in err
        assert (said["seed"], said["steps"], said["ticks"]) == (1, 40, 201)
        code, out, err = boebot(capsys, "replay", name, "--again")
        assert (code, out) == (1, "") and "expected a record that is not damaged inside" in err, run


def test_mended_record_of_one_whose_end_is_damaged_still_says_so(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path
) -> None:
    run = copied(many, tmp_path / "run", lambda data: data.__setitem__(data.rindex(b'"steps": 40') + 9, ord("5")))
    assert boebot(capsys, "report", str(run), "--mend", "-q")[0] == 1
    code, out, err = boebot(capsys, "report", str(run / "record-mended.mcap"), "--json")
    assert code == 1 and "attachment 'end.json' is lost" in err and json.loads(out)["steps"] == 40
    assert boebot(capsys, "replay", str(run / "record-mended.mcap"), "--again")[0] == 1


def test_what_only_the_end_of_a_record_knows_is_not_known_without_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path
) -> None:
    """Cut, or with an end that is damaged; also once it is mended."""
    unknown = {"late_steps", "lost_frames", "bad_frames", "resets", "sessions_lost"}
    changes: dict[str, Callable[[bytearray], object]] = {
        "cut": lambda data: data.__delitem__(slice(chunk(data, 6), None)),
        "damaged": lambda data: data.__setitem__(data.rindex(b'"steps": 40') + 9, ord("5")),
    }
    for name, change in changes.items():
        run = copied(many, tmp_path / name, change)
        boebot(capsys, "report", str(run), "--mend", "-q")
        for record in (run, run / "record-mended.mcap"):
            said = json.loads(boebot(capsys, "report", str(record), "--json")[1])
            assert {said[figure] for figure in unknown} | set(said["wall_clock"].values()) == {None}
            summary = json.loads((run / "summary.json").read_text())
            assert {summary[figure] for figure in unknown} == {None} and summary["counters"] == {}
            assert said["overruns"] == 0, "its telemetry says that"
    whole = json.loads(boebot(capsys, "report", str(copied(many, tmp_path / "whole", len)), "--json")[1])
    assert {whole[figure] for figure in unknown} == {0} and None not in whole["wall_clock"].values()


def test_mended_record_of_one_that_is_cut_still_says_so(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path
) -> None:
    """Else a repetition would differ where it was cut, and commands that are the same would be all that there were."""
    run = copied(many, tmp_path / "run", lambda data: data.__delitem__(slice(chunk(data, 6), None)))
    assert boebot(capsys, "report", str(run), "--mend", "-q")[0] == 0
    for record in (run, run / "record-mended.mcap"):
        for asked in (
            ("replay", str(record), "--again"),
            ("replay", str(record), "--brain", str(many.parent / "mine.py")),
        ):
            code, out, err = boebot(capsys, *asked)
            assert code == 0 and "as far as it goes" in out and "the record is cut: it ends at 1.5" in err, asked


def test_exit_codes_of_what_is_no_record(capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path) -> None:
    """2 in all commands; 0 for one that is cut; of one whose beginning and end are damaged nothing is known: 1."""
    (tmp_path / "notes").write_text("mine")
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "odd").open("wb") as file:  # its checksums are right
        writer = RecordWriter(file, "it")
        writer.attach(
            "begin.json", json.dumps(json.loads(attachments_of(many)["begin.json"]) | {"robots": [{}]}).encode()
        )
        writer.finish()

    def no_names(data: bytearray) -> None:
        for name in (b"begin.json", b"end.json"):
            data[data.index(name) + 60] ^= 1

    def cut(data: bytearray) -> None:
        del data[chunk(data, 6) :]

    damaged, short = copied(many, tmp_path / "damaged", no_names), copied(many, tmp_path / "short", cut)
    old = copied(many, tmp_path / "old", lambda data: None)
    brain = ("--brain", str(many.parent / "mine.py"))
    for folder, expected in {
        **dict.fromkeys((tmp_path / name for name in ("notes", "nowhere", "pipe", "odd")), 2),
        damaged: 1,
        short: 0,
        old: 0,
    }.items():
        for command in (
            ("report", "{}"),
            ("report", "{}", "--plot", "tick"),
            ("replay", "{}", *brain),
            ("replay", "{}", "--again"),
        ):
            asked = [str(folder) if word == "{}" else word for word in command]
            if "--plot" in command:
                asked += ["--out", str(tmp_path / "plot.png")]
            code, _, err = boebot(capsys, *asked)
            assert code == expected and "Traceback" not in err, asked


def test_nothing_is_not_the_same_as_nothing(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, many: Path
) -> None:
    """A record that is cut before its first group."""
    monkeypatch.chdir(tmp_path)
    copied(many, tmp_path / "run", lambda data: data.__delitem__(slice(chunk(data, 0), None)))
    for asked in (("replay", "run", "--brain", "wander"), ("replay", "run", "--again")):
        code, out, err = boebot(capsys, *asked)
        assert (code, out) == (2, "") and "there is nothing to compare" in err
    copied(many, tmp_path / "damaged", lambda data: data.__setitem__(chunk(data, 0), 0))
    code, out, err = boebot(capsys, "replay", "damaged", "--brain", "wander")
    assert (code, out) == (1, "") and "the run from 0.00 s to 0.25 s is lost" in err


def strangers(
    many: Path, to: Path, name: str, asked: dict[str, object], source: bytes = b"", rows: Group | None = None
) -> Path:
    """A record with a brain's file of that name, whose request is changed. `rows`: in place of those of its groups."""
    attached = attachments_of(many)
    begin = json.loads(attached["begin.json"])
    begin["request"] |= asked
    to.mkdir()
    with (many / "record.mcap").open("rb") as old, (to / "record.mcap").open("wb") as file:
        writer = RecordWriter(file, "it")
        writer.attach("brain/mine.py", attached["brain/mine.py"])
        writer.attach(f"brain/{name}", source)
        writer.attach("begin.json", json.dumps(begin).encode())
        for kept in RecordReader(old, "it").groups():
            writer.write({**kept.group, **(rows or {})}, kept.end_s)
        writer.attach("end.json", attached["end.json"])
        writer.finish()
    return to


@pytest.mark.parametrize("name", ["../x.py", "/x.py", "a/../../x.py", "..\\x.py", "a//x.py", "x.py\0", "./x.py"])
def test_file_of_a_record_lands_nowhere_else(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path, name: str
) -> None:
    run = strangers(many, tmp_path / "run", name, {}, b"harm")
    code, out, err = boebot(capsys, "replay", str(run), "--again", "--trust")
    assert (code, out) == (2, "") and f"the record has a file {'brain/' + name!r}; expected a path below brain/" in err
    assert not list(tmp_path.rglob("x.py*"))


def test_stranger_cannot_have_a_port_opened_or_a_file_of_ours_run(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path
) -> None:
    begin = json.loads(attachments_of(many)["begin.json"])
    (member,) = begin["request"]["members"]
    ours = tmp_path / "ours.py"
    ours.write_text("open(__file__ + '.ran', 'w')\ndef step(robot):\n    pass\n")
    port, brain = {"on": "/dev/ttyUSB0"}, {"members": [member | {"brain": str(ours)}]}
    refused: list[tuple[dict[str, object], str]] = [
        ({**port}, "is of a real robot"),
        ({"on": -1}, "the record makes no sense (AttributeError"),
        ({**brain}, "the record lacks the file of brain"),
    ]
    for number, (asked, sentence) in enumerate(refused):
        run = strangers(many, tmp_path / str(number), "other.py", asked)
        code, out, err = boebot(capsys, "replay", str(run), "--again")
        assert (code, out) == (2, "") and sentence in err
    assert [path.name for path in tmp_path.glob("ours*")] == ["ours.py"]


def test_link_in_the_folder_of_a_stranger_is_not_followed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path
) -> None:
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    run = copied(many, tmp_path / "run", lambda data: data.__delitem__(slice(chunk(data, 6), None)))
    for name in ("summary.json", "run.png", "replay.html", "record-mended.mcap"):
        (run / f".part-{name}").symlink_to(mine)
        (run / name).symlink_to(mine)
    assert boebot(capsys, "report", str(run), "--mend")[0] == 0
    assert mine.read_text() == "mine" and not (run / "summary.json").is_symlink()
    (run / "robot-2").symlink_to(tmp_path)
    code, _, err = boebot(capsys, "report", str(run), "--mend")
    assert code == 1 and "'robot-2' in" in err and "is a link to elsewhere; expected a folder, or nothing" in err


@pytest.mark.parametrize("data", [b"\x09" + bytes(16), b"short"])
def test_rows_that_no_run_writes_are_one_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, many: Path, data: bytes
) -> None:
    """Though their checksums are right: a command of kind 9, and one without signals."""
    run = strangers(many, tmp_path / "run", "x.py", {}, rows={"command": Block.of([(0.0, data)])})
    for asked in (
        ("report", str(run)),
        ("replay", str(run), "--brain", "wander"),
        ("report", str(run), "--plot", "tick"),
    ):
        code, out, err = boebot(capsys, *asked)
        assert (code, out) == (2, "") and "the record makes no sense (" in err and len(err.splitlines()) == 1
