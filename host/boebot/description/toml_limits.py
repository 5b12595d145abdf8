"""What a TOML description may hold at most, so that a hostile file ends in one sentence and in bounded time.

Parts of a dotted key are counted before tomllib reads the text: its time grows with their square.
"""

from __future__ import annotations

import re
from typing import Any

SIZE_MAXIMUM = 8_000_000  # bytes of a file
DEPTH_MAXIMUM = 16  # tables and arrays inside one another, and parts of a dotted key
KEY_MAXIMUM = 100  # characters of a key, or of one part of a dotted key
TEXT_MAXIMUM = 1000  # characters of a text

_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\]++|\\.)*"?|'[^']*'?)"""
_KEY = re.compile(rf"#.*|{_PART}(?:[ \t]*+\.[ \t]*+{_PART})*")


def fault_of_text(text: str) -> str:
    """The error in a text that has not been read, one too long or too deep, with its line first; "": none."""
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") < DEPTH_MAXIMUM:
            continue
        for key in _KEY.finditer(line):
            if key[0].startswith("#"):
                break
            if key[0].count(".") >= DEPTH_MAXIMUM and (parts := len(re.findall(_PART, key[0]))) > DEPTH_MAXIMUM:
                return f":{number}: a key has {parts:,} parts; expected at most {DEPTH_MAXIMUM}"
    return ""


def fault_of_table(table: dict[str, Any]) -> str:
    """The error in a table that is too long or too deep; "": none."""
    level: list[Any] = [table]
    for _ in range(DEPTH_MAXIMUM):
        below: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                if (longest := max(map(len, value), default=0)) > KEY_MAXIMUM:
                    return f": a key has {longest:,} characters; expected at most {KEY_MAXIMUM}"
                value = value.values()
            below += [entry for entry in value if isinstance(entry, (dict, list, str))]
        if (longest := max((len(entry) for entry in below if isinstance(entry, str)), default=0)) > TEXT_MAXIMUM:
            return f": a text has {longest:,} characters; expected at most {TEXT_MAXIMUM:,}"
        level = [entry for entry in below if not isinstance(entry, str)]
        if not level:
            return ""
    return f" is nested too deeply; expected at most {DEPTH_MAXIMUM} tables and arrays inside one another"
