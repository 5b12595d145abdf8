"""Rows of the bench: how one is measured, and how they are shown in a line and as a table."""

from __future__ import annotations

import math
import os
import platform
import statistics
from dataclasses import replace
from pathlib import Path
from typing import Any

from tools.tests.bench.figures import Figure
from tools.tests.printed import markdown

COLUMNS = ("name", "value", "spread", "unit", "target", "peers and how many times as much")


def number(value: float) -> str:
    """Four significant digits at most, without an exponent."""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def chosen(values: list[float], figure: Figure) -> float:
    """The round that counts."""
    if figure.of == "median":
        return statistics.median(values)
    return max(values) if figure.better == "more" else min(values)


def row_of(figure: Figure, values: list[float], peers: list[list[float]]) -> dict[str, Any]:
    """A figure as bench.json holds it, from the rounds' values and those of each peer."""
    value = chosen(values, figure)
    beside = [(peer.name, chosen(seen, figure)) for peer, seen in zip(figure.peers, peers, strict=True)]
    bounded = value / beside[0][1] if figure.of_peer and beside and beside[0][1] else value
    return {
        "name": figure.name,
        "value": value,
        "rounds": values,
        "unit": figure.unit,
        "target": figure.target,
        "of_peer": figure.of_peer,
        "better": figure.better,
        "met": figure.is_met_by(bounded),
        "peers": [{"name": name, "value": seen, "ratio": value / seen if seen else None} for name, seen in beside],
        "error": None,
    }


def measure(figure: Figure) -> dict[str, Any]:
    """The figure and its peers in turns."""
    values: list[float] = []
    peers: list[list[float]] = [[] for _ in figure.peers]
    for _ in range(figure.rounds):
        values.append(figure.measure())
        for peer, seen in zip(figure.peers, peers, strict=True):
            seen.append(peer.measure())
    return row_of(figure, values, peers)


def failed(figure: Figure, error: Exception) -> dict[str, Any]:
    """The row of a figure that could not be measured: nothing but its error."""
    nothing = row_of(replace(figure, peers=()), [math.nan], [])
    return nothing | {"value": None, "rounds": [], "met": False, "error": f"{type(error).__name__}: {error}"}


def spread(row: dict[str, Any]) -> str:
    """From the smallest to the largest round, as a share of their median."""
    rounds = row["rounds"]
    if len(rounds) < 2 or not statistics.median(rounds):
        return "–"
    return f"{100 * (max(rounds) - min(rounds)) / statistics.median(rounds):.0f} %"


def shown(row: dict[str, Any]) -> str:
    """The value in a line of progress."""
    if row["error"]:
        return f"failed: {row['error']}"
    missed = "" if row["met"] else f", missed {target(row)}"
    return f"{number(row['value'])} {row['unit']}{missed}"


def target(row: dict[str, Any]) -> str:
    if row["target"] is None:
        return "–"
    return f"{'≥' if row['better'] == 'more' else '≤'} {'× ' if row['of_peer'] else ''}{number(row['target'])}"


def cells(row: dict[str, Any]) -> list[str]:
    """The row's text by COLUMNS."""
    peers = [
        f"{peer['name']}: {number(peer['value'])}" + (f" (× {number(peer['ratio'])})" if peer["ratio"] else "")
        for peer in row["peers"]
    ]
    value = "failed" if row["value"] is None else number(row["value"])
    return [row["name"], value, spread(row), row["unit"], target(row), "; ".join(peers) or "–"]


def load() -> float | None:
    """How many programs wanted a processor in the last minute; None where the system does not say."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def computer() -> dict[str, Any]:
    """What the figures depend on."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        processor = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        processor = platform.processor()
    return {
        "processor": processor,
        "processors": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }


def summary(result: dict[str, Any]) -> str:
    """What is to be said above the table."""
    machine = result["computer"]
    lines = [
        f"{machine['processor']}, {machine['processors']} processors, {machine['system']}, Python {machine['python']}; "
        f"load {machine['load_before']} before, {machine['load_after']} after.",
        f"Took {result['seconds'] / 60:.1f} minutes{'' if result['complete'] else '; not all figures'}.",
    ]
    missed = [row["name"] for row in result["figures"] if row["error"] is None and not row["met"]]
    errors = [f"{row['name']}: {row['error']}" for row in result["figures"] if row["error"]]
    if missed:
        lines.append(f"Missed: {'; '.join(missed)}.")
    if errors:
        lines.append(f"Failed: {'; '.join(errors)}.")
    return "\n".join(lines)


def printed(result: dict[str, Any]) -> str:
    """All of it, in Markdown, as it stands on the documentation's page."""
    rows = [cells(row) for row in result["figures"]]
    return f"{summary(result).replace(chr(10), chr(10) * 2)}\n\n{markdown(COLUMNS, rows)}"
