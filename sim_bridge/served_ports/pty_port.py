"""A pseudo-terminal: to programs a serial port of this computer. On POSIX systems only."""

from __future__ import annotations

import contextlib
import os
import select
import sys

from boebot.boards import Visit
from boebot.errors import BoardError
from boebot.link.ports import holder_of
from sim_bridge.served_ports.port import BACKLOG

CHUNK = 4096
TCGETS2 = 0x802C542A
TERMIOS2_SIZE = 44  # Linux: the settings of a terminal with its bit rates as numbers, the last one that of the output


def _rates() -> dict[int, int]:
    """Bit rates by the numbers that this system's terminals have for them."""
    import termios

    return {getattr(termios, name): int(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdigit()}


class PtyPort:
    """The master side of a pseudo-terminal. The other side hangs up when its last client closes it."""

    def __init__(self, baud: int) -> None:
        """`baud`: the bit rate until a client sets another. Raises BoardError where there are no pseudo-terminals."""
        try:
            import termios
            import tty
        except ImportError:
            raise BoardError("this system has no pseudo-terminals; use --tcp PORT") from None
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._rates = _rates()
        settings = termios.tcgetattr(slave)
        settings[4] = settings[5] = next((code for code, rate in self._rates.items() if rate == baud), termios.B38400)
        termios.tcsetattr(slave, termios.TCSANOW, settings)
        self.url = os.ttyname(slave)
        os.close(slave)  # from now on the master hears a hang-up while nobody has the other side open
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)
        self._client: str | None = None
        self._received = b""
        self._to_client = b""

    def _events(self, milliseconds: float) -> int:
        events = self._poll.poll(milliseconds)
        return events[0][1] if events else 0

    def wait(self, seconds: float) -> None:
        """Sleeps until bytes come; a hang-up or a full backlog, which last, wake nobody."""
        if self._events(0) & select.POLLHUP or len(self._received) >= BACKLOG:
            select.select([], [], [], seconds)
        else:
            self._events(seconds * 1000)

    def look(self) -> list[Visit]:
        """See `Port`."""
        is_open = not self._events(0) & select.POLLHUP
        if is_open and self._client is None:
            while self._read():  # of the client before
                pass
            self._received = b""
            self._client = holder_of(self.url) or "a program"
            return [Visit("came", self._client)]
        while len(self._received) < BACKLOG and (data := self._read()):
            self._received += data
        if is_open or self._client is None:
            return []
        gone, self._client, self._to_client = self._client, None, b""
        return [Visit("went", gone)]

    def _read(self) -> bytes:
        try:
            return os.read(self._master, CHUNK)
        except OSError:  # nothing there, or nobody
            return b""

    def take(self, count: int) -> bytes:
        """See `Port`."""
        data, self._received = self._received[:count], self._received[count:]
        return data

    def write(self, data: bytes) -> None:
        """See `Port`."""
        if self._client is None:
            return
        self._to_client = (self._to_client + data)[-BACKLOG:]
        with contextlib.suppress(OSError):
            while self._to_client:
                self._to_client = self._to_client[os.write(self._master, self._to_client) :]

    def baud(self) -> int | None:
        """The bit rate that the terminal is set to; None where it is not known."""
        import fcntl
        import termios

        code = termios.tcgetattr(self._master)[5]
        if code in self._rates:
            return self._rates[code] or None  # B0 hangs up and is no rate
        try:
            settings = fcntl.ioctl(self._master, TCGETS2, bytes(TERMIOS2_SIZE))
        except OSError:
            return None
        return int.from_bytes(settings[-4:], sys.byteorder)

    def close(self) -> None:
        """Ends the pseudo-terminal."""
        os.close(self._master)
