"""In which line of a TOML text a key is: tomllib does not say it.

The text is known to be valid TOML (tomllib has read it), so that a small scan is enough: table headers, keys, and the
brackets and quotes of values.
"""

from __future__ import annotations

import re
from bisect import bisect_right

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_BARE_VALUE = re.compile(r"[^,\]}#\n]*")
_STRINGS = (
    re.compile(r'"""(?:[^\\]|\\.)*?"{3,5}', re.DOTALL),
    re.compile(r"'''.*?'{3,5}", re.DOTALL),
    re.compile(r'"(?:[^"\\\n]|\\.)*"'),
    re.compile(r"'[^'\n]*'"),
)


def line_of(text: str, place: str) -> tuple[int, bool]:
    """The line, from 1, of a place such as "a.b[2].c", the key c in the third table of the array a.b.

    Where the text does not have it: the line of the innermost table or array around it, and False.
    """
    scan = _Scan(text, place)
    scan.run()
    around = place
    while around not in scan.lines:
        around = around[: max(around.rfind("."), around.rfind("["), 0)]
    return scan.lines[around], around == place


class _Scan:
    """Keeps the lines of a place and of all around it; "" is line 1."""

    def __init__(self, text: str, wanted: str) -> None:
        self._wanted = wanted
        self.text = text.replace("\r\n", "\n") + "\n"
        self.at = 0
        self.lines: dict[str, int] = {"": 1}
        self._breaks = [match.start() for match in re.finditer("\n", self.text)]
        self._arrays: dict[str, int] = {}  # number of the last table of each array of tables

    def run(self) -> None:
        """Goes through the text's statements."""
        table = ""
        self._skip(_BLANK)
        while self.at < len(self.text):
            start = self.at
            if self.text.startswith("[[", start):
                self.at += 2
                *parents, name = self._key()
                array = _join(self._resolved(parents), name)
                self._arrays[array] = self._arrays.get(array, -1) + 1
                table = f"{array}[{self._arrays[array]}]"
                self._note(array, start)
                self._note(table, start)
                self.at += 2
            elif self.text[start] == "[":
                self.at += 1
                table = self._resolved(self._key())
                self._note(table, start)
                self.at += 1
            else:
                self._statement(table)
            self._skip(_BLANK)

    def _statement(self, table: str) -> None:
        """A key, an equals sign and a value."""
        start = self.at
        place = table
        for name in self._key():
            place = _join(place, name)
            self._note(place, start)
        self.at += 1
        self._skip(_SPACE)
        self._value(place)

    def _value(self, place: str) -> None:
        self._note(place, self.at)
        opening = self.text[self.at]
        if opening in "\"'":
            self._string()
        elif opening == "[":
            self.at += 1
            self._skip(_BLANK)
            count = 0
            while self.text[self.at] != "]":
                self._value(f"{place}[{count}]")
                count += 1
                self._next_item()
            self.at += 1
        elif opening == "{":
            self.at += 1
            self._skip(_BLANK)
            while self.text[self.at] != "}":
                self._statement(place)
                self._next_item()
            self.at += 1
        else:
            self._skip(_BARE_VALUE)

    def _next_item(self) -> None:
        self._skip(_BLANK)
        if self.text[self.at] == ",":
            self.at += 1
            self._skip(_BLANK)

    def _key(self) -> list[str]:
        """The parts of a dotted key; stops at what follows it."""
        parts = []
        while True:
            self._skip(_SPACE)
            if self.text[self.at] in "\"'":
                parts.append(self._string()[1:-1])
            elif match := _BARE_KEY.match(self.text, self.at):
                parts.append(match[0])
                self.at = match.end()
            self._skip(_SPACE)
            if self.text[self.at] != ".":
                return parts
            self.at += 1

    def _string(self) -> str:
        match = next(match for pattern in _STRINGS if (match := pattern.match(self.text, self.at)))
        self.at = match.end()
        return match[0]

    def _resolved(self, names: list[str]) -> str:
        """A header's place: below an array of tables it means the last table."""
        place = ""
        for name in names:
            place = _join(place, name)
            self._note(place, self.at)
            if place in self._arrays:
                place = f"{place}[{self._arrays[place]}]"
        return place

    def _note(self, place: str, at: int) -> None:
        if self._wanted.startswith(place):
            self.lines.setdefault(place, bisect_right(self._breaks, at - 1) + 1)

    def _skip(self, pattern: re.Pattern[str]) -> None:
        if match := pattern.match(self.text, self.at):
            self.at = match.end()


def _join(place: str, name: str) -> str:
    return f"{place}.{name}" if place else name
