"""A TCP port of loopback for one client at a time. Who comes while one is there is refused with a sentence, and so is
who speaks HTTP: any page in a browser may ask for a port of this computer."""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket

from boebot.boards import Visit
from boebot.errors import BoardError
from sim_bridge.served_ports.port import BACKLOG

HTTP_METHODS = (b"GET ", b"POST ", b"HEAD ", b"OPTIONS ", b"PUT ", b"PATCH ", b"DELETE ", b"CONNECT ", b"TRACE ")
NO_PAGE = "this port is a robot's serial line, no web page"
HTTP_ANSWER = f"HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\n{NO_PAGE}\r\n"


def _reason(error: OSError | OverflowError) -> str:
    """Why a port cannot be opened; Python's own text of it would name the call's arguments."""
    if isinstance(error, OverflowError) or error.errno is None:
        return "expected 0 to 65535"
    return "it is in use" if error.errno == errno.EADDRINUSE else os.strerror(error.errno)


class TcpPort:
    """A listening socket and at most one client.

    A client that has closed its end while more of its bytes wait than are received cannot be told from one that sends
    too much; either of them gives way to the next client.
    """

    def __init__(self, port: int) -> None:
        """Raises BoardError where the port is taken."""
        try:
            self._listener = socket.create_server(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            reason = _reason(error)
            raise BoardError(f"TCP port {port} cannot be opened: {reason}") from None
        self._listener.setblocking(False)
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self._client: socket.socket | None = None
        self._name = ""
        self._is_checked = False  # that it speaks no HTTP
        self._received = b""
        self._to_client = b""
        self._visits: list[Visit] = []

    def wait(self, seconds: float) -> None:
        """Sleeps until a client or bytes come; a full backlog wakes nobody."""
        sockets = [self._listener]
        if self._client is not None and len(self._received) < BACKLOG:
            sockets.append(self._client)
        select.select(sockets, [], [], seconds)

    def look(self) -> list[Visit]:
        """See `Port`."""
        self._receive()
        with contextlib.suppress(OSError):  # nobody else waits
            while True:
                self._admit(*self._listener.accept())
        visits, self._visits = self._visits, []
        return visits

    def _admit(self, newcomer: socket.socket, address: tuple[str, int]) -> None:
        name = f"{address[0]}:{address[1]}"
        newcomer.setblocking(False)
        self._receive()  # perhaps the other one has just gone
        if self._client is not None and len(self._received) < BACKLOG:
            _send_away(newcomer, f"boebot serve: refused, {self._name} is connected to this robot\r\n")
            self._visits.append(Visit("refused", name, f"{self._name} is connected"))
            return
        self._drop("it sends more than the line carries")
        newcomer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client, self._name, self._is_checked = newcomer, name, False
        self._received = b""
        self._visits.append(Visit("came", name))

    def _receive(self) -> None:
        """What the client sent, as long as there is room for it."""
        while self._client is not None and (room := BACKLOG - len(self._received)) > 0:
            try:
                data = self._client.recv(room)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            if not data:
                self._drop()
                return
            self._received += data
        if self._client is not None and not self._is_checked:
            self._check()

    def _check(self) -> None:
        """Sends a client away that begins as HTTP does; what it sent never reaches the board."""
        begin = self._received
        if begin.startswith(HTTP_METHODS):
            _send_away(self._client, HTTP_ANSWER)
            self._received = b""
            self._client = None
            self._visits.append(Visit("refused", self._name, "it speaks HTTP, as browsers do"))
        self._is_checked = not any(method.startswith(begin) for method in HTTP_METHODS)

    def _drop(self, why: str = "") -> None:
        client, self._client, self._to_client = self._client, None, b""
        if client is not None:
            client.close()
            self._visits.append(Visit("went", self._name, why))
            if not self._is_checked:
                self._received = b""

    def take(self, count: int) -> bytes:
        """See `Port`."""
        if not self._is_checked:
            return b""
        data, self._received = self._received[:count], self._received[count:]
        return data

    def write(self, data: bytes) -> None:
        """See `Port`."""
        if self._client is None:
            return
        self._to_client = (self._to_client + data)[-BACKLOG:]
        try:
            self._to_client = self._to_client[self._client.send(self._to_client) :]
        except BlockingIOError:
            pass
        except OSError:
            self._drop()

    def baud(self) -> int | None:
        """TCP has none."""
        return None

    def close(self) -> None:
        """Closes client and port."""
        self._drop()
        self._listener.close()


def _send_away(client: socket.socket | None, sentence: str) -> None:
    """Says why, and closes. What the client has sent is read first: unread bytes would make the system drop the
    sentence."""
    assert client is not None
    with client, contextlib.suppress(OSError):
        client.sendall(sentence.encode())
        client.shutdown(socket.SHUT_WR)
        client.recv(BACKLOG)
