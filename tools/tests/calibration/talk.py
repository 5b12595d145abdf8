"""What the calibration program says, understood: its name, the numbers of its rows, the bytes it asks for."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from boebot.errors import BoardError
from tools.tests.calibration.program import ROWS, name

START = b"?"
ASKED_BYTES = bytes(range(0x41, 0x4B))  # what it is sent when it asks
_RESULT = re.compile(rb"=([0-9A-F]{4}) ([0-9A-F]{4})")
_ASKING = re.compile(rb">([0-9])")


@dataclass
class Talk:
    """One run of the program, as it is heard line by line.

    `numbers` holds what each row sent; `lines` the numbers of bytes heard before each row's line and with it.
    """

    numbers: dict[int, int] = field(default_factory=dict)
    lines: dict[int, tuple[int, int]] = field(default_factory=dict)
    ended: bool = False
    heard_name: str = ""
    _heard: bytearray = field(default_factory=bytearray)
    _line_start: int = 0

    def hear(self, data: bytes) -> bytes:
        """Takes bytes from the program; returns those that it has asked for.

        Raises:
            BoardError: it is another program, or not the one of these rows.
        """
        self._heard += data
        answer = b""
        while (end := self._heard.find(b"\n", self._line_start)) >= 0:
            start, self._line_start = self._line_start, end + 1
            answer += self._understand(bytes(self._heard[start:end]), start, end + 1)
        return answer

    def _understand(self, line: bytes, start: int, end: int) -> bytes:
        if line.startswith(b"boebot calibration"):
            self._greeted(line.decode("ascii", "replace"))
        elif not self.heard_name:
            pass  # the end of an earlier run
        elif result := _RESULT.fullmatch(line):
            row = int(result[1], 16)
            self.numbers[row] = int(result[2], 16)
            self.lines[row] = (start, end)
        elif asking := _ASKING.fullmatch(line):
            return ASKED_BYTES[: int(asking[1])]
        elif line == b"end":
            self.ended = True
        return b""

    def _greeted(self, heard: str) -> None:
        self.heard_name = heard
        if heard != name():
            raise BoardError(f"the board runs {heard!r}, another version of the program; expected {name()!r}: flash it")

    @property
    def awaited(self) -> str:
        """What comes next, for a message that it did not come."""
        if not self.heard_name:
            return "the program's name"
        row = max(self.numbers, default=-1) + 1
        return f"row {row}, {ROWS[row].group}: {ROWS[row].what}" if row < len(ROWS) else "the end"

    def values(self) -> list[int | None]:
        """What was measured, row by row; None: not heard."""
        return [row.value(self.numbers[i]) if i in self.numbers else None for i, row in enumerate(ROWS)]


def at_pin(talk: Talk, byte_cycles: list[int], edge_cycles: list[int]) -> list[int | None]:
    """The rows as the edges at pin 13 show them; None where a row is no time or has not both edges.

    `byte_cycles`: when each byte was heard; `edge_cycles`: when pin 13 changed.
    """
    values: list[int | None] = []
    since = 0
    for i, row in enumerate(ROWS):
        value = None
        if i in talk.lines:
            start, end = talk.lines[i]
            until = byte_cycles[start]
            edges = [cycle for cycle in edge_cycles if since <= cycle < until]
            if not row.is_number and len(edges) >= -min(row.edges):
                value = row.value_at_pin(edges[row.edges[1]] - edges[row.edges[0]])
            since = byte_cycles[end - 1]
        values.append(value)
    return values
