"""Renews the output of commands that a page of the documentation shows.

python -m tools.shown_output docs/how-to/timing.md

A block of the language `console` has a command behind `$ `, boebot or pytest, and some lines of what it prints, "…"
where others are left out. Each line is known by its first words, up to two spaces or a digit, and one that begins with
a number by all that is no digit; it is replaced by the line of today's output that is like it, but for what tests took.
A block of the language `diff` changes the file that its first line names (`--- blink/blink.ino`). Files that the page's
other blocks name in their first line (`# four.toml: ...`, `// arm/arm.ino: ...`) are there for the commands.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

BLOCK = re.compile(r"^```(?:console\n\$ (boebot|pytest)|diff\n---) ?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"^```\w+\n((?:#|//) ([\w./]+\.\w+): .*?)^```$", re.MULTILINE | re.DOTALL)
LEFT_OUT = "…"
TOOK = re.compile(r" in \d+\.\d+s\b")  # of tests, by the wall clock
PYTEST = ["-c", os.devnull, "--rootdir=.", "-p", "no:cacheprovider", "-p", "no:randomly"]  # as in a folder of a reader
FOLDER = Path(__file__).resolve().parents[1] / "build" / "shown"  # of one place: what was built there is found again


def renewed(text: str, folder: Path) -> str:
    """A page with the output of today, of commands in that folder, which is emptied before.

    Raises:
        ValueError: a line begins like none of the output; a file does not have what is to be changed.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for match in FILE.finditer(text):
        (folder / match[2]).parent.mkdir(parents=True, exist_ok=True)
        (folder / match[2]).write_text(match[1], encoding="utf-8")
    return BLOCK.sub(lambda match: _block(match, folder) if match[1] else _changed(match, folder), text)


def _changed(match: re.Match[str], folder: Path) -> str:
    """The block that changes a file."""
    old, new = ("".join(f"{line[1:]}\n" for line in match[3].splitlines() if line[0] in kept) for kept in ("- ", "+ "))
    before = (folder / match[2]).read_text(encoding="utf-8")
    if before.count(old) != 1:
        raise ValueError(f"{match[2]} does not have once what is to be changed:\n{old}")
    (folder / match[2]).write_text(before.replace(old, new), encoding="utf-8")
    return match[0]


def _block(match: re.Match[str], folder: Path) -> str:
    """The block with what its command prints today."""
    program, arguments, shown = match.groups()
    command = f"{program} {arguments}".strip()
    output = iter((printed if program == "boebot" else tested)(arguments, folder).splitlines())
    lines = [line if line == LEFT_OUT else _line(line, output, command) for line in shown.splitlines()]
    return "\n".join(["```console", f"$ {command}", *lines, "```"])


def _line(shown: str, output: Iterator[str], command: str) -> str:
    begins = _beginning(shown)
    for line in map(str.strip, output):
        if _beginning(line) == begins:
            return TOOK.sub(took[0], line) if (took := TOOK.search(shown)) else line
    raise ValueError(f"`{command}` prints no line that begins with {begins!r}")


def _beginning(line: str) -> str:
    return re.split(r"  |\d", line.strip())[0].strip() or re.sub(r"\d+", "0", line.strip())


def printed(arguments: str, folder: Path) -> str:
    """What `boebot ARGUMENTS` prints there, without colours."""
    return _run(["boebot", *shlex.split(arguments)], folder)


def tested(arguments: str, folder: Path) -> str:
    """What `pytest ARGUMENTS` prints there."""
    return _run(["pytest", *PYTEST, *shlex.split(arguments)], folder)


def _run(module: list[str], folder: Path) -> str:
    environment = {"BOEBOT_CACHE": str(FOLDER.parent / "cache"), **os.environ, "COLUMNS": "80", "TERM": "dumb"}
    arguments = [sys.executable, "-m", *module]
    done = subprocess.run(arguments, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
    return done.stdout


def main() -> None:
    """Renews pages in place."""
    parser = argparse.ArgumentParser(prog="python -m tools.shown_output", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("page", type=Path, nargs="+")
    for page in parser.parse_args().page:
        page.write_text(renewed(page.read_text(encoding="utf-8"), FOLDER / page.stem), encoding="utf-8")


if __name__ == "__main__":
    main()
