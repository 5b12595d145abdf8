"""The bytes to and from one board: frames out, frames in, both with their stamps (protocol/PROTOCOL.md, "Frame")."""

from __future__ import annotations

import math
from collections.abc import Callable

from boebot.link import messages
from boebot.link.bad_line import BadLine
from boebot.link.frame import NO_SESSION, Decoder, encode
from boebot.link.transport import BaudSelectable, Transport, stamped_read

NEVER = math.inf
AT_ONCE = -math.inf
_BAUD = 500_000  # assumed for time-outs where the transport does not know its rate
_BITS_PER_BYTE = 10

Append = Callable[[str, float, bytes], None]
Send = Callable[[messages.Message], object]
Handlers = dict[int, Callable[[bytes, float], object]]
"""The id of a message -> what takes its payload and the time of its receipt"""


class Line:
    """A transport that carries frames.

    Attributes:
        transport: where the bytes go.
        now: the transport's clock (s).
        decoder: of what comes.
        listener: also gets all bytes as they come; None: nobody does.
        byte_s: time that a byte needs on the line (s).
        known_byte_s: the same where the transport knows it for certain, else 0.
        bad: what damages it; None: nothing does.
    """

    def __init__(self, transport: Transport, record: Append | None = None) -> None:
        """`record`: gets all that crosses the wire: ("to_board" or "to_host", s on the transport's clock, bytes)."""
        self.transport = transport
        self.now = transport.now
        self.decoder = Decoder(NO_SESSION)
        self.listener: Callable[[bytes], None] | None = None
        self.bad: BadLine | None = None
        self._record = record
        self._sequence = 0
        self._session = 0  # seed of the frames that are sent
        self._read = stamped_read(transport)
        self._write = transport.write
        self._learn_baud()

    def make_bad(self, seed: int) -> BadLine:
        """What damages it from now on, once it has faults. What `record` gets is what the host sends and hears."""
        self.bad = BadLine.around(self.bad or self.transport, seed)
        self._read, self._write = self.bad.read_stamped, self.bad.write
        return self.bad

    def use_session(self, session: int) -> None:
        """Sends and accepts frames of that session from now on; 0: only those of the handshake."""
        self._session = session
        self.decoder.seed = session or NO_SESSION

    def send(self, message: messages.Message) -> None:
        """Sends one message."""
        self.send_fields(type(message), *message)

    def send_fields(self, kind: type[messages.Message], *fields: object) -> None:
        """As `send`, without an object for the message: set-points are sent at every step."""
        frame = encode(kind.ID, self._sequence, kind.STRUCT.pack(*fields), self._session)
        self._sequence = (self._sequence + 1) & 0xFF
        self._write(frame)
        if self._record is not None:
            self._record("to_board", self.now(), frame)

    def read(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """Reads as `Stamping.read_stamped` does; `decoder` finds the frames in it."""
        pieces = self._read(wait_s, quiet_s)
        if self._record is not None:
            for stamp, data in pieces:
                self._record("to_host", stamp, data)
        if self.listener is not None:
            for _, data in pieces:
                self.listener(data)
        return pieces

    def change_baud(self, baud: int) -> None:
        """Another rate, for a transport that has one."""
        assert isinstance(self.transport, BaudSelectable)
        self.transport.set_baud(baud)
        self._learn_baud()
        self.decoder = Decoder(NO_SESSION)

    def _learn_baud(self) -> None:
        baud = self.transport.baud if isinstance(self.transport, BaudSelectable) else 0
        self.byte_s = _BITS_PER_BYTE / (baud or _BAUD)
        self.known_byte_s = _BITS_PER_BYTE / baud if baud else 0.0
