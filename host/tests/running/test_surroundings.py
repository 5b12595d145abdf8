"""Odd surroundings: standard streams that are closed, names that are no UTF-8, brains that change the process that they
run in. The run is whole, in one folder, without a traceback, and no process stays."""

from __future__ import annotations

import os
import re
import select
import sys
from pathlib import Path

import pytest

import copied_process
from boebot import cli, resources
from boebot.result import RunResult, read_run

LIMIT_S = 20.0
FILES = {"record.mcap", "summary.json", "run.png", "replay.html"}


def assert_whole(folder: Path, steps: int) -> None:
    """It holds all files of a run of that many steps, and nothing else."""
    assert {path.name for path in folder.iterdir()} == FILES
    result = read_run(folder)
    assert isinstance(result, RunResult) and (result.error, result.record.count("command")) == (None, steps)


def test_closed_standard_streams_get_nothing_and_no_file_takes_their_numbers(tmp_path: Path) -> None:
    def work() -> None:  # as Python begins with `boebot ... <&- >&- 2>&-`
        for number, name in enumerate(("stdin", "stdout", "stderr")):
            os.close(number)
            setattr(sys, name, None)
        sys.argv = ["boebot", "run", "wander", "--seconds", "0.2", "--out", "out"]
        cli.main()

    assert copied_process.copied(work, tmp_path).returncode == 0
    assert_whole(tmp_path / "out", 4)


@pytest.mark.parametrize(
    "line",
    ["sys.stdout.close(); sys.stderr.close()", "sys.stdout = sys.stderr = io.StringIO()", "os.close(1); os.close(2)"],
)
def test_brain_may_close_and_replace_the_streams_that_the_command_needs(line: str, tmp_path: Path) -> None:
    (tmp_path / "odd.py").write_text(f"import io, os, sys\ndef step(robot):\n    if robot.time == 0: {line}\n")
    done = copied_process.command(["run", "odd.py", "--seconds", "0.2"], tmp_path)
    assert (done.returncode, done.stderr) == (0, "") and re.search(r"\bended +complete\b", done.stdout)


def test_brain_may_change_the_folder_rights_and_depth_of_calls(tmp_path: Path) -> None:
    """Files of the request are found though the first robot's brain leaves their folder, and all files of the run
    are in one."""
    (tmp_path / "far").mkdir()
    code = f"os.chdir({str(tmp_path / 'far')!r}); os.umask(0o777); sys.setrecursionlimit(150)"
    (tmp_path / "moves.py").write_text(f"import os, sys\n{code}\ndef step(robot): pass\n")
    (tmp_path / "mine.toml").write_text('extends = "shieldbot"\nname = "mine"\n')
    (tmp_path / "yard.toml").write_text((resources.folder("arenas") / "empty.toml").read_text())
    robots = ["--robot", "mine.toml", "--pose", "0,0,0", "--pose", "1,1,0"]
    done = copied_process.command(
        ["run", "moves.py", "moves.py", *robots, "--arena", "yard.toml", "--seconds", "0.1", "--out", "out"], tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert not list((tmp_path / "far").iterdir())
    assert (tmp_path / "out" / "run.png").stat().st_mode & 0o400 and (tmp_path / "out" / "robot-2").is_dir()


def test_name_that_is_no_utf_8_is_escaped_and_the_run_is_repeated_by_it(tmp_path: Path) -> None:
    brain = os.fsdecode(b"a\xff.py")
    (tmp_path / brain).write_text("def step(robot):\n    robot.drive(0.5, 0.5)\n")
    done = copied_process.command(["run", brain, "--seconds", "0.2", "--out", "out"], tmp_path)
    assert (done.returncode, done.stderr) == (0, "") and r"a\xff on shieldbot" in done.stdout
    assert_whole(tmp_path / "out", 4)
    (tmp_path / brain).unlink()  # its source is in the record
    done = copied_process.command(["replay", "out", "--again", "--trust"], tmp_path)
    assert (done.returncode, done.stdout) == (0, "bit-equal to out: 4 steps\n")


FORKS = """import multiprocessing, os, signal
os.fork()
def step(robot):
    if robot.time == 0:
        os.fork()
        if os.fork() == 0:
            1 / 0
        if os.fork() == 0:
            os.fork()
            signal.pause()
        multiprocessing.get_context("fork").Process(target=signal.pause).start()
"""
FORKS_BETWEEN_WAITS = """import os
def main(robot):
    robot.wait(0.1)
    os.fork()
    robot.wait(0.1)
"""


@pytest.mark.parametrize("code", [FORKS, FORKS_BETWEEN_WAITS], ids=["step", "main"])
def test_what_a_brain_forks_takes_no_part_in_the_run_and_ends_with_it(code: str, tmp_path: Path) -> None:
    (tmp_path / "forks.py").write_text(code)
    looks, held = os.pipe()  # all copies hold it open
    out = ["--out", "out"] if code == FORKS else []
    done = copied_process.command(["run", "forks.py", "--seconds", "0.2", *out], tmp_path)
    os.close(held)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout.count("ended ") == 1
    if out:
        assert_whole(tmp_path / "out", 4)
    assert select.select([looks], [], [], LIMIT_S)[0], "a process stays"
    os.close(looks)
