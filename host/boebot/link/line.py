"""The bytes to and from one board: frames out, frames in, both with their stamps (protocol/PROTOCOL.md, "Frame").

Whoever extends `Line` says what the messages mean (`_handlers`) and what is to be sent when (`_service`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial

from boebot.link import finding, messages
from boebot.link.frame import NO_SESSION, Decoder, encode
from boebot.link.transport import BaudSelectable, Stamping, Transport

NEVER = math.inf
SHORTEST_S = 1e-4  # a wait that rounds to nothing would never end on a clock that only waits advance
_BAUD = 500_000  # assumed for time-outs where the transport cannot tell
_BITS_PER_BYTE = 10


Append = Callable[[str, float, bytes], None]


class Line(ABC):
    """A transport, a decoder, and what crossed the wire.

    Attributes:
        transport: where the bytes go.
        decoder: of what comes.
        hello: what the board said of itself last.
        byte_s: time that a byte needs on the line (s).
        line_s: the same as far as the transport knows it for certain, else 0.
    """

    def __init__(self, transport: Transport, record: Append | None) -> None:
        """`record`: takes all that crosses the wire: ("to_board" or "to_host", s on the transport's clock, bytes)."""
        self.transport = transport
        self.decoder = Decoder(NO_SESSION)
        self.hello: messages.Hello | None = None
        self._record = record
        self._sequence = 0
        self._session = 0  # seed of the frames that are sent
        self._heard = finding.Heard()
        self._due = NEVER  # when something is to be sent next
        self._now = transport.now
        self._read = transport.read_stamped if isinstance(transport, Stamping) else partial(_stamp_now, transport)
        self._handlers: dict[int, Callable[[bytes, float], None]] = {}
        self._refused: messages.Hello | None = None  # of a board that cannot be spoken with
        self._learn_baud()

    @abstractmethod
    def _service(self, now: float) -> None:
        """Sends what is due by now, and notes in `_due` when the next is."""

    @abstractmethod
    def _piece_heard(self, now: float) -> None:
        """Called after the messages of each piece of bytes, which came together."""

    @abstractmethod
    def _refuse(self) -> None:
        """Raises why the board of `_refused` cannot be spoken with, unless that is being found out already."""

    def _turn(self, until: float) -> None:
        """One step: sends what is due and takes what comes, at the latest until the given time."""
        now = self._now()
        if now >= self._due:
            self._service(now)
        self._receive(max(min(until, self._due) - now, SHORTEST_S), 0.0)

    def _send(self, message_id: int, payload: bytes) -> None:
        frame = encode(message_id, self._sequence, payload, self._session)
        self._sequence = (self._sequence + 1) & 0xFF
        self.transport.write(frame)
        if self._record is not None:
            self._record("to_board", self._now(), frame)

    def _receive(self, wait_s: float, quiet_s: float) -> None:
        """Reads what arrived, and hands each message to who heeds it."""
        handlers = self._handlers
        for stamp, data in self._read(wait_s, quiet_s):
            if self._record is not None:
                self._record("to_host", stamp, data)
            if self.hello is None:
                self._heard.take(data)
            for message_id, _, payload in self.decoder.feed(data):
                handlers[message_id](payload, stamp)
            self._piece_heard(stamp)
        if self._refused is not None:
            self._refuse()

    def _learn_baud(self) -> None:
        baud = self.transport.baud if isinstance(self.transport, BaudSelectable) else 0
        self.byte_s = _BITS_PER_BYTE / (baud or _BAUD)
        self.line_s = _BITS_PER_BYTE / baud if baud else 0.0

    def _change_baud(self, baud: int) -> None:
        assert isinstance(self.transport, BaudSelectable)
        self.transport.set_baud(baud)
        self._learn_baud()
        self.decoder = Decoder(NO_SESSION)


def _stamp_now(transport: Transport, wait_s: float, quiet_s: float) -> list[tuple[float, bytes]]:
    """Reads from a transport that does not stamp what comes."""
    data = transport.read(wait_s, quiet_s)
    return [(transport.now(), data)] if data else []
