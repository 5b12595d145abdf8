"""Ways for bytes to reach a board and come back: serial ports (and ptys, which look like them) and TCP
sockets.

An in-process board brings a transport of its own with the same interface. A transport knows no frames.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import time
from typing import Protocol

import serial

from boebot.errors import BoardError

_POSIX = os.name == "posix"
_POLL_S = 0.001  # where the port cannot be waited for (Windows)


class Transport(Protocol):
    """Bytes to and from one board, and the clock that they are stamped with."""

    @property
    def name(self) -> str:
        """How people call it, such as "/dev/ttyACM0"."""

    @property
    def realtime(self) -> bool:
        """False: time advances only while `read` waits (a board in this process)."""

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """Everything that arrived.

        Lets `quiet_s` pass without looking, then returns as soon as something has arrived and the line has
        gone idle, at the latest after `wait_s`; both in seconds of the transport's clock, `wait_s` the whole.
        A live transport may return earlier, with what there is.

        Raises:
            BoardError: the board has gone.
        """

    def write(self, data: bytes) -> None:
        """Sends bytes.

        Raises:
            BoardError: the board has gone.
        """

    def now(self) -> float:
        """The transport's clock (s)."""

    def close(self) -> None:
        """Gives the port back. May be called twice."""


class SerialTransport:
    """A serial port, opened for this process alone."""

    realtime = True

    def __init__(self, port: str, baud: int = 500_000) -> None:
        """Opens `port`.

        Raises:
            BoardError: missing, busy or forbidden.
        """
        self.name = port
        try:
            self._port = serial.Serial(port, baud, timeout=0, write_timeout=1.0, exclusive=True if _POSIX else None)
        except (OSError, ValueError) as error:  # pyserial's SerialException is an OSError
            raise BoardError(_why_not(port, baud, error)) from None

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What arrived, as soon as there is something, at the latest after `wait_s`."""
        del quiet_s  # bytes wait in the operating system's buffer anyway
        try:
            if not _POSIX:
                return self._poll(wait_s)
            file = self._port.fileno()
            ready, _, _ = select.select([file], [], [], wait_s)
            if not ready:
                return b""
            data = os.read(file, 65536)
        except (OSError, TypeError, ValueError):  # pyserial on a closed port: no file descriptor any more
            data = b""
        if not data:  # readable at its end: the other side is gone
            raise BoardError(f"{self.name} has gone: unplugged, or closed by the other side")
        return data

    def _poll(self, wait_s: float) -> bytes:
        end = time.monotonic() + wait_s
        while True:
            waiting: int = self._port.in_waiting
            if waiting:
                return bytes(self._port.read(waiting))
            if time.monotonic() >= end:
                return b""
            time.sleep(_POLL_S)

    def write(self, data: bytes) -> None:
        """Sends bytes."""
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            raise BoardError(f"{self.name} takes no bytes: its other side does not read") from None
        except (OSError, TypeError, ValueError):
            raise BoardError(f"{self.name} has gone: unplugged, or closed by the other side") from None

    def now(self) -> float:
        """The monotonic clock (s)."""
        return time.monotonic()

    def close(self) -> None:
        """Closes the port."""
        with contextlib.suppress(OSError):
            self._port.close()


class SocketTransport:
    """A TCP connection that carries a board's bytes."""

    realtime = True

    def __init__(self, host: str, port: int, timeout_s: float = 2.0) -> None:
        """Connects.

        Raises:
            BoardError: nobody listens there.
        """
        self.name = f"socket://{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            reason = "nobody listens there" if isinstance(error, ConnectionRefusedError) else _reason(error)
            raise BoardError(f"{self.name} cannot be opened: {reason}") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What arrived, as soon as there is something, at the latest after `wait_s`."""
        del quiet_s
        try:
            ready, _, _ = select.select([self._socket], [], [], wait_s)
            if not ready:
                return b""
            data = self._socket.recv(65536)
        except (OSError, ValueError):
            data = b""
        if not data:
            raise BoardError(f"{self.name} has gone: closed by the other side")
        return data

    def write(self, data: bytes) -> None:
        """Sends bytes."""
        try:
            self._socket.sendall(data)
        except OSError:
            raise BoardError(f"{self.name} has gone: closed by the other side") from None

    def now(self) -> float:
        """The monotonic clock (s)."""
        return time.monotonic()

    def close(self) -> None:
        """Closes the connection."""
        self._socket.close()


def _why_not(port: str, baud: int, error: Exception) -> str:
    """One sentence about a port that could not be opened."""
    number = getattr(error, "errno", None)
    text = str(error).lower()
    if number == errno.ENOENT or "filenotfound" in text or "no such file" in text:
        return f"there is no port {port}"
    if number == errno.EACCES or "permission" in text:
        return f"{port} may not be opened by this user: permission denied (on Linux, join the group of {port})"
    if number in (errno.EBUSY, errno.EAGAIN) or "lock" in text or "busy" in text:
        return f"{port} is busy: another program has it open"
    if "baud" in text:
        return f"{port} does not run at {baud} baud"
    if number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR, errno.ENXIO) or "configure" in text:
        return f"{port} is no serial port"
    return f"{port} cannot be opened: {_reason(error)}"


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
