"""Renews the output of commands that a page of the documentation shows.

python -m tools.shown_output docs/how-to/timing.md

A block of the language `console` has a command behind `$ ` and some lines of what it prints, "…" where others are left
out. Each line is known by its first words, up to two spaces or a digit; it is replaced by the line of today's output
that begins so. Files that the page's other blocks name in their first line (`# four.toml: ...`) are there for the
commands.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

BLOCK = re.compile(r"^```console\n\$ boebot ([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"^```\w+\n(# (\w+\.toml): .*?)^```$", re.MULTILINE | re.DOTALL)
LEFT_OUT = "…"


def renewed(text: str) -> str:
    """A page with the output of today.

    Raises:
        ValueError: a line begins like none of the output.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for match in FILE.finditer(text):
            (folder / match[2]).write_text(match[1], encoding="utf-8")
        return BLOCK.sub(lambda match: _block(match[1], match[2], folder), text)


def _block(command: str, shown: str, folder: Path) -> str:
    output = iter(printed(command, folder).splitlines())
    lines = [line if line == LEFT_OUT else _line(line, output, command) for line in shown.splitlines()]
    return "\n".join(["```console", f"$ boebot {command}", *lines, "```"])


def _line(shown: str, output: Iterator[str], command: str) -> str:
    begins = _beginning(shown)
    for line in map(str.strip, output):
        if _beginning(line) == begins:
            return line
    raise ValueError(f"`boebot {command}` prints no line that begins with {begins!r}")


def _beginning(line: str) -> str:
    return re.split(r"  |\d", line)[0].strip()


def printed(command: str, folder: Path) -> str:
    """What `boebot COMMAND` prints there, without colours."""
    environment = {**os.environ, "COLUMNS": "80", "TERM": "dumb"}
    arguments = [sys.executable, "-m", "boebot", *shlex.split(command)]
    done = subprocess.run(arguments, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
    return done.stdout


def main() -> None:
    """Renews pages in place."""
    parser = argparse.ArgumentParser(prog="python -m tools.shown_output", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("page", type=Path, nargs="+")
    for page in parser.parse_args().page:
        page.write_text(renewed(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
