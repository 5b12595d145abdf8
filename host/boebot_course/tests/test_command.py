"""`boebot experiment`: its list, its tables and files, its exit codes, and what it leaves when it is interrupted."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from boebot.errors import BoebotError
from boebot_course import experiments, output_files, pages, running
from boebot_course.experiment import about, exactly
from boebot_course.experiments import Experiment, Measured, Outcome, all_experiments
from boebot_course.tests import made_files
from command import boebot, heed_signals

QUICK = ("E29", "E30", "E58")  # of no robot, some milliseconds each
AGAIN_S = 2.0  # after which somebody presses Ctrl-C again
ENDS_S = 30.0  # a process that should end has ended by then, however busy the computer is


def outcome(value: float = 1.0, data: dict[str, list[object]] | None = None) -> Outcome:
    def draw(figure: object) -> None:
        figure.subplots().plot([0, 1], [0, value])  # type: ignore[attr-defined]

    return Outcome([about("gain, in one", value, 1.0, 0.1, "m")], data or {"time_s": [0.0, 1.0]}, draw)


def invented(
    name: str, value: float = 1.0, error: Exception | None = None, criterion: str = "As the notes."
) -> Experiment:
    def run(seed: int) -> Outcome:
        if error is not None:
            raise error
        return outcome(value)

    title, source, caption = f"Title of {name} <&>", "section 1.2, Fig. 1", "A line | <b>."
    texts = {"name": name, "title": title, "source": source, "caption": caption}
    return Experiment(robot="none", criterion=criterion, slow=False, run=run, **texts)


@pytest.fixture
def four_experiments(monkeypatch: pytest.MonkeyPatch) -> dict[str, Experiment]:
    """Experiments of this test alone: one that is met, one that is missed, two that fail."""
    known = {
        "X1": invented("X1", criterion="Of our own."),
        "X2": invented("X2", 1.2),
        "X2-board": replace(invented("X2-board", error=BoebotError("the board has gone")), on="board"),
        "Y": invented("Y", error=ZeroDivisionError("by nothing")),
    }
    monkeypatch.setattr(experiments, "EXPERIMENTS", known)
    return known


def test_list_names_all(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "list", "experiments")
    assert (code, err) == (0, "")
    names = {one.bare_name for one in all_experiments().values()}
    assert {line.split()[0] for line in out.splitlines() if line.strip()} >= names
    _, out, _ = boebot(capsys, "list", "experiments", "--json")
    listed = {one["name"]: one for one in json.loads(out)["experiments"]}
    assert set(listed) == names
    assert listed["E29"]["robot"] == "none" and listed["E29"]["section"] == "4.4.2"
    assert listed["E21"]["on"] == "arsim, shieldbot, avr"


@pytest.mark.parametrize(
    ("source", "section"),
    [
        ("section 4.4.2, Fig. 4.2", "4.4.2"),
        ("sections 5.1 and 5.2", "5.1"),
        ("chapter 8, opening", "8"),
        ("Fig. 5.1", ""),
    ],
)
def test_section_is_the_first_that_is_named(source: str, section: str) -> None:
    assert replace(all_experiments()["E30"], source=source).section == section


def test_one_run_prints_its_figures_and_writes_its_files(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    code, out, err = boebot(capsys, "experiment", "e57", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    assert re.search(r"U at p = 0.1 +-8.5 +-8.5 ± 1e-12 +met", out)
    assert {path.name for path in tmp_path.iterdir()} == {"E57.png", "E57.svg", "E57.csv", "E57.json"}
    verdict = json.loads((tmp_path / "E57.json").read_text())
    assert verdict["met"] and verdict["seed"] == 1 and verdict["measured"][0]["value"] == -7.0
    assert Image.open(tmp_path / "E57.png").size[0] > 1000
    assert "<svg" in (tmp_path / "E57.svg").read_text()


def test_figures_of_numpy_are_written_as_others() -> None:
    """numpy's bool is none that JSON knows, and comparisons of its numbers give one."""
    one = Measured("share", np.float64(0.5), least=np.float64(0.25), most=1)
    assert json.loads(json.dumps([one.is_met, one.value, one.least, one.most])) == [True, 0.5, 0.25, 1.0]


def test_csv_is_read_back_as_the_data() -> None:
    data: dict[str, list[object]] = {
        "time_s": [0.1, 1 / 3, math.nan, 1e-300],
        "count": [1, 2, 3, 4],
        'who, "or" what': ["a,b", 'c"d', "e\nf", ""],
        "met": [True, False, True, False],
    }
    content = output_files.as_csv(outcome(data=data))
    assert content.endswith(b"\r\n") and content.count(b"\r\n") == 5
    rows = list(csv.reader(io.StringIO(content.decode(), newline="")))
    assert rows[0] == list(data)
    columns = dict(zip(rows[0], zip(*rows[1:], strict=True), strict=True))
    times = [float(cell) if cell else math.nan for cell in columns["time_s"]]
    assert np.array_equal(times, np.array(data["time_s"], float), equal_nan=True)
    assert [int(cell) for cell in columns["count"]] == data["count"]
    assert list(columns['who, "or" what']) == data['who, "or" what']
    assert [bool(int(cell)) for cell in columns["met"]] == data["met"]


@pytest.mark.parametrize("data", [{"a": [1, 2], "b": [1]}, {"a": [[1], [2]]}])
def test_data_that_are_no_columns_are_refused(data: dict[str, list[object]]) -> None:
    with pytest.raises(ValueError, match="no columns of one length: a "):
        output_files.as_csv(outcome(data=data))


@pytest.mark.parametrize(
    ("measured", "text", "expected", "is_met"),
    [
        (Measured("", 2 / 3, most=1.0), "0.6667", "at most 1", True),
        (Measured("", 0.30001, most=0.3), "0.30001", "at most 0.3", False),
        (about("", 20.8751, 20.875, 1e-3), "20.875", "20.874 to 20.876", True),
        (about("", 0.5, 0.5, 1e-12), "0.5", "0.5 ± 1e-12", True),
        (exactly("", 123456, 123456), "123456", "123456", True),
        (Measured("", 12345.67, least=1.0), "12346", "at least 1", True),
        (exactly("", -0.0, 0), "0", "0", True),
        (Measured("", math.nan, least=0.0), "nan", "at least 0", False),
        (Measured("", math.inf, most=1.0), "inf", "at most 1", False),
    ],
)
def test_figure_is_said_so_that_its_verdict_can_be_seen(
    measured: Measured, text: str, expected: str, is_met: bool
) -> None:
    assert (measured.text, measured.expected, measured.is_met) == (text, expected, is_met)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((), "give either NAME or --all"),
        (("E29", "--all"), "give either NAME or --all"),
        (("E299",), "there is no experiment 'E299'; did you mean 'E29'"),
        (("qqqqqq",), "there is no experiment 'qqqqqq'; `boebot list experiments` names all"),
        (("E29", "Z*"), "there is no experiment 'Z*'"),
        (("E22", "--on", "arv"), "no such experiment runs on 'arv'; expected arsim, shieldbot, avr"),
        (("E29", "--seed", "-1"), "--seed"),
        (("--all", "--jobs", "0"), "--jobs"),
    ],
)
def test_wrong_usage_is_said_before_anything_runs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: tuple[str, ...], sentence: str
) -> None:
    code, out, err = boebot(capsys, "experiment", *arguments, "--out", str(tmp_path / "out"))
    assert (code, out) == (2, "") and sentence in err
    assert not (tmp_path / "out").exists()


def test_folder_that_cannot_be_written_is_said_before_the_run(
    four_experiments: dict[str, Experiment], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    code, out, err = boebot(capsys, "experiment", "Y", "--out", str(tmp_path / "file"))
    assert (code, out) == (1, "") and "file is a file; expected a folder" in err


def test_experiments_that_miss_or_fail_are_named_and_the_others_go_on(
    four_experiments: dict[str, Experiment], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    code, out, err = boebot(capsys, "experiment", "--all", "--jobs", "1", "--out", str(tmp_path))
    assert code == 1
    assert err == "boebot: 3 of 4 experiments are outside the criterion: X2, X2-board, Y\n"
    assert "Criterion: Of our own." in out
    assert re.search(r"gain, in one +1.2 +0.9 to 1.1 +m +missed", out)
    assert "the board has gone" in out
    assert re.search(r"ZeroDivisionError: by nothing \(test_command.py, line \d+\)", out)
    assert {path.name for path in tmp_path.glob("*.png")} == {"X1.png", "X2.png"}
    check_page(tmp_path / "index.md", list(four_experiments.values()))


def test_pattern_means_all_that_it_matches(
    four_experiments: dict[str, Experiment], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    which = ("x2*", "X1", "x1", "--on", "*")
    code, out, _ = boebot(capsys, "experiment", *which, "--jobs", "1", "--json", "--out", str(tmp_path))
    printed = json.loads(out)
    assert code == 1
    assert [(one["name"], one["met"]) for one in printed["experiments"]] == [
        ("X1", True),
        ("X2", False),
        ("X2-board", False),
    ]
    assert printed["experiments"][2]["error"] == "the board has gone"
    assert {Path(name).name for name in printed["files"]} == {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize(
    ("arguments", "names"),
    [(("X2",), ["X2"]), (("X2", "--on", "board"), ["X2-board"]), (("--all", "--on", "board"), ["X2-board"])],
)
def test_robot_is_the_first_or_the_one_that_is_named(
    arguments: tuple[str, ...],
    names: list[str],
    four_experiments: dict[str, Experiment],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    _, out, _ = boebot(capsys, "experiment", *arguments, "--jobs", "1", "--json", "--out", str(tmp_path))
    assert [one["name"] for one in json.loads(out)["experiments"]] == names


def check_page(path: Path, shown: list[Experiment]) -> None:
    """It names all of them, and shows no picture that is not there."""
    page = path.read_text(encoding="utf-8")
    for one in shown:
        heading = f"### On {one.on}" if one.on else f"## {one.name}: {pages.plain(one.title)}"
        assert f"\n{heading}\n" in page
    assert "**1.2 m (0.9 to 1.1), missed**" in page and "**Failed**: the board has gone" in page
    pictures = re.findall(r"^!\[.*\]\((.*)\)$", page, re.MULTILINE)
    assert pictures == ["X1.png", "X2.png"]


def test_same_seed_gives_the_same_files_whatever_the_number_of_processes() -> None:
    chosen = [all_experiments()[name] for name in QUICK]
    one, two = (
        {
            verdict.name: verdict
            for verdict in running.run(chosen, 3, jobs, lambda _: None, f"{made_files.__name__}:few_files")
        }
        for jobs in (1, 2)
    )
    assert set(one) == set(QUICK) and one == two
    assert [path.rpartition(".")[2] for path in one[made_files.ONE].files] == ["png", "svg", "csv", "json"]


def test_process_that_dies_fails_its_experiment_alone() -> None:
    chosen = [all_experiments()[name] for name in QUICK]
    verdicts = running.run(chosen, 1, 2, lambda _: None, f"{made_files.__name__}:fatal")
    words = {verdict.name: verdict.error or verdict.word for verdict in verdicts}
    assert words == {"E29": "met", made_files.ONE: "its process has died", "E58": "met"}


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in /proc")
def test_ctrl_c_leaves_no_process_and_no_half_file(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "boebot", "experiment", "--all", "--jobs", "2", "--out", str(tmp_path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=heed_signals)
    children: list[str] = []
    while len(children) < 2 and process.poll() is None:
        time.sleep(0.01)
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    while process.poll() is None:  # once is not enough if it comes while processes are being started
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(AGAIN_S)
    _, err = process.communicate()
    assert (process.returncode, err.decode()) == (130, "boebot: interrupted\n")
    assert len(children) >= 2
    until = time.perf_counter() + ENDS_S
    while (left := [child for child in children if alive(child)]) and time.perf_counter() < until:
        time.sleep(0.01)
    assert not left
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".") or path.name == "index.md"]
    for path in tmp_path.glob("*.json"):
        json.loads(path.read_text())


def alive(process: str) -> bool:
    """It is there and has not ended, which is what a state of Z means that nobody has asked for."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
