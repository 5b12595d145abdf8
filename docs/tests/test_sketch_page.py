"""docs/how-to/your-own-sketch.md: its line for CI passes the sketch that is mended and fails the blind one, and so does
its test in Python; avr-gdb answers as the page says. What its other commands print: test_shown_output.py."""

from __future__ import annotations

import re
import shlex
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import copied_process
from tools import shown_output

pytestmark = pytest.mark.soak  # builds two sketches and drives them for minutes

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "how-to" / "your-own-sketch.md").read_text(encoding="utf-8")


@pytest.fixture(params=["blind", "mended"])
def sketch(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[bool, Path]:
    """Whether it is mended, and the folder with the sketch as the page has changed it by then."""
    is_mended = request.param == "mended"

    def made(command: str, folder: Path) -> str:
        return copied_process.command(shlex.split(command), folder).stdout if command.startswith("new ") else shown

    text = PAGE if is_mended else PAGE[: PAGE.index("## Mend it")]
    shown = text
    monkeypatch.setattr(shown_output, "printed", made)
    shown_output.renewed(text, tmp_path / "page")
    return is_mended, tmp_path / "page"


def test_the_line_for_ci_finds_the_bug(sketch: tuple[bool, Path]) -> None:
    is_mended, folder = sketch
    (workflow,) = (code for code in PAGE.split("```yaml\n")[1:2])
    steps = yaml.safe_load(workflow.partition("```")[0])["jobs"]["drive"]["steps"]
    command, *words = shlex.split(steps[-1]["run"])
    assert command == "boebot"
    done = copied_process.command(words, folder)
    assert done.returncode == (0 if is_mended else 42), done.stderr


def test_the_test_in_python_finds_it_too(sketch: tuple[bool, Path]) -> None:
    is_mended, folder = sketch
    code = PAGE.split("```python\n")[1].partition("```")[0]
    done = copied_process.python(f"{code}\ntest_it_touches_nothing()\n", folder)
    assert (done.returncode == 0) == is_mended and (is_mended or "AssertionError" in done.stderr)


@pytest.mark.parametrize("sketch", ["blind"], indirect=True)
def test_the_debugger_answers_as_the_page_says(sketch: tuple[bool, Path]) -> None:
    command, session = (PAGE.split("```text\n")[number].partition("```")[0].splitlines() for number in (1, 2))
    run = [sys.executable, "-m", "boebot", *shlex.split(command[0])[2:-1], str(port := free_port())]
    with subprocess.Popen(run, cwd=sketch[1], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as board:
        assert board.stderr is not None
        (how,) = re.findall(r"waits for a debugger: (avr-gdb .*)$", board.stderr.readline())
        assert str(port) in how
        asked = [word for line in session if line.startswith("(gdb) ") for word in ("-ex", line.removeprefix("(gdb) "))]
        gdb = [*shlex.split(how), "-batch", "-nx", *asked, "-ex", "kill"]
        done = subprocess.run(gdb, capture_output=True, text=True, timeout=100, check=False)
        board.communicate(timeout=100)
    shown = [line for line in session if not line.startswith("(gdb) ")]
    said = [re.sub(r" at /\S*/", " at ", line) for line in done.stdout.splitlines()]
    assert [line for line in said if line.startswith(("$", "#0", "#1"))] == shown, done.stdout + done.stderr


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        number: int = server.getsockname()[1]
    return number
