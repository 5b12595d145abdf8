"""Standard output that cannot take what is printed: a full disk, a terminal with ASCII only."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

FULL = Path("/dev/full")
BOEBOT = [sys.executable, "-m", "boebot"]


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full")
@pytest.mark.parametrize(
    "arguments", [["--help"], ["list", "robots", "--json"], ["run", "prints.py", "--seconds", "0.2"]]
)
def test_full_output_is_one_sentence_and_files_are_written(arguments: list[str], tmp_path: Path) -> None:
    (tmp_path / "prints.py").write_text("def step(robot):\n    print('.', end='')\n")
    out = ["--out", str(tmp_path / "out")] if "run" in arguments else []
    with FULL.open("w") as full:
        done = subprocess.run([*BOEBOT, *arguments, *out], stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    assert done.stderr == "boebot: the output cannot be written: no space left on device\n"
    assert done.returncode == 1
    assert not out or (tmp_path / "out" / "run.csv").is_file()


@pytest.mark.parametrize(
    ("arguments", "printed"),
    [
        (["parameters", "list", "--on", "native"], " 0 ... 4095"),
        (["run", "prints.py", "--seconds", "0.05"], "e+-?...\n"),
    ],
)
def test_terminal_with_ascii_only_is_given_the_nearest_characters(
    arguments: list[str], printed: str, tmp_path: Path
) -> None:
    (tmp_path / "prints.py").write_text("def step(robot):\n    print('é±→…')\n", encoding="utf-8")
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "COLUMNS": "100"}
    done = subprocess.run([*BOEBOT, *arguments], capture_output=True, cwd=tmp_path, env=environment, check=True)
    assert printed.encode() in done.stdout and done.stdout.isascii()
    assert done.stderr == b""
