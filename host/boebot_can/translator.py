"""The bytes of a serial line as CAN frames, at both ends of the bus (protocol/PROTOCOL.md, "On CAN").

    board ══ bytes ══ BoardEnd ── CAN frames ── HostEnd ══ bytes ══ Link

So neither the board nor the link knows of the bus. Each end follows the handshake to know the session's number, for the
checksums of the bytes and for the byte in the CAN frames that tells sessions apart.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable

from boebot.link import messages
from boebot.link.frame import NO_SESSION, Decoder, encode, reader
from boebot_can.frames import ALL_NODES, NODE_MASK, SET_POINTS, Assembler, CanFrame, FrameMaker, whole_tick

_TICK = reader(messages.Telemetry, "tick")
_HELLO_SESSION = reader(messages.Hello, "session")
_WITHOUT_SESSION = ("handshake", "stop")
_UP_TO_DELIMITER = re.compile(rb"[^\0]*\0|[^\0]+")

SendLong = Callable[[bytes], None]
"""Sends a message that has no CAN frames: its id and its payload, by ISO-TP"""


class _End(ABC):
    """What both ends have in common: a decoder of the line's bytes, and the frames of a node.

    Attributes:
        session: number of the one that is open; 0: none.
        stale: messages dropped: of another session, or set-points while the bus is behind.
        assembler: of the frames that come; it counts the lost ones.
    """

    def __init__(self, node: int, send_long: SendLong, *, to_board: bool) -> None:
        nodes = frozenset((node, ALL_NODES)) if to_board else frozenset((node,))
        self.assembler = Assembler(to_board, nodes)
        self.session = 0
        self.stale = 0
        self._maker = FrameMaker(node)
        self._send_long = send_long
        self._decoder = Decoder(NO_SESSION, to_board=not to_board)
        self._sequence = 0

    def _use_session(self, session: int) -> None:
        self.session = session
        self._decoder.seed = session or NO_SESSION

    def fresh(self, frames: list[CanFrame]) -> list[CanFrame]:
        """Those that may go on while the bus is behind: no set-points. One that is 2.56 s old would look fresh."""
        kept = [frame for frame in frames if frame.identifier & ~NODE_MASK not in SET_POINTS]
        self.stale += len(frames) - len(kept)
        return kept

    def frames(self, data: bytes) -> list[CanFrame]:
        """CAN frames of what this end's side of the line has sent."""
        found: list[CanFrame] = []
        for piece in _UP_TO_DELIMITER.findall(data):  # one at a time: a hello tells the session of what follows
            for message_id, sequence, payload in self._decoder.feed(piece):
                self._follow(message_id, payload)
                frames = self._maker.frames(message_id, payload, self.session, sequence)
                found += frames
                if not frames:
                    self._send_long(bytes((message_id,)) + payload)
        return found

    @abstractmethod
    def _follow(self, message_id: int, payload: bytes) -> None:
        """Learns from a message of the line."""

    def _is_of_session(self, message_id: int, session: int | None) -> bool:
        if messages.MESSAGES[message_id].DELIVERY in _WITHOUT_SESSION:
            return True
        if self.session and session in (None, self.session & 0xFF):
            return True
        self.stale += 1
        return False

    def _bytes(self, message_id: int, payload: bytes, sequence: int | None = None) -> bytes:
        """A message as it goes over the line."""
        if sequence is None:
            self._sequence = (self._sequence + 1) & 0xFF
            sequence = self._sequence
        return encode(message_id, sequence, payload, self.session)

    def long_bytes(self, data: bytes) -> bytes:
        """What came by ISO-TP, as it goes over the line; nothing if it is no message for this end."""
        kind = messages.MESSAGES.get(data[0]) if data else None
        to_host = bool(data) and data[0] >= 0x80
        if kind is None or len(data) - 1 != kind.LENGTH or to_host == self.assembler.to_board:
            return b""
        return self._bytes(data[0], data[1:])


class BoardEnd(_End):
    """The end at the board's line: its bytes onto the bus, frames for it into bytes."""

    def __init__(self, node: int, send_long: SendLong) -> None:
        """`node`: the board's number, 1 to 7."""
        super().__init__(node, send_long, to_board=True)
        self.newest_tick = 0

    def to_board(self, frame: CanFrame) -> bytes:
        """Bytes for the board, once `frame` completes a message of the present session; else none.

        Raises:
            ForeignFrameError: the frame has not the form that its identifier demands.
        """
        message = self.assembler.add(frame)
        if message is None or not self._is_of_session(message.id, message.session):
            return b""
        payload = message.payload
        if message.sequence is not None:
            payload = whole_tick(payload, self.newest_tick)
        return self._bytes(message.id, payload, message.sequence)

    def last_words(self) -> bytes:
        """Bytes that stop the motors and end the session, if there is one."""
        if not self.session:
            return b""
        stop, close = messages.Stop(0), messages.Close(self.session)
        return self._bytes(stop.ID, stop.pack()) + self._bytes(close.ID, close.pack())

    def _follow(self, message_id: int, payload: bytes) -> None:
        if message_id == messages.Telemetry.ID:
            (self.newest_tick,) = _TICK(payload)
        elif message_id == messages.Hello.ID:
            (session,) = _HELLO_SESSION(payload)
            self._use_session(session)


class HostEnd(_End):
    """The end at the host's link: its bytes onto the bus, the board's frames into bytes.

    Attributes:
        is_open: the board has spoken in this host's session, which has not been closed.
    """

    def __init__(self, node: int, send_long: SendLong) -> None:
        """`node`: the board's number, 1 to 7."""
        super().__init__(node, send_long, to_board=False)
        self.is_open = False
        self._lost = 0

    def to_link(self, frame: CanFrame) -> bytes:
        """Bytes for the link, once `frame` completes a message of its session; else none.

        Raises:
            ForeignFrameError: the frame has not the form that its identifier demands.
        """
        message = self.assembler.add(frame)
        lost = self.assembler.lost
        self._sequence = (self._sequence + lost - self._lost) & 0xFF  # the link counts gaps
        self._lost = lost
        if message is None or not self._is_of_session(message.id, message.session):
            return b""
        self.is_open |= message.session is not None
        return self._bytes(message.id, message.payload)

    def _follow(self, message_id: int, payload: bytes) -> None:
        if message_id in (messages.Open.ID, messages.Close.ID):
            self.is_open = False
        if message_id == messages.Open.ID:
            opening = messages.Open.unpack(payload)
            self._use_session(opening.board_nonce ^ opening.host_nonce)
