"""TOML texts with long rows of points, read many times faster than tomllib reads them: arenas of 100,000 edges.

Arrays of pairs of plain numbers mean the same in TOML and in JSON. They are cut out, a float that occurs nowhere else
takes their place, and tomllib reads the rest. Whatever does not go smoothly is read by tomllib alone, so that errors
are its own.
"""

from __future__ import annotations

import json
import re
import tomllib
from typing import Any

_NUMBER = r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?"
_SPACE = r"[ \t\n]*+"  # possessive: what does not match ends in a time that grows with the text, not with its square
_PAIR = rf"\[{_SPACE}{_NUMBER}{_SPACE},{_SPACE}{_NUMBER}{_SPACE}\]"
# Strings and comments; one without an end goes up to the end of the text or line.
_PASSED_OVER = (
    r'"""(?:[^"\\]++|\\.|"(?!""))*"{0,5}' + r"|'''(?:[^']++|'(?!''))*'{0,5}"
    r'|"(?:[^"\\\n]++|\\.)*"?' + r"|'[^'\n]*'?|#[^\n]*"
)
_PAIRS = re.compile(
    rf"(?:{_PASSED_OVER})|(?P<key>=[ \t]*)(?P<rows>\[{_SPACE}{_PAIR}(?:{_SPACE},{_SPACE}{_PAIR})*)"
    rf"{_SPACE},?{_SPACE}\]",
    re.DOTALL,
)


def loads(text: str) -> dict[str, Any]:
    """What tomllib.loads gives. Raises what that raises."""
    mark = max(re.findall(r"0\.5e-319*", text), key=len, default="0.5e-31") + "9"
    rows: dict[str, list[Any]] = {}

    def cut(match: re.Match[str]) -> str:
        if match["rows"] is None:
            return match[0]
        place = f"{mark}{len(rows):07}"
        rows[place] = json.loads(match["rows"] + "]")
        return match["key"] + place

    try:
        rest = _PAIRS.sub(cut, text)
        table = tomllib.loads(rest, parse_float=lambda number: _Place(number) if number in rows else float(number))
    except (ValueError, RecursionError):
        return tomllib.loads(text)
    _put_back(table, rows)
    return table


class _Place(str):
    """Of rows that were cut out."""


def _put_back(value: dict[str, Any] | list[Any], rows: dict[str, list[Any]]) -> None:
    for key, entry in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(entry, _Place):
            value[key] = rows[entry]  # type: ignore[index]
        elif isinstance(entry, (dict, list)):
            _put_back(entry, rows)
