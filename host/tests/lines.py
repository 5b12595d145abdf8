"""Lines for tests: pseudo-terminals whose other side is the test, and an RFC 2217 server around one."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import threading
import tty
from collections.abc import Iterator

import serial
from serial import rfc2217


class Line:
    """A pseudo-terminal: `path` is the port, the test is at the other side."""

    def __init__(self) -> None:
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)
        self._open = True

    def send(self, data: bytes) -> None:
        """To the port's reader."""
        while data:
            data = data[os.write(self.master, data) :]

    def receive(self, count: int, wait_s: float = 5.0) -> bytes:
        """What the port's writer has sent, `count` bytes."""
        data = b""
        while len(data) < count and select.select([self.master], [], [], wait_s)[0]:
            data += os.read(self.master, count - len(data))
        return data

    def unplug(self) -> None:
        """The other side goes."""
        if self._open:
            self._open = False
            os.close(self.master)
            os.close(self.slave)


@contextlib.contextmanager
def line() -> Iterator[Line]:
    """A pseudo-terminal for as long as the block lasts."""
    made = Line()
    try:
        yield made
    finally:
        made.unplug()


class WatchedSerial(serial.Serial):
    """A serial port that writes down how its DTR was switched; a pseudo-terminal has no such lines."""

    cts = dsr = ri = cd = False

    def __init__(self, path: str) -> None:
        self.dtr_was: list[bool] = []
        super().__init__(path, timeout=0.01)

    def _update_dtr_state(self) -> None:
        self.dtr_was.append(bool(self.dtr))

    def _update_rts_state(self) -> None:
        pass


class Rfc2217Server:
    """pyserial's own RFC 2217 server for one client, around a pseudo-terminal."""

    def __init__(self, path: str) -> None:
        self.serial = WatchedSerial(path)
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self._connection: socket.socket | None = None
        self._manager: rfc2217.PortManager | None = None
        self._lock = threading.Lock()
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._from_client, self._from_board)]
        for thread in self._threads:
            thread.start()

    def write(self, data: bytes) -> None:
        """To the client; the port manager's answers go the same way."""
        with self._lock:
            if self._connection is not None:
                self._connection.sendall(data)

    def hang_up(self) -> None:
        """Ends client and server."""
        with self._lock:
            connection, self._connection = self._connection, None
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()
        self._server.close()

    def _from_client(self) -> None:
        with contextlib.suppress(OSError):
            connection, _ = self._server.accept()
            self._connection = connection  # the manager asks the client at once
            self._manager = rfc2217.PortManager(self.serial, self)  # type: ignore[arg-type]
            while data := connection.recv(1024):
                self.serial.write(b"".join(self._manager.filter(data)))

    def _from_board(self) -> None:
        with contextlib.suppress(OSError, serial.SerialException, TypeError):
            while True:
                data = self.serial.read(self.serial.in_waiting or 1)
                if data and self._manager is not None:
                    self.write(b"".join(self._manager.escape(data)))


@contextlib.contextmanager
def rfc2217_server() -> Iterator[tuple[Rfc2217Server, Line]]:
    """A served pseudo-terminal for as long as the block lasts."""
    with line() as board:
        server = Rfc2217Server(board.path)
        try:
            yield server, board
        finally:
            server.hang_up()
            server.serial.close()
