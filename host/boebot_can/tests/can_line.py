"""A board's line led over CAN frames, in simulated time: bytes, frames, bytes; frames may be lost or changed there.
And how tests drive a board over any link."""

from __future__ import annotations

from collections.abc import Callable

from boebot.link import messages
from boebot.link.link import Link
from boebot.link.transport import Transport
from boebot_can.frames import CanFrame
from boebot_can.translator import BoardEnd, HostEnd

Carry = Callable[[CanFrame], list[CanFrame]]


class CanLine:
    """A transport: that of a board, with both ends of a bus in between (long messages as they are).

    Attributes:
        board_end, host_end: the ends.
        seen: the frames that were sent, oldest first.
        carry: which frames arrive in place of one.
    """

    realtime = False

    def __init__(self, transport: Transport, node: int = 1, carry: Carry = lambda frame: [frame]) -> None:
        self.name = f"{transport.name} over CAN"
        self.seen: list[CanFrame] = []
        self.carry = carry
        self._board = transport
        self._to_host: list[bytes] = []
        self.board_end = BoardEnd(node, self._to_host.append)
        self.host_end = HostEnd(node, lambda data: transport.write(self.board_end.long_bytes(data)))

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        data = self._board.read(wait_s, quiet_s)
        found = b"".join(self.host_end.to_link(frame) for frame in self._over(self.board_end.frames(data)))
        found += b"".join(self.host_end.long_bytes(data) for data in self._to_host)
        self._to_host.clear()
        return found

    def write(self, data: bytes) -> None:
        for frame in self._over(self.host_end.frames(data)):
            if arrived := self.board_end.to_board(frame):
                self._board.write(arrived)

    def now(self) -> float:
        return self._board.now()

    def close(self) -> None:
        self._board.close()

    def _over(self, frames: list[CanFrame]) -> list[CanFrame]:
        self.seen += frames
        return [arrived for frame in frames for arrived in self.carry(frame)]


def drive(link: Link, seconds: float, left: float = 0.5, right: float = 0.5) -> list[messages.Telemetry]:
    """Answers each observation by the same signals; what was observed."""
    seen = []
    end_s = link.transport.now() + seconds
    while link.transport.now() < end_s:
        for received in link.poll(0.02):
            telemetry = messages.Telemetry.unpack(received[0])
            link.send_signal(left, right, 250, telemetry.tick)
            seen.append(telemetry)
    return seen


def after(link: Link, seconds: float) -> messages.Telemetry:
    """The newest telemetry after so long a silence."""
    return messages.Telemetry.unpack(link.poll(seconds, seconds)[-1][0])
