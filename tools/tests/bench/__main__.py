"""Measures every figure, prints one table and writes build/bench.json: `make bench`.

    python -m tools.tests.bench [--only PATTERN ...] [--page FILE] [--list]

Ctrl-C ends it with what was measured so far. The exit code is 1 when a target is missed or a measurement failed, 130
after Ctrl-C.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tools.tests.bench import report
from tools.tests.bench.figures import FIGURES, Figure
from tools.tests.printed import reprint

RESULT = Path("build/bench.json")
MODULES = (
    *(
        "codec",
        "round_trip",
        "speed",
        "record",
        "live",
        "can_bus",
        "world",
        "navigation",
        "precision",
        "timing",
        "sweeps",
    ),
    "setup_time",
)


def figures(only: list[str]) -> list[Figure]:
    """All figures, or those whose names contain one of the patterns."""
    for module in MODULES:
        importlib.import_module(f"tools.tests.bench.{module}")
    return [figure for figure in FIGURES if not only or any(part in figure.name for part in only)]


def measured(wanted: list[Figure]) -> Iterator[dict[str, Any]]:
    """Rows, one after the other, with a line of progress for each. A measurement that fails is a row with its error."""
    for number, figure in enumerate(wanted, 1):
        started = time.perf_counter()
        print(f"[{number}/{len(wanted)}] {figure.name} ...", end="", file=sys.stderr, flush=True)
        try:
            row = report.measure(figure)
        except Exception as error:  # the others are measured all the same
            row = report.failed(figure, error)
        took = time.perf_counter() - started
        print(f" {report.shown(row)} ({took:.0f} s)", file=sys.stderr)
        yield row


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tools.tests.bench", description="Measures every figure.")
    parser.add_argument("--only", action="append", default=[], metavar="PATTERN", help="figures whose names contain it")
    parser.add_argument("--page", type=Path, metavar="FILE", help="also print it onto this page of the documentation")
    parser.add_argument("--list", action="store_true", help="measure nothing, print the names of the figures")
    chosen = parser.parse_args(arguments)
    wanted = figures(chosen.only)
    if not wanted:
        parser.error(
            f"no figure's name contains {' or '.join(map(repr, chosen.only))}; without --only all are measured"
        )
    if chosen.list:
        print("\n".join(figure.name for figure in wanted))
        return 0
    started, before = time.perf_counter(), report.load()
    rows: list[dict[str, Any]] = []
    stopped = False
    try:
        for row in measured(wanted):
            rows.append(row)
    except KeyboardInterrupt:
        stopped = True
    result = {
        "computer": report.computer() | {"load_before": before, "load_after": report.load()},
        "seconds": round(time.perf_counter() - started, 1),
        "complete": not stopped and not chosen.only,
        "figures": rows,
    }
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    print(report.printed(result))
    if chosen.page is not None:
        reprint(chosen.page, report.printed(result))
    return 130 if stopped else int(any(not row["met"] for row in rows))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
