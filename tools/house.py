"""Hand-written lines of the product by room: python -m tools.house

Tests, docs and generated files are left out; blank lines and comments count.
"""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from pathlib import Path

from avr_timing.closed_pipe import exit_as

ROOT = Path(__file__).resolve().parents[1]
CODE = re.compile(r"\.(py|c|h|def|cdef|sh|js|html|cpp|pyi|css)$")
TESTS = re.compile(r"(^|/)tests?/|(^|/)(test_\w+|conftest)\.py$|^hil_tests/(?!calibration)|vectors")
GENERATED = re.compile(r"generated/|host/boebot/link/messages\.py$|attributes\.pyi$|^docs/")
ROOMS = ("firmware", "protocol", "host", "sim_bridge", "hil_tests", "tools")


def main() -> int:
    """Prints a line for each room."""
    found: Counter[str] = Counter()
    for name in sources():
        found[room(name)] += len((ROOT / name).read_text(encoding="utf-8").splitlines())
    for folder, lines in sorted(found.items()):
        print(f"{lines:8,} {folder}")
    print(f"{found.total():8,} all")
    return 0


def sources() -> list[str]:
    """Hand-written code of the product, as paths from the root: no tests, docs and what is generated."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    files = [name for name in listed if CODE.search(name) and (ROOT / name).is_file()]
    return [name for name in files if not TESTS.search(name) and not GENERATED.search(name)]


def room(name: str) -> str:
    """The folder that a file is counted for: packages of host and sim_bridge, and where they lie loose."""
    first, *rest = name.split("/")
    if first not in ROOMS:
        return "other"
    if first in ("host", "sim_bridge", "firmware"):
        depth = 3 if first == "host" else 2
        return "/".join([first, *rest[:-1]][:depth])
    return first


if __name__ == "__main__":
    exit_as(main)
