"""Measures every figure, prints one table and writes build/bench.json: `make bench`.

    python -m tools.bench [PART OF A NAME ...]

With arguments, only the figures whose names contain one of them. The exit code is 1 when a target is missed.
"""

from __future__ import annotations

import importlib
import json
import platform
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from tools.bench.figures import FIGURES, Figure

RESULT = Path("build/bench.json")
MODULES = ("codec", "board_link", "busy", "clock", "speed", "world", "precision", "setup_time")


def number(value: float) -> str:
    """Four significant digits at most, without an exponent."""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def row(figure: Figure, value: float) -> dict[str, Any]:
    """A figure as bench.json holds it."""
    peer_value = figure.peer.measure() if figure.peer else None
    return {
        "name": figure.name,
        "value": value,
        "unit": figure.unit,
        "target": figure.target,
        "better": figure.better,
        "met": figure.is_met_by(value),
        "peer": figure.peer.name if figure.peer else None,
        "peer_value": peer_value,
        "ratio": value / peer_value if peer_value else None,
    }


def table(rows: list[dict[str, Any]]) -> Table:
    """The rows as people read them."""
    shown = Table("name", "value", "unit", "target", "peer", "ratio", title="boebot bench")
    for entry in rows:
        bound = "≥" if entry["better"] == "more" else "≤"
        style = "" if entry["met"] else "bold red"
        peer = f"{entry['peer']}: {number(entry['peer_value'])}" if entry["peer"] else "–"
        ratio = f"{entry['ratio']:.2f}" if entry["ratio"] is not None else "–"
        shown.add_row(
            entry["name"],
            f"[{style}]{number(entry['value'])}[/]" if style else number(entry["value"]),
            entry["unit"],
            f"{bound} {number(entry['target'])}",
            peer,
            ratio,
        )
    return shown


def main(wanted: list[str]) -> int:
    for module in MODULES:
        importlib.import_module(f"tools.bench.{module}")
    console = Console(width=None if sys.stdout.isatty() else 150)
    rows = []
    for figure in FIGURES:
        if wanted and not any(part in figure.name for part in wanted):
            continue
        with console.status(figure.name):
            rows.append(row(figure, figure.measure()))
    console.print(table(rows))
    RESULT.parent.mkdir(exist_ok=True)
    computer = {"system": platform.platform(), "python": platform.python_version()}
    text = json.dumps({"computer": computer, "figures": rows}, indent=2)
    RESULT.write_text(text + "\n", encoding="utf-8")
    missed = [entry["name"] for entry in rows if not entry["met"]]
    if missed:
        console.print(f"missed: {'; '.join(missed)}")
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
