"""The host's end of a serial line, to the cycle: frames with the cycles at which they begin and end on the wire.

It opens a session as PROTOCOL.md says, and repeats nothing that is lost: what is lost shall be seen.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

from boebot.errors import BoardError
from boebot.link import frame, messages
from boebot_timing.emulated.loads import TICK_CYCLES
from sim_bridge.bench.bench import Bench

BYTE_CYCLES = 320  # 10 bits at 500,000 baud
HOST_NONCE = 0x0A5A5A
PATIENCE_TICKS = 60  # for an answer; a program that has just started says its first hello within 10

_M = TypeVar("_M")


class Heard(NamedTuple):
    """A message from the board: `first` is the start of its frame's first byte, `last` the end of its last one."""

    first: int
    last: int
    message: Any


class Line:
    """The line of a bench, as a source of its bytes: `queue` sends what `feed` gives it."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.heard: list[Heard] = []
        self.decoder = frame.Decoder(frame.NO_SESSION)
        self.seed = 0
        self.free = 0
        """the cycle at which the last byte sent so far has arrived"""
        self.acknowledges = True
        """events are acknowledged when they come"""
        self._sequence = self._number = 0
        self._bytes = b""  # of a frame that has not ended
        self._cycles = [bench.now]  # of the same, and of the byte before
        bench.after_slice.append(self._listen)

    # ---- to the board ------------------------------------------------------------------------------------------------

    def send(self, message: Any, at: int = 0) -> int:
        """Sends a message, not before cycle `at`; returns the cycle at which its last byte has arrived."""
        wire = frame.encode(message.ID, self._sequence, message.pack(), self.seed or frame.SEED)
        self._sequence = (self._sequence + 1) & 0xFF
        begin = max(at, self.free, self.bench.now)
        self.bench.send(wire, at=begin)
        self.free = begin + len(wire) * BYTE_CYCLES
        return self.free

    def numbered(self, kind: Any, *fields: int) -> Any:
        """The next request of the session."""
        self._number = (self._number + 1) & 0xFFFF
        return kind(self._number, *fields)

    # ---- from the board ----------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        data, cycles = self.bench.robot.received()
        if not data:
            return
        *frames, rest = (self._bytes + data).split(b"\0")
        cycles = self._cycles + cycles
        begin = 0  # of a frame's bytes without the delimiter before it; the cycles begin with that one
        for stuffed in frames:
            end = begin + len(stuffed) + 1
            for message_id, _, payload in self.decoder.feed(stuffed + b"\0"):
                self._hear(messages.MESSAGES[message_id].unpack(payload), cycles[begin] - BYTE_CYCLES, cycles[end])
            begin = end
        self._bytes, self._cycles = rest, cycles[begin:]

    def _hear(self, message: Any, first: int, last: int) -> None:
        self.heard.append(Heard(first, last, message))
        if self.acknowledges and isinstance(message, messages.Event):
            self.send(messages.Acknowledge(message.number))

    def wait(self, kind: type[_M], since: int) -> _M:
        """The first message of that kind that begins after the `since`-th heard one.

        Raises:
            BoardError: none came.
        """
        end = self.bench.now + PATIENCE_TICKS * TICK_CYCLES
        while self.bench.now < end:
            for heard in self.heard[since:]:
                if isinstance(heard.message, kind):
                    return heard.message
            since = len(self.heard)
            self.bench.run(TICK_CYCLES // 8)
        raise BoardError(f"{self.bench.name} says nothing: waited {PATIENCE_TICKS} ticks for {kind.__name__}")

    @property
    def telemetry(self) -> list[Heard]:
        """All telemetry so far."""
        return [heard for heard in self.heard if isinstance(heard.message, messages.Telemetry)]

    # ---- session -----------------------------------------------------------------------------------------------------

    def open(self) -> messages.Hello:
        """Opens a session with a board that has none."""
        self.decoder.seed = frame.NO_SESSION
        hello = self.wait(messages.Hello, len(self.heard))
        since = len(self.heard)
        self.send(messages.Open(messages.PROTOCOL_VERSION, hello.board_nonce, HOST_NONCE))
        self.decoder.seed = self.seed = hello.board_nonce ^ HOST_NONCE
        self._number = 0
        return self.wait(messages.Hello, since)

    def ask(self, kind: Any, *fields: int) -> messages.Answer:
        """Sends a numbered request and waits for its answer."""
        since = len(self.heard)
        self.send(self.numbered(kind, *fields))
        answer = self.wait(messages.Answer, since)
        if answer.status != messages.AnswerStatus.OK:
            raise BoardError(f"{kind.__name__}{fields}: the board says {messages.AnswerStatus(answer.status).name}")
        return answer

    def set(self, parameter: str, value: int) -> None:
        """Sets a parameter, in counts."""
        self.ask(messages.SetParameter, messages.PARAMETERS[parameter].id, value)

    def arm(self) -> None:
        """Ends the latch once the supply has been measured; set-points that answer later ticks then move the motors."""
        newest = self.wait(messages.Telemetry, len(self.heard))
        while newest.supply == 0:
            newest = self.wait(messages.Telemetry, len(self.heard))
        self.ask(messages.Arm, newest.latches)
        self.wait(messages.Telemetry, len(self.heard))

    @property
    def tick(self) -> int:
        """Of the newest telemetry, as a set-point names it."""
        newest = self.newest
        return newest.tick & 0xFFFF if newest is not None else 0

    @property
    def newest(self) -> messages.Telemetry | None:
        """Telemetry, None before the first."""
        for heard in reversed(self.heard):
            if isinstance(heard.message, messages.Telemetry):
                return heard.message
        return None
