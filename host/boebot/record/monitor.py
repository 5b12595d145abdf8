"""The serial monitor of a program: what it prints, line by line with its time, and what to look for in it.

Bytes become text as UTF-8; what is none is shown as escapes such as \\xff. A line ends with \\n; a \\r before it
belongs to the end. A line that has no end yet is shown once the program has printed nothing for a while, so that a
prompt is seen.
"""

from __future__ import annotations

from collections.abc import Callable

PATIENCE_S = 0.5  # of board time; then a line without an end is shown
LINE_MAXIMUM = 1000  # bytes; a longer line is shown in pieces


class Monitor:
    """Of one program.

    Attributes:
        found: the text that was looked for has come.
        failed: so has the one that must not come.
    """

    def __init__(self, show: Callable[[float, str], None], expected: str = "", unwanted: str = "") -> None:
        """
        Args:
            show: gets the time (s) of each line's first byte, and the line.
            expected, unwanted: texts to look for, which may lie across ends of lines; "": none.
        """
        self.found = self.failed = False
        self._show = show
        self._expected, self._unwanted = expected.encode(), unwanted.encode()
        self._newest = b""  # as much as is needed to find a text that has come in pieces
        self._line = bytearray()
        self._begin_s = self._heard_s = 0.0

    def hear(self, time_s: float, data: bytes) -> None:
        """Bytes have come at that time."""
        for number in data:
            if len(self._line) >= LINE_MAXIMUM and number != ord("\n"):
                self.flush()
            if not self._line:
                self._begin_s = time_s
            if number == ord("\n"):
                self.flush()
            else:
                self._line.append(number)
        self._heard_s = time_s
        self._look(data)

    def _look(self, data: bytes) -> None:
        if self.found or self.failed:
            return  # what came first counts
        text = self._newest + data
        self.found = self.found or (bool(self._expected) and self._expected in text)
        self.failed = self.failed or (bool(self._unwanted) and self._unwanted in text)
        keep = max(len(self._expected), len(self._unwanted))
        self._newest = text[-keep:] if keep else b""

    def wait(self, time_s: float) -> None:
        """It is that late now."""
        if self._line and time_s - self._heard_s >= PATIENCE_S:
            self.flush()

    def flush(self) -> None:
        """Shows what waits, an empty line too."""
        text = self._line.decode("utf-8", "backslashreplace").removesuffix("\r")
        self._line.clear()
        self._show(self._begin_s, text)

    def close(self) -> None:
        """Nothing comes any more."""
        if self._line:
            self.flush()
