"""Figures as people read them, in tables of terminals and notebooks: "true_distance_m" is "true distance", in "m"; and
what the watchdog's resets of an emulated board amount to: where the program hung, and how often."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from boebot.boards import WatchdogReset

_UNIT = re.compile(r"_(m_s|ms|m|s|kg|us|hz|bytes|v|ppm|cycles|percent)$")
_UNITS = {"m_s": "m/s", "hz": "Hz", "v": "V", "us": "µs", "percent": "%"}


def rows(values: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Name in words, value and unit of each; what is not known (None) is left out."""
    for name, value in values.items():
        if value is not None:
            match = _UNIT.search(name)
            unit = _UNITS.get(match[1], match[1]) if match else ""
            yield _UNIT.sub("", name).replace("_", " "), text(value), unit


def counted(number: int, one: str, many: str) -> str:
    """ "1 contact", "2 contacts"."""
    return f"{number:,} {one if number == 1 else many}"


def text(value: Any) -> str:
    """A value in words: thousands apart, lists joined by commas."""
    if isinstance(value, float):
        return f"{value:,.10g}" if abs(value) >= 1000 else f"{value:.10g}"
    if isinstance(value, int) and not isinstance(value, bool):
        return f"{value:,}"
    if isinstance(value, list):
        return ", ".join(str(item) for item in value)
    return str(value)


def html_table(values: Mapping[str, Any]) -> str:
    """As a table of HTML."""
    cells = (map(html.escape, row) for row in rows(values))
    lines = (f"<tr><th>{name}</th><td>{value}</td><td>{unit}</td></tr>" for name, value, unit in cells)
    return f"<table>{''.join(lines)}</table>"


def hang_sentences(resets: Sequence[WatchdogReset]) -> list[str]:
    """For people: one for each place, by its first reset."""
    return [str(first) + ("" if count == 1 else f"; {count} times in all") for first, count in _by_place(resets)]


def hang_places(resets: Sequence[WatchdogReset]) -> str | None:
    """For a table: `0x1A72 in motion_signals (motion.c:54), 3 times`; None: it reset nothing."""
    parts = []
    for first, count in _by_place(resets):
        times = "" if count == 1 else f", {count} times"
        parts.append(f"0x{first.address:04X} {first.place}".rstrip() + times)
    return "; ".join(parts) or None


def _by_place(resets: Sequence[WatchdogReset]) -> list[tuple[WatchdogReset, int]]:
    """The first reset at each place and how many there were."""
    found: dict[str, list[WatchdogReset]] = {}
    for reset in resets:
        found.setdefault(reset.place or f"0x{reset.address:04X}", []).append(reset)
    return [(there[0], len(there)) for there in found.values()]
