"""The command: its output, its exit codes, and one sentence for each mistake."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from boebot import cli
from boebot.boards import BoardRequest, board_kinds, open_world
from boebot.cli import board_link, ending, teleop
from boebot.link import finding, messages
from boebot.link.link import Link
from boebot.result import RunResult, read_run
from boebot.robot import Robot
from boebot.running import loop
from boebot.running.runner import run
from boebot.running.tasks import Request
from boebot.sketches import sketch
from command import boebot, heed_signals
from peer import InProcess, Peer, Pty, pty


@pytest.fixture
def peer(monkeypatch: pytest.MonkeyPatch) -> Peer:
    peer = Peer()

    def opened(url: str, requests: Sequence[BoardRequest]) -> Any:
        is_one = len(requests) == 1 and requests[0].robot.has_board
        return InProcess(peer) if is_one else open_world(url, requests)

    monkeypatch.setattr(loop, "open_world", opened)
    return peer


def test_run_prints_five_rows_all_figures_or_nothing(
    peer: Peer, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    code, out, err = boebot(capsys, "run", "wander", "--seconds", "3", "--out", str(folder))
    rows = re.findall(r"^ ?(\w+)(?:   | in )", out, re.MULTILINE)
    assert (code, err) == (0, "") and rows == ["run", "time", "way", "brain", "ended", "files"]
    assert "wander on shieldbot" in out and "60 steps, 0.05 s apart" in out and "complete" in out
    code, out, err = boebot(capsys, "report", str(folder), "--verbose")
    assert (code, err) == (0, "")
    for name in ("true distance", "lost frames", "overruns", "dead man stops", "real time factor"):
        assert name in out
    assert boebot(capsys, "run", "wander", "--robot", "arsim", "--seconds", "1", "-q") == (0, "", "")
    assert boebot(capsys, "report", str(folder), "-q") == (0, "", "")
    code, _, err = boebot(capsys, "run", "wander", "--seconds", "1", "-q", "--json")
    assert code == 2 and "expected one of --json, --verbose and --quiet" in err


def test_run_names_what_should_be_zero_and_is_not(peer: Peer, capsys: pytest.CaptureFixture[str]) -> None:
    result = run(seconds=1)
    assert ending.not_zero(result) == []
    shown = dataclasses.replace(result, late_steps=3, lost_frames=1200, resets=1)
    assert ending.not_zero(shown) == ["late steps 3", "lost frames 1,200", "resets 1"]
    ending.print_run(shown, ending.Detail.FEW)
    assert "late steps 3, lost frames 1,200, resets 1; expected 0 of each" in capsys.readouterr().out


def test_run_prints_json_and_writes_files(peer: Peer, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = tmp_path / "out"
    code, out, _ = boebot(capsys, "run", "wander", "--seconds", "3", "--seed", "7", "--json", "--out", str(folder))
    values = json.loads(out)
    assert code == 0
    assert (values["seed"], values["ticks"], values["ended"]) == (7, 301, "complete")
    assert {Path(name).name for name in values["files"]} == {path.name for path in folder.iterdir()}


def test_folder_that_cannot_be_written_is_said_before_the_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(loop, "open_world", lambda url, requests: pytest.fail("the run began"))
    (tmp_path / "file").touch()
    code, _, err = boebot(capsys, "run", "wander", "--out", str(tmp_path / "file"))
    assert code == 1 and "file is a file; expected a folder" in err


@pytest.mark.parametrize("period", ["0.02", "20ms", "20 ms", "2e-2s"])
def test_period_is_in_seconds_or_has_a_unit(peer: Peer, capsys: pytest.CaptureFixture[str], period: str) -> None:
    _, out, _ = boebot(capsys, "run", "wander", "--seconds", "1000ms", "--period", period, "--json")
    values = json.loads(out)
    assert (values["steps"], values["period_s"], values["run_time_s"]) == (50, 0.02, 1.0)


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("run", "wonder"), 1, "there is no brain 'wonder'"),
        (("run", "none.py"), 1, "there is no brain file none.py"),
        (("run", "wander", "--robot", "r2d2"), 1, "there is no robot 'r2d2'"),
        (("run", "wander", "--period", "15ms"), 1, "does not fit; expected a multiple of 10 ms"),
        (
            ("run", "wander", "--period", "50"),
            1,
            "a brain period of 50 s is too long; expected at most 800 ms; 50 ms would be 0.05, or 50ms as an option",
        ),
        (
            ("run", "wander", "--period", "50", "--robot", "arsim"),
            1,
            "of 50 s is too long; expected at most 10 s; 50 ms",
        ),
        (
            ("run", "wander", "--period", "5 parsec"),
            2,
            "'5 parsec' is no time; expected a number, in s, or with another",
        ),
        (("run", "wander", "--seconds", "0"), 1, "a run cannot last 0 s"),
        (("run", "wander", "--seconds", "ten"), 2, "--seconds"),
        (("run", "wander", "--robots", "0"), 2, "--robots"),
        (("run", "wander", "wander", "wonder"), 1, "robot 3: there is no brain 'wonder'"),
        (("run", "wander", "wander", "--robots", "3"), 1, "2 brains for 3 robots; expected 1 or 3"),
        (
            ("run", "wander", "--robots", "2", "--robot", "a", "--robot", "b", "--robot", "c"),
            1,
            "3 times --robot for 2",
        ),
        (("run", "wander", "--robots", "65", "--arena", "empty"), 1, "65 robots are too many; expected at most 64"),
        (
            ("run", "wander", "--pose", "1,2,90"),
            1,
            "its heading is 90 rad; expected one turn at most, 6.28 rad or 360deg",
        ),
        (("run", "wander", "--pose", "1,2ms,0"), 1, "is no pose: '2ms' is no length; expected a number, in m, or with"),
        (("run", "wander", "--pose", "1,2"), 1, "--pose '1,2' is no pose; expected X,Y,HEADING, as in 0.5,20cm,90deg"),
        (
            ("run", "wander", "--robot", "arsim", "--pose", "90,9,0"),
            1,
            "cannot start at x = 90 m, y = 9 m: no free space",
        ),
        (
            ("run", "wander", "--pose", "0,0,0", "--pose", "10cm,0,90deg", "--arena", "empty"),
            1,
            "robots 1 and 2 overlap",
        ),
        (
            ("run", "wander", "--robots", "2", "--robot", "arsim", "--on", "avr"),
            1,
            "it cannot run on 'avr'; expected 'direct'",
        ),
        (("run", "wander", "--robots", "2", "--on", "COM3"), 1, "'COM3' is a port: run each robot by itself there"),
        (("run",), 2, "BRAIN"),
        (("run", "wander", "--sedes", "1"), 2, "No such option"),
        (("fly",), 2, "No such command"),
        (("doctor", "/dev/does-not-exist", "--identity"), 1, "there is no port /dev/does-not-exist"),
        (("doctor", "toaster", "--identity"), 1, "there is no board 'toaster'"),
        (("serve", "--on", "avr"), 2, "give one of --pty and --tcp PORT"),
        (("serve", "--pty", "--tcp", "0"), 2, "give one of --pty and --tcp PORT"),
        (
            ("serve", "--tcp", "0", "--on", "native", "--without", "slop"),
            1,
            "there is no imperfection 'slop' to switch off",
        ),
        (("serve", "--pty", "--on", "toaster"), 1, "there is no emulated board 'toaster' to serve"),
        (("new", "my brain"), 1, "'my brain' cannot be a brain's name"),
        (("new", "nowhere/brain"), 1, "'nowhere/brain' cannot be a brain's name"),
        (("new", "../brain"), 1, "'../brain' cannot be a brain's name; expected letters, digits and underscores"),
        (("new", "mine", "--main", "--brain"), 1, "--brain and --main are two kinds of brain; expected one of them"),
        (("new", "wander"), 1, "'wander' is the name of a bundled brain"),
        (("new", "danse", "--sketch"), 2, "there is no sketch 'danse'; expected centring, dance, "),
        (("new", "dance", "--sketch", "--main"), 2, "--sketch copies a sketch, --brain and --main write a brain"),
    ],
)
def test_mistakes_end_in_one_sentence(
    peer: Peer,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    code: int,
    sentence: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    got, out, err = boebot(capsys, *arguments)
    assert got == code
    assert sentence in err and "Traceback" not in err
    assert out == ""
    if code == 1:
        assert err.startswith("boebot: ") and err.count("\n") == 1


def test_several_robots_print_a_table_each(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    arguments = ("run", "wander", "--robots", "3", "--seconds", "1", "--arena", "room")
    code, out, err = boebot(capsys, *arguments, "--out", str(tmp_path))
    assert (code, err) == (0, "")
    assert [line for line in out.splitlines() if line.startswith("robot")] == ["robot 1", "robot 2", "robot 3"]
    assert out.count("wander on shieldbot (native) in room, seed") == 3
    assert f"files in {tmp_path}: record.mcap, run.png, replay.html, robot-1/, robot-2/, robot-3/" in out
    code, out, _ = boebot(capsys, *arguments, "--json")
    values = json.loads(out)
    assert (code, len(values["robots"]), values["ended"]) == (0, 3, "complete")
    assert [robot["seed"] for robot in values["robots"]] == [1, 2, 3]


def test_options_given_several_times_go_to_one_robot_each(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "still.py").write_text("def step(robot):\n    robot.stop()\n")
    arguments = ("wander", str(tmp_path / "still.py"), "--robot", "shieldbot", "--robot", "shieldbot-quad")
    poses = ("--pose", "0,0,0", "--pose", "0,2,90deg", "--arena", "empty", "--seconds", "2", "--json")
    code, out, _ = boebot(capsys, "run", *arguments, *poses)
    first, second = json.loads(out)["robots"]
    assert code == 0
    assert (first["brain"], first["robot"]) == ("wander", "shieldbot") and first["true_distance_m"] > 0.1
    assert (second["brain"], second["robot"]) == ("still", "shieldbot-quad") and second["true_distance_m"] < 0.001


@pytest.mark.parametrize("robots", ["1", "2"])
def test_imperfections_are_switched_off_by_name(capsys: pytest.CaptureFixture[str], robots: str) -> None:
    arguments = ("run", "wander", "--robots", robots, "--arena", "empty", "--seconds", "0.5", "--json", "--without")
    code, out, _ = boebot(capsys, *arguments, "slip, bounce")
    values = json.loads(out)
    assert code == 0
    assert [table["without"] for table in values.get("robots", [values])] == int(robots) * ["slip, bounce"]
    code, _, err = boebot(capsys, *arguments, "slip,bouncy")
    assert code == 1 and "no imperfection 'bouncy' to switch off; `boebot list switches` has the names" in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize(("begin_s", "steps", "detail"), [(0.5, "11", ()), (0.5, "11", ("--verbose",)), (-1.0, "", ())])
def test_error_in_a_brain_is_said_once_below_the_table_of_what_ran(
    peer: Peer,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    begin_s: float,
    steps: str,
    detail: tuple[str, ...],
) -> None:
    brain = tmp_path / "wrong.py"
    brain.write_text(f"def step(robot):\n    if robot.time > {begin_s}:\n        1 / 0\n")
    code, out, err = boebot(capsys, "run", str(brain), *detail)
    assert (code, err) == (1, f"boebot: {brain}, line 3: ZeroDivisionError: division by zero\n")
    assert (steps in out) and ("early, by an error" in out) == bool(out) == bool(steps) and "Zero" not in out


def test_error_in_a_brain_comes_with_the_figures_in_json(
    peer: Peer, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    brain = tmp_path / "wrong.py"
    brain.write_text("def step(robot):\n    if robot.time > 0.5:\n        robot.fly()\n")
    code, out, err = boebot(capsys, "run", str(brain), "--json")
    assert code == 1
    assert json.loads(out)["run_time_s"] == 0.55
    assert err.startswith(f"boebot: {brain}, line 3: robot 'shieldbot' has no attribute 'fly'; its devices are ")
    assert err.count("\n") == 1


def test_new_brain_runs_and_is_never_overwritten(
    peer: Peer, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert boebot(capsys, "new", "first")[0] == 0
    code, out, _ = boebot(capsys, "run", "first.py", "--seconds", "20", "--json")
    assert code == 0 and json.loads(out)["true_distance_m"] > 0.5
    (tmp_path / "first.py").write_text("# precious\n")
    code, _, err = boebot(capsys, "new", "first")
    assert code == 1 and "first.py exists already" in err
    assert (tmp_path / "first.py").read_text() == "# precious\n"


def test_bundled_sketch_is_copied_and_never_over_another_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, _ = boebot(capsys, "new", "dance", "--sketch")
    assert code == 0 and "boebot run dance/dance.ino --robot shieldbot-basic --arena empty --view" in " ".join(
        out.split()
    )
    assert (tmp_path / "dance" / "dance.ino").read_text() == sketch("dance").text
    code, _, err = boebot(capsys, "new", "--sketch", "dance")
    assert code == 1 and "dance/dance.ino exists already; it was left as it is" in err
    (tmp_path / "line").touch()
    code, _, err = boebot(capsys, "new", "--sketch", "line")
    assert code == 1 and "line exists already; it was left as it is" in err


def test_version_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = boebot(capsys, "--version")
    assert (
        code == 0
        and out.startswith("boebot ")
        and f"protocol {finding.version_name()}, schema {messages.SCHEMA_HASH:08x}" in out
    )
    code, out, _ = boebot(capsys, "--help")
    assert code == 0 and all(name in out for name in ("run", "serve", "doctor", "teleop", "can"))


@pytest.mark.wall_clock
def test_info_over_a_port(capsys: pytest.CaptureFixture[str]) -> None:
    with pty(Peer()) as served:
        code, out, _ = boebot(capsys, "doctor", served.path, "--identity", "--json")
        values = json.loads(out)
        assert code == 0
        assert (values["firmware"], values["pin_map"], values["tick_rate_hz"]) == ("0.1.0", "shieldbot", 100)
        assert "infrared" in values["devices"]
        code, out, _ = boebot(capsys, "doctor", served.path, "--identity")
        assert code == 0 and "compiler" in out and "servo left centre" in out


@pytest.mark.wall_clock
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.soak)])
def test_interrupt_stops_the_motors_and_keeps_the_record(number: signal.Signals, tmp_path: Path) -> None:
    with pty(Peer()) as served:
        command = [sys.executable, "-m", "boebot", "run", "wander", "--on", served.path, "--out", str(tmp_path / "out")]
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=heed_signals,
        )
        until = time.perf_counter() + 20
        while served.peer.command == (0.0, 0.0) and time.perf_counter() < until:
            time.sleep(0.02)
        time.sleep(0.3)
        process.send_signal(number)
        for _ in range(5):  # an impatient user: none of these may cost the record
            time.sleep(0.03)
            process.send_signal(number)
        out, err = process.communicate(timeout=20)
        assert served.peer.command == (0.0, 0.0)
        assert served.peer.stops, "by the stop message, not by the dead-man"
        assert served.peer.latch != messages.Latch.NONE
    assert process.returncode == 128 + number
    assert err == "boebot: interrupted\n"
    assert "interrupted" in out
    assert ticks_in(tmp_path / "out") > 0


@pytest.mark.parametrize("after_s", [0.04, 0.1, 0.2, 0.3])
def test_interrupt_while_the_command_starts_is_no_traceback(after_s: float) -> None:
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "from boebot.cli import main; print('up', flush=True); main()",
            "run",
            "wander",
            "--seconds",
            "1e5",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_signals,
    )
    assert process.stdout is not None and process.stdout.readline() == "up\n"
    time.sleep(after_s)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert (process.returncode, err) == (130, "boebot: interrupted\n")


def test_import_that_ctrl_c_cut_ends_as_interrupted() -> None:
    """Libraries may make another error of it."""
    code = """
import signal
import boebot.cli as cli

def run():
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        raise AttributeError("half of a module")

cli._run = run
cli.main()
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, preexec_fn=heed_signals
    )
    assert (done.returncode, done.stderr) == (130, "boebot: interrupted\n")


def test_interrupt_within_an_exec_ends_with_the_same_code(tmp_path: Path) -> None:
    """CPython's -m remembers that one left an exec of a text, and ends by the signal even if it was caught since."""
    (tmp_path / "again.py").write_text("""
import boebot.cli as cli
cli._run = lambda: exec("raise KeyboardInterrupt")
cli.main()
""")
    done = subprocess.run(
        [sys.executable, "-m", "again"], cwd=tmp_path, capture_output=True, text=True, timeout=20, check=False
    )
    assert (done.returncode, done.stderr) == (130, "boebot: interrupted\n")


def test_heavy_modules_wait_until_ctrl_c_is_caught() -> None:
    loaded = subprocess.run(
        [sys.executable, "-c", "import boebot.cli, sys; print(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert not {"numpy", "typer", "rich"} & set(loaded)


def test_hang_up_that_was_to_be_ignored_stays_ignored(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        monkeypatch.setattr(cli, "_run", lambda: signal.getsignal(signal.SIGHUP) == signal.SIG_IGN and 42)
        assert boebot(capsys)[0] == 42
    finally:
        signal.signal(signal.SIGHUP, before)


def test_new_brain_that_cannot_be_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    tmp_path.rmdir()
    code, _, err = boebot(capsys, "new", "first")
    assert code == 1 and err.startswith("boebot: first.py cannot be written: ")


def fails(*_: object) -> None:
    raise RuntimeError("no ink\nat all")


@pytest.mark.parametrize("writer", ["boebot.view.picture.draw", "boebot.view.replay.write"])
def test_picture_that_fails_costs_no_other_file(
    peer: Peer, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writer: str
) -> None:
    monkeypatch.setattr(writer, fails)
    code, out, err = boebot(capsys, "run", "wander", "--seconds", "1", "--json", "--out", str(tmp_path))
    missing = "run.png" if "picture" in writer else "replay.html"
    assert code == 1
    assert err == f"boebot: {missing} cannot be made: RuntimeError: no ink; the run's other files are in {tmp_path}\n"
    there = {path.name for path in tmp_path.iterdir()}
    assert {"record.mcap", "summary.json", "run.png", "replay.html"} - there == {missing}
    assert {Path(name).name for name in json.loads(out)["files"]} == there


@pytest.mark.parametrize(
    ("line", "code", "sentence"),
    [("robot.fly()", 1, "has no attribute 'fly'"), ("raise KeyboardInterrupt", 130, "interrupted")],
)
def test_error_of_the_brain_comes_before_that_of_its_files(
    peer: Peer,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    line: str,
    code: int,
    sentence: str,
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("boebot.view.tables.write_summary", full)
    brain = tmp_path / "wrong.py"
    brain.write_text(f"def step(robot):\n    if robot.time > 0:\n        {line}\n")
    got, out, err = boebot(capsys, "run", str(brain), "--out", str(tmp_path / "out"))
    first, second = err.splitlines()
    assert got == code and "distance" in out
    assert sentence in first and "No space left on device" in second


def test_files_are_written_even_if_nobody_reads_the_table(
    peer: Peer, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(*_: object, **__: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("boebot.cli.ending.print_run", gone)
    monkeypatch.setattr("sys.stderr", io.StringIO())
    code, _, _ = boebot(capsys, "run", "wander", "--seconds", "1", "--out", str(tmp_path))
    assert code == 1 and (tmp_path / "replay.html").is_file()


@pytest.mark.parametrize("robots", ["1", "2"])
def test_json_stands_alone_whatever_a_brain_prints(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, robots: str
) -> None:
    brain = tmp_path / "loud.py"
    brain.write_text("print('loaded')\ndef step(robot):\n    print('{')\n")
    code, out, err = boebot(capsys, "run", str(brain), "--robots", robots, "--seconds", "0.2", "--json")
    assert code == 0 and json.loads(out)["ended"] == "complete"
    assert err.startswith("loaded\n") and "{" in err
    assert "loaded" in boebot(capsys, "run", str(brain), "--seconds", "0.2")[1]


def ticks_in(folder: Path) -> int:
    """Of the run whose record is there."""
    result = read_run(folder)
    assert isinstance(result, RunResult)
    return result.record.ticks


@pytest.mark.wall_clock
def test_vanished_port_is_one_sentence_and_a_whole_record(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    served, file = Pty(Peer()), tmp_path / "out" / "record.mcap"

    def unplug_once_it_drives() -> None:
        while not (file.exists() and file.stat().st_size > 15_000):  # its description is shorter
            time.sleep(0.05)
        served.unplug()

    brain = tmp_path / "brain.py"
    brain.write_text("def step(robot):\n    robot.drive(0.5, 0.5)\n")
    threading.Thread(target=unplug_once_it_drives, daemon=True).start()
    code, _, err = boebot(capsys, "run", str(brain), "--on", served.path, "--out", str(tmp_path / "out"))
    assert code == 1
    assert err == f"boebot: {served.path} has gone: unplugged, or closed by the other side\n"
    assert ticks_in(tmp_path / "out") > 10


# ---- link and parameters ---------------------------------------------------------------------------------------------


@pytest.fixture
def board(monkeypatch: pytest.MonkeyPatch) -> InProcess:
    """What `boebot doctor --watch` and `boebot parameters` open."""
    session = InProcess(Peer())

    def opened(url: str, request: BoardRequest) -> InProcess:
        session.closed = False
        return session

    monkeypatch.setattr(board_link, "open_board", opened)
    return session


def test_link_shows_both_ends_once(board: InProcess, capsys: pytest.CaptureFixture[str]) -> None:
    board.peer.usual_task_times = [8 * number for number in range(len(messages.Task))]
    code, out, err = boebot(capsys, "doctor", "native", "--watch", "--seconds", "1", "--json")
    seen = json.loads(out)
    assert (code, err) == (0, "")
    assert seen["task_longest_s"] == {task.name.lower(): pytest.approx(task / 2e6) for task in messages.Task}
    assert seen["last_reset"] == "power"
    assert seen["host"]["good"] > 90 and seen["board_end"]["good"] > 1 and seen["host"]["bad"] == 0
    assert 120 <= seen["frame_rate_hz"] <= 175, "telemetry, a quarter of that about the board itself, hello, probes"
    assert seen["round_trip_p50_s"] == pytest.approx(0.52e-3, abs=0.3e-3), "10 bytes there and 14 back"
    assert abs(seen["clock_drift"]) < 200e-6 and seen["clock_bound_s"] < 500e-6
    board.read(0.01)
    assert board.peer.session == 0 and board.peer.accepted == [], "closed, and nothing has moved"
    board.peer._happened(messages.EventKind.DEAD_MAN, 7)
    code, out, _ = boebot(capsys, "doctor", "native", "--watch", "--seconds", "1")
    assert "motors stopped by the dead-man" in " ".join(out.split())
    for name in (
        "round trip p99",
        "clock drift",
        "counted",
        "resynchronised",
        "deferred",
        "late",
        "last reset",
        "longest (µs)",
        "storage",
    ):
        assert name in out


def test_link_prints_an_object_every_second(board: InProcess, capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = boebot(capsys, "doctor", "native", "--watch", "--json", "--seconds", "3.5")
    seen = [json.loads(line) for line in out.splitlines()]
    assert len(seen) == 4
    assert seen[-1]["host"]["good"] > seen[0]["host"]["good"] > 0


def test_link_refuses_to_watch_for_less_than_no_time(board: InProcess, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "doctor", "native", "--watch", "--json", "--seconds", "-1")
    assert (code, out) == (2, "") and "seconds" in err
    assert board.peer.openings == []


def test_clock_of_a_session_that_has_just_begun_is_not_known(board: InProcess) -> None:
    watched = Link(board)
    watched.open()
    while watched.transport.now() < 1.0:
        watched.poll(0.01)
    assert board_link.look(watched, 1.0, 0, [])["clock_bound_s"] < 500e-6
    board.peer.reset()
    while watched.counts.sessions == 1:
        watched.poll(0.001)
    seen = board_link.look(watched, 1.0, 0, [])
    assert watched.clock.estimate.probes > 0
    assert (seen["clock_bound_s"], seen["clock_offset_s"], seen["clock_drift"]) == (None, None, None)


@pytest.mark.parametrize("columns", [80, 120])
def test_list_of_parameters_is_readable_at_any_width(
    board: InProcess, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    code, out, _ = boebot(capsys, "parameters", "list")
    lines = [line.rstrip() for line in out.splitlines()]
    assert code == 0 and max(map(len, lines)) <= columns
    assert len(lines) <= 4 * len(messages.PARAMETERS), "meanings are not squeezed into a narrow column"
    for name, spec in messages.PARAMETERS.items():
        first = next(index for index, line in enumerate(lines) if line.split()[:1] == [name])
        following = " ".join(" ".join(line[-columns // 2 :] for line in lines[first : first + 5]).split())
        assert spec.doc.split()[-1] in following


def test_parameters_are_listed_set_saved_and_reset(board: InProcess, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = boebot(capsys, "parameters", "list", "--json")
    listed = json.loads(out)
    assert code == 0 and listed["saved"] is False
    assert [row["name"] for row in listed["parameters"]] == list(messages.PARAMETERS)
    centre = next(row for row in listed["parameters"] if row["name"] == "servo_left_centre")
    assert (centre["value"], centre["unit"], centre["least"], centre["greatest"]) == (1500.0, "us", 1400.0, 1600.0)
    code, out, _ = boebot(capsys, "parameters", "set", "servo_right_gain", "-190.5")
    assert (code, out) == (0, "servo_right_gain = -190.5 us\n")
    assert boebot(capsys, "parameters", "set", "time_to_live", "300ms")[1] == "time_to_live = 0.3 s\n"
    assert board.peer.parameter("time_to_live") == 300, "ms on the wire"
    assert boebot(capsys, "parameters", "save")[0] == 0
    assert board.peer.saved is not None
    assert boebot(capsys, "parameters", "reset")[0] == 0
    assert boebot(capsys, "parameters", "get", "servo_right_gain")[1] == "servo_right_gain = -200 us\n"
    board.peer.reset()
    assert boebot(capsys, "parameters", "get", "servo_right_gain")[1] == "servo_right_gain = -190.5 us\n"
    assert "range" in boebot(capsys, "parameters", "list")[1]


def test_set_and_reset_save_in_the_same_session(board: InProcess, capsys: pytest.CaptureFixture[str]) -> None:
    number = messages.PARAMETERS["ping_period"].id
    default = board.peer.parameter("ping_period")
    code, out, err = boebot(capsys, "parameters", "set", "ping_period", "8")
    assert (code, out, board.peer.saved) == (0, "ping_period = 8 ticks\n", None)
    assert "ping_period lasts only until this command ends, and its emulated board; --save keeps it" in err
    _, out, err = boebot(capsys, "parameters", "set", "ping_period", "9", "--save")
    assert out == "ping_period = 9 ticks\n"
    assert "the EEPROM of the emulated board 'native' ends with this command" in err and "--save" not in err
    assert board.peer.saved is not None and board.peer.saved[number] == 9
    assert boebot(capsys, "parameters", "reset", "--save")[1] == "all parameters are reset and saved\n"
    assert board.peer.saved[number] == default


@contextlib.contextmanager
def served() -> Iterator[str]:
    """The port of an emulated robot that another process serves; opening it resets the robot."""
    command = [sys.executable, "-m", "boebot", "serve", "--on", "native", "--pty", "--json"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=heed_signals)
    assert server.stdout is not None
    try:
        announced = ""
        while not announced.endswith("}\n"):
            line = server.stdout.readline()
            assert line, "it does not serve"
            announced += line
        yield json.loads(announced)["url"]
    finally:
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=10)


@pytest.mark.wall_clock
@pytest.mark.skipif("native" not in board_kinds(), reason="the simulator is not installed")
def test_parameter_outlasts_the_reset_at_opening_only_if_it_is_saved_with_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def run(*arguments: str) -> tuple[int, str, str]:
        time.sleep(
            0.1
        )  # as long as a program takes to start: the server notices that the one before has closed the port
        return boebot(capsys, "parameters", *arguments)

    def value(url: str) -> float:
        return float(run("get", "ping_period", "--on", url)[1].split()[2])

    with served() as url:
        default = value(url)
        assert default not in (7, 8)
        _, _, err = run("set", "ping_period", "7", "--on", url)
        assert f"opening {url} has reset the board" in err
        assert "ping_period lasts only until the board's next reset; --save keeps it" in err
        code, _, err = run("save", "--on", url)
        assert code == 0 and "what was set and not saved is lost" in err
        assert value(url) == default
        code, _, err = run("set", "ping_period", "8", "--save", "--on", url)
        assert code == 0 and "lasts only" not in err and "EEPROM" not in err
        assert value(url) == 8
        assert run("reset", "--on", url)[0] == 0
        assert value(url) == 8, "the reset was not saved"
        assert run("reset", "--save", "--on", url)[0] == 0
        assert value(url) == default


@pytest.mark.wall_clock
def test_board_that_the_opening_does_not_reset_is_not_said_to_be(capsys: pytest.CaptureFixture[str]) -> None:
    with pty(Peer()) as port:
        time.sleep(0.7)
        _, _, err = boebot(capsys, "parameters", "set", "ping_period", "7", "--on", port.path)
        assert "lasts only" in err and "has reset" not in err
        assert boebot(capsys, "parameters", "save", "--on", port.path)[2] == ""
        assert port.peer.saved is not None
        assert port.peer.saved[messages.PARAMETERS["ping_period"].id] == 7


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("get", "speed"), "there is no parameter 'speed'; expected one of devices, time_to_live"),
        (("set", "ping_period", "300"), "parameter ping_period cannot be 300 ticks; expected 4 to 250"),
        (("set", "time_to_live", "250"), "parameter time_to_live cannot be 250 s; expected 0.02 to 2"),
        (
            ("set", "time_to_live", "20cm"),
            "'20cm' is no time; expected a number, in s, or with another",
        ),
        (("set", "wheel_radius", "nan"), "parameter wheel_radius cannot be nan m; expected 0.005 to 0.2"),
    ],
)
def test_wrong_parameters_are_said_before_the_board_is_asked(
    board: InProcess, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], sentence: str
) -> None:
    code, _, err = boebot(capsys, "parameters", *arguments)
    assert code == 1 and sentence in err and err.count("\n") == 1
    assert board.peer.openings == []


# ---- teleop ----------------------------------------------------------------------------------------------------------


def test_keys_are_distinguished() -> None:
    assert list(teleop.keys("w\x1b[A\x1b[D\x1bOC 5Q\x03")) == ["w", "w", "a", "d", " ", "5", "q", "q"]


def test_keyboard_drives_while_keys_are_held(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr("boebot.cli.teleop.time.perf_counter", lambda: clock[0])
    typed = iter(["w", "", "9w", "d", " ", "w", "", "q"])
    shown: list[str] = []
    commands: list[tuple[float, float]] = []

    class Watched(teleop.Keyboard):
        def step(self, robot: Robot) -> None:
            clock[0] += 0.35
            super().step(robot)
            commands.append((robot.command.left, robot.command.right))

    result = loop.execute(Request.single(Watched(lambda: next(typed), shown.append), seconds=10))
    assert isinstance(result.error, KeyboardInterrupt)
    turn = teleop.TURN
    assert commands == [(0.5, 0.5), (0.5, 0.5), (1, 1), (turn, -turn), (0, 0), (1, 1), (1, 1)]
    assert "encoders" in shown[-1] and "whiskers" in shown[-1]


def test_teleop_needs_a_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", open(os.devnull))  # noqa: PTH123, SIM115
    code, _, err = boebot(capsys, "teleop")
    assert code == 1 and "its input is not a terminal" in err


@contextlib.contextmanager
def teleop_at(served: Pty, *arguments: str) -> Iterator[tuple[int, subprocess.Popen[str]]]:
    """`boebot teleop` with a keyboard, whose keys are written to the number given; ends when it has driven."""
    keyboard, slave = os.openpty()
    try:
        process = subprocess.Popen(
            [sys.executable, "-m", "boebot", "teleop", "--on", served.path, *arguments],
            stdin=slave,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=heed_signals,
        )
        until = time.perf_counter() + 20
        while served.peer.command != (0.5, 0.5) and time.perf_counter() < until:
            os.write(keyboard, b"\x1b[A")
            time.sleep(0.05)
        assert served.peer.command == (0.5, 0.5)
        yield keyboard, process
    finally:
        os.close(keyboard)
        os.close(slave)


@pytest.mark.wall_clock
def test_teleop_in_a_terminal(tmp_path: Path) -> None:
    """Over two pseudo-terminals: one for the keyboard, one for the robot."""
    with pty(Peer()) as served, teleop_at(served, "--out", str(tmp_path)) as (keyboard, process):
        time.sleep(1.0)
        let_go = served.peer.command
        os.write(keyboard, b"q")
        out, err = process.communicate(timeout=20)
    assert let_go == (0.0, 0.0)
    assert (process.returncode, err) == (0, "")
    assert teleop.HELP in out and "distance" in out and "complete" in out
    assert f"files in {tmp_path}: " in out and (tmp_path / "replay.html").is_file()


@pytest.mark.wall_clock
@pytest.mark.soak
def test_teleop_prints_json_alone(tmp_path: Path) -> None:
    with pty(Peer()) as served, teleop_at(served, "--json", "--out", str(tmp_path)) as (keyboard, process):
        os.write(keyboard, b"q")
        out, err = process.communicate(timeout=20)
    values = json.loads(out)
    assert (values["brain"], values["ended"]) == ("keyboard", "complete")
    assert {Path(name).name for name in values["files"]} == {path.name for path in tmp_path.iterdir()}
    assert teleop.HELP in err and "whiskers" in err


@pytest.mark.wall_clock
def test_teleop_that_is_interrupted_says_so() -> None:
    with pty(Peer()) as served, teleop_at(served, "--json") as (_, process):
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
        assert served.peer.command == (0.0, 0.0)
    assert process.returncode == 130 and err.endswith("\nboebot: interrupted\n")
    assert json.loads(out)["ended"] == "interrupted"
