"""What each folder's tests took: `python -m tools.times_table TIMES [UNITS_LOG]`, at the end of `make test`.

TIMES has a line per call of pytest and folder (conftest.py): folder, tests, seconds. UNITS_LOG is what PlatformIO said
of the firmware's units. Folders run beside each other, so the sum is more than the time that passes.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

UNITS = re.compile(r"(\d+) test cases: .* in (\d+):(\d+):(\d+(?:\.\d+)?)")  # PlatformIO's last line
ROW = "{:<24}{:>8}{:>10}"


def rows(times: str, units: str = "") -> list[tuple[str, int, float]]:
    """Folder, tests, seconds, in the order in which folders first ran; several calls of pytest are added up."""
    found: dict[str, tuple[int, float]] = {}
    for line in times.splitlines():
        folder, tests, seconds = line.split("\t")
        before = found.get(folder, (0, 0.0))
        found[folder] = before[0] + int(tests), before[1] + float(seconds)
    if match := UNITS.search(units):
        hours, minutes, rest = (float(part) for part in match.groups()[1:])
        found["firmware units"] = int(match[1]), 3600 * hours + 60 * minutes + rest
    return [(folder, *spent) for folder, spent in found.items()]


def table(spent: list[tuple[str, int, float]]) -> str:
    """As text, with the sum."""
    total = ("all", sum(tests for _, tests, _ in spent), sum(seconds for *_, seconds in spent))
    lines = [ROW.format(folder, tests, f"{seconds:.1f}") for folder, tests, seconds in [*spent, total]]
    return "\n".join([ROW.format("folder", "tests", "seconds"), *lines])


def main() -> None:
    """Prints the table of the files that are there."""
    texts = [path.read_text(encoding="utf-8") if path.exists() else "" for path in map(Path, sys.argv[1:])]
    if spent := rows(*texts):
        print(table(spent))


if __name__ == "__main__":
    main()
