"""Standard output that cannot take what is printed: a full disk, a terminal with ASCII only."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import copied_process
from boebot import cli

FULL = Path("/dev/full")
BOEBOT = [sys.executable, "-m", "boebot"]


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full")
@pytest.mark.parametrize("arguments", [["--help"], ["run", "prints.py", "--seconds", "0.2"]])
def test_full_output_is_one_sentence_and_files_are_written(arguments: list[str], tmp_path: Path) -> None:
    (tmp_path / "prints.py").write_text("def step(robot):\n    print('.', end='')\n")
    out = ["--out", str(tmp_path / "out")] if "run" in arguments else []
    with FULL.open("w") as full:
        done = subprocess.run([*BOEBOT, *arguments, *out], stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    assert done.stderr == "boebot: the output cannot be written: no space left on device\n"
    assert done.returncode == 1
    assert not out or (tmp_path / "out" / "summary.json").is_file()


def test_terminal_with_ascii_only_is_given_question_marks() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "COLUMNS": "100"}
    table = subprocess.run([*BOEBOT, "parameters", "list"], capture_output=True, env=environment, check=True)
    assert b" 0 ? 4095" in table.stdout and table.stdout.isascii() and table.stderr == b""


def test_json_stands_alone_however_a_brain_prints(tmp_path: Path) -> None:
    lines = ["print('a')", "os.write(1, b'b')", "sys.__stdout__.write('c')", "os.system('echo d')"]
    (tmp_path / "prints.py").write_text(f"import os, sys\ndef step(robot):\n    {'; '.join(lines)}\n")
    done = subprocess.run(
        [*BOEBOT, "run", "prints.py", "--seconds", "0.05", "--json"], capture_output=True, text=True, cwd=tmp_path
    )
    assert json.loads(done.stdout)["ended"] == "complete" and done.returncode == 0
    assert sorted("".join(done.stderr.split())) == ["a", "b", "c", "d"]


def test_brain_may_print_any_character_to_a_terminal_with_ascii_only(tmp_path: Path) -> None:
    (tmp_path / "prints.py").write_text("def step(robot):\n    print('é±→…')\n", encoding="utf-8")

    def work() -> None:
        assert isinstance(sys.stdout, io.TextIOWrapper)
        sys.stdout.reconfigure(encoding="ascii")
        sys.argv = ["boebot", "run", "prints.py", "--seconds", "0.05"]
        cli.main()

    done = copied_process.copied(work, tmp_path)
    assert done.returncode == 0 and "????\n" in done.stdout and done.stdout.isascii()
