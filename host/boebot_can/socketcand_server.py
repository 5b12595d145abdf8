"""A CAN bus of our own on this computer: what socketcand's clients join, python-can's among them.

The protocol is socketcand's raw mode (its doc/protocol.md): lines of text between `<` and `>`.

    server  < hi >
    client  < open can0 >       server  < ok >
    client  < rawmode >         server  < ok >
    client  < send 122 2 a0 1 >
    server  < frame 321 23.424242 1122334455667788 >

Every frame goes to all clients but its sender. It has no thread: `receive` and `send` do the work. What a client does
not fetch is dropped and counted once its queue is full. What a client sends faster than a real bus carries waits in its
connection: a flood delays itself, not the others.
"""

from __future__ import annotations

import os
import re
import selectors
import socket
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from boebot.errors import BoardError
from boebot_can.frames import CanFrame

CHANNEL = "can0"
MOST_CLIENTS = 32
QUEUE_BYTES = 4_000_000  # some 80,000 frames for each client
_LINE_BYTES = 1000  # of text without an end
_READ_BYTES = 4096
_FRAMES_HZ = 5000  # most of one client for long; 500 kbit/s are 4000 full ones
_BURST_S = 0.02  # by which a client may be ahead of that
_QUIET_S = 0.1  # after rawmode: python-can reads "< ok >" and whatever follows as one piece
_SEND = re.compile(rb"send ([0-9A-Fa-f]{1,8}) ([0-8])((?: +[0-9A-Fa-f]{1,2})*) *")


@dataclass
class _Client:
    connection: socket.socket
    received: bytearray = field(default_factory=bytearray)
    queue: bytearray = field(default_factory=bytearray)
    paid_until_s: float = 0.0  # the time that its frames would take
    is_open: bool = False
    raw_from_s: float | None = None  # gets frames from then on
    watched: int = selectors.EVENT_READ


class SocketcandBus:
    """A bus that clients join on a TCP port of loopback (a `Bus` of boebot_can.bus).

    Attributes:
        name: how people call it.
        port: TCP port.
        errors: 0; there is no wire.
        is_behind: False: clients wait, frames do not.
        dropped: frames that a client did not get, since its queue was full.
        rubbish: lines of clients that are no commands.
    """

    def __init__(self, port: int, clock: Callable[[], float]) -> None:
        """Listens.

        Args:
            port: TCP port; 0: any free one.
            clock: stamps the frames of clients (s).

        Raises:
            BoardError: the port is taken.
        """
        try:
            self._listener = socket.create_server(("127.0.0.1", port), backlog=MOST_CLIENTS)
        except OSError as error:
            why = os.strerror(error.errno or 0).lower()
            raise BoardError(f"a CAN bus cannot be served on TCP port {port}: {why}") from None
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self.name = f"socketcand:{CHANNEL}?port={self.port}"
        self.errors = 0
        self.is_behind = False
        self.dropped = 0
        self.rubbish = 0
        self._clock = clock
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._clients: dict[socket.socket, _Client] = {}
        self._taken: list[CanFrame] = []

    @property
    def clients(self) -> int:
        """How many are there."""
        return len(self._clients)

    def send(self, frames: Iterable[CanFrame], stamp_s: float) -> None:
        """Gives frames to all clients."""
        if self._clients:
            for frame in frames:
                self._spread(f"{frame.identifier:03X}", frame.data, stamp_s, None)
            self._flush_all()

    def receive(self, wait_s: float) -> list[CanFrame]:
        """The frames of clients; those with identifiers of 29 bits go to the other clients alone."""
        now = time.perf_counter()
        for key, events in self._selector.select(wait_s):
            if key.fileobj is self._listener:
                self._accept()
                continue
            client = self._clients[key.fileobj]  # type: ignore[index]
            if events & selectors.EVENT_READ and client.paid_until_s <= now + _BURST_S:
                self._read(client)
        self._flush_all()
        taken, self._taken = self._taken, []
        return taken

    def close(self) -> None:
        """Ends the bus."""
        for client in list(self._clients.values()):
            self._drop(client)
        self._selector.close()
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return  # it has gone again
        if len(self._clients) >= MOST_CLIENTS:
            connection.close()
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client = self._clients[connection] = _Client(connection)
        self._selector.register(connection, client.watched)
        self._answer(client, "hi")

    def _read(self, client: _Client) -> None:
        try:
            data = client.connection.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        client.received += data
        *lines, rest = bytes(client.received).split(b">")
        client.received = bytearray(rest)
        client.paid_until_s = max(client.paid_until_s, time.perf_counter()) + len(lines) / _FRAMES_HZ
        for line in lines:
            self._obey(client, line.partition(b"<")[2].strip())
        if len(rest) > _LINE_BYTES:
            self.rubbish += 1
            self._drop(client)

    def _obey(self, client: _Client, command: bytes) -> None:
        """Carries out one command."""
        if client.raw_from_s is not None:
            match = _SEND.fullmatch(command)
            if match is not None:
                identifier = int(match[1], 16)
                data = bytes(int(byte, 16) for byte in match[3].split())
                if len(data) == int(match[2]) and identifier < 1 << 29:
                    self._put(client, match[1], identifier, data)
                    return
            self.rubbish += command != b"echo"  # no answer: python-can would take it for an error of the bus
        elif not client.is_open and command == b"open " + CHANNEL.encode():
            client.is_open = True
            self._answer(client, "ok")
        elif client.is_open and command == b"rawmode":
            client.raw_from_s = self._clock() + _QUIET_S
            self._answer(client, "ok")
        elif command == b"echo":
            self._answer(client, "echo")
        else:
            self.rubbish += 1
            self._answer(client, f"error expected {'rawmode' if client.is_open else f'open {CHANNEL}'}")

    def _put(self, client: _Client, digits: bytes, identifier: int, data: bytes) -> None:
        """A client has sent a frame."""
        if len(digits) <= 3:
            if identifier < 1 << 11:
                self._taken.append(CanFrame(identifier, data))
                self._spread(f"{identifier:03X}", data, self._clock(), client)
            else:
                self.rubbish += 1
        else:
            self._spread(f"{identifier:08X}", data, self._clock(), client)

    def _spread(self, identifier: str, data: bytes, stamp_s: float, sender: _Client | None) -> None:
        line = f"< frame {identifier} {stamp_s:.6f} {data.hex()} >".encode()
        now = self._clock()
        for client in self._clients.values():
            if client is sender or client.raw_from_s is None or now < client.raw_from_s:
                continue
            if len(client.queue) + len(line) > QUEUE_BYTES:
                self.dropped += 1
            else:
                client.queue += line

    def _answer(self, client: _Client, text: str) -> None:
        client.queue += f"< {text} >".encode()

    def _flush_all(self) -> None:
        for client in list(self._clients.values()):
            if client.queue:
                self._flush(client)

    def _flush(self, client: _Client) -> None:
        """Sends what the connection takes; the selector says when it takes more."""
        try:
            sent = client.connection.send(client.queue)
            del client.queue[:sent]
        except BlockingIOError:
            pass
        except OSError:
            self._drop(client)
            return
        watched = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.queue else 0)
        if watched != client.watched:
            client.watched = watched
            self._selector.modify(client.connection, watched)

    def _drop(self, client: _Client) -> None:
        del self._clients[client.connection]
        self._selector.unregister(client.connection)
        client.connection.close()
