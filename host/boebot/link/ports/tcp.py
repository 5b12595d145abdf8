"""A board behind a TCP connection: `socket://HOST:PORT`."""

from __future__ import annotations

import socket

from boebot.errors import BoardError
from boebot.link.ports.descriptor import DescriptorTransport, within

TIMEOUT_S = 1.8


class SocketTransport(DescriptorTransport):
    """A TCP connection that carries a board's bytes."""

    def __init__(self, host: str, port: int, *, thread: bool = True) -> None:
        """Connects.

        Raises:
            BoardError: no such host, nobody listens, or no answer in time.
        """
        name = f"socket://{f'[{host}]' if ':' in host else host}:{port}"
        try:
            connection: socket.socket = within(
                TIMEOUT_S, lambda: socket.create_connection((host, port), TIMEOUT_S), socket.socket.close
            )
        except OSError as error:
            raise BoardError(f"{name} cannot be opened: {why_not(error, host)}") from None
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)
        self._socket = connection
        super().__init__(name, connection.fileno(), connection.close, thread)

    def _send(self, data: memoryview) -> int:
        return self._socket.send(data)

    def _receive(self) -> bytes:
        return self._socket.recv(65536)


def why_not(error: OSError, host: str) -> str:
    """Why a connection was not made."""
    if isinstance(error, ConnectionRefusedError):
        return "nobody listens there"
    if isinstance(error, TimeoutError):
        return f"no answer within {TIMEOUT_S:g} s"
    if isinstance(error, socket.gaierror):
        return f"no host is called {host}"
    return (error.strerror or str(error)).lower()
