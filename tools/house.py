"""The size of the house: lines of code by room, and that no room grows.

    python -m tools.house            prints them
    python -m tools.house --check    fails where a room has more than its number in tools/rooms.toml (`make check`)
    python -m tools.house --shrink   lowers the numbers there to what the rooms have, and drops rooms that are gone

A line of code is one that is neither blank nor a comment or docstring. Tests, fuzzers and what is generated do not
count. The core is what a robot's user needs; guests are the packages beside `host/boebot`, which the core does not
know, and what only the kit's makers run.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import subprocess
import sys
import tokenize
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NUMBERS = ROOT / "tools" / "rooms.toml"
HEAD = """\
# Most lines of code of each room, as `python -m tools.house` counts them; `make check` fails where a room has more.
# After a room has shrunk: python -m tools.house --shrink. Raising one takes its reason:
#     "host/boebot/link" = { lines = 1234, why = "frames of a second line" }
"""
CODE = re.compile(r"\.(py|c|h|S|def|ino|js|html|css|sh|cdef)$")
NOT_COUNTED = re.compile(r"(^|/)tests?/|test_|conftest|/fuzz/|generated")
NO_CODE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER),
}


def sources() -> list[str]:
    """The code that counts, as paths from the root."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    return [name for name in listed if CODE.search(name) and not NOT_COUNTED.search(name) and (ROOT / name).is_file()]


def room(name: str) -> str:
    """The folder that a file is counted for: of host three levels, else two."""
    parts = name.split("/")
    return "/".join(parts[:-1][: 3 if parts[0] == "host" else 2]) or "."


def is_guest(room: str) -> bool:
    """It is no part of the core."""
    first, second, *_ = [*room.split("/"), ""]
    return first in ("tools", "hil_tests") or (first == "host" and second != "boebot")


def code_lines(name: str, text: str) -> int:
    """Lines of code of a file's text."""
    if name.endswith(".py"):
        return len(_tokens(text) - _texts(text))
    text = re.sub(r"/\*.*?\*/", lambda comment: "\n" * comment[0].count("\n"), text, flags=re.DOTALL)
    comment = "#" if name.endswith(".sh") else "//"
    lines = [line.strip() for line in text.splitlines()]
    return sum(1 for line in lines if line and not line.startswith(comment))


def _tokens(text: str) -> set[int]:
    """Lines with a token of Python's that is code."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return {line for token in tokens if token.type not in NO_CODE for line in range(token.start[0], token.end[0] + 1)}


def _texts(text: str) -> set[int]:
    """Lines of docstrings, and of other texts that stand alone."""
    alone = [
        node
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    ]
    return {line for node in alone for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)}


def rooms() -> Counter[str]:
    """Lines of code by room."""
    found: Counter[str] = Counter()
    for name in sources():
        found[room(name)] += code_lines(name, (ROOT / name).read_text(encoding="utf-8"))
    return found


def allowed() -> dict[str, tuple[int, str]]:
    """Of each room in the file of numbers: most lines, and why they were raised."""
    said = tomllib.loads(NUMBERS.read_text(encoding="utf-8"))
    return {
        name: (value["lines"], value["why"]) if isinstance(value, dict) else (value, "") for name, value in said.items()
    }


def grown(found: Counter[str], most: dict[str, tuple[int, str]]) -> list[str]:
    """Of each room that is too large a sentence that says what to do."""
    return [
        f"{name} has {lines:,} lines of code, {NUMBERS.relative_to(ROOT)} allows {most.get(name, (0, ''))[0]:,}: "
        "expected fewer; make it smaller, or raise the number there and say why"
        for name, lines in sorted(found.items())
        if lines > most.get(name, (0, ""))[0]
    ]


def shrunk(found: Counter[str], most: dict[str, tuple[int, str]]) -> str:
    """The file of numbers with those that are lower now; a reason stays as long as its number."""
    rows = []
    for name, (lines, why) in sorted(most.items()):
        if name in found:
            same = f'{{ lines = {lines}, why = "{why}" }}' if why else lines
            rows.append(f'"{name}" = {same if found[name] >= lines else found[name]}\n')
    return HEAD + "".join(rows)


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tools.house", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="print only rooms that have grown, and fail")
    parser.add_argument("--shrink", action="store_true", help="lower the numbers to what the rooms have")
    given = parser.parse_args()
    found = rooms()
    if given.shrink:
        NUMBERS.write_text(shrunk(found, allowed()), encoding="utf-8")
    if given.check:
        faults = grown(found, allowed())
        print("".join(f"{fault}\n" for fault in faults), end="")
        return 1 if faults else 0
    for name, lines in found.most_common():
        print(f"{lines:7,}  {'guest ' if is_guest(name) else '      '}{name}")
    core = sum(lines for name, lines in found.items() if not is_guest(name))
    print(f"lines of code: core {core:,}, all {found.total():,}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
