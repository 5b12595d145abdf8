"""Puts a board on a CAN bus: every message of its line, both ways (protocol/PROTOCOL.md, "On CAN").

The bridge holds no session of its own: host and board shake hands through it. Where the bus is lost, or somebody else
uses the board's identifiers, it stops the motors and ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from boebot.errors import BoardError
from boebot.link.transport import Transport
from boebot_can.bus import Bus
from boebot_can.frames import CanFrame, ForeignFrameError
from boebot_can.iso_tp import LongMessages
from boebot_can.translator import BoardEnd

STEP_S = 0.0004  # wait for the board between two looks at the bus: a frame to it is late by as much at most
_HELLO_LIMIT_S = 4.0  # a boot loader may wait first
_LAST_WORDS_S = 0.02
_LISTEN_S = 0.3  # a board says something every 0.2 s


@dataclass
class BridgeCounters:
    """What a bridge has carried."""

    from_board: int = 0
    """frames onto the bus"""
    to_board: int = 0
    """frames of the bus that were for the board"""
    lost: int = 0
    """messages to the board of which a frame was missing"""
    stale: int = 0
    """messages to the board of another session, and set-points while the bridge was behind the bus"""
    broken_off: int = 0
    """long messages that were not completed"""


class Bridge:
    """A board's line on a bus."""

    def __init__(self, transport: Transport, bus: Bus, node: int) -> None:
        """Neither is closed by the bridge. `node`: the board's number on the bus, 1 to 7."""
        self.transport = transport
        self.bus = bus
        self.node = node
        self._long = LongMessages(node, self._send, at_board=True)
        self._end = BoardEnd(node, self._long.send)
        self._heard = False
        self._counters = BridgeCounters()

    def listen(self) -> None:
        """Says nothing yet: the board that has this number already is heard, and goes on undisturbed.

        Raises:
            BoardError: there is one, or the bus has gone.
        """
        end_s = time.perf_counter() + _LISTEN_S
        while (left_s := end_s - time.perf_counter()) > 0:
            for frame in self.bus.receive(left_s):
                self._take(frame)

    def wait_for_board(self, limit_s: float = _HELLO_LIMIT_S) -> None:
        """Waits until the board has spoken.

        Raises:
            BoardError: it did not.
        """
        end_s = self.transport.now() + limit_s
        while not self._heard:
            if self.transport.now() >= end_s:
                raise BoardError(f"no board speaks at {self.transport.name}, within {limit_s:g} s")
            self.step()

    def run(self, running: Callable[[], bool]) -> None:
        """Carries messages until `running()` is false; the motors are stopped then, or when an error ends it.

        Raises:
            BoardError: bus or board has gone, or somebody else sends as this board or in place of a host.
        """
        try:
            while running():
                self.step()
        finally:
            self.stop()

    def step(self) -> None:
        """Carries what has come, both ways."""
        data = self.transport.read(STEP_S)
        if data:
            self._heard |= bool(frames := self._end.frames(data))
            for frame in frames:
                self._send(frame)
        for frame in self.bus.receive(0.0):
            self._take(frame)
        self._write_long(self._long.service())

    def stop(self) -> None:
        """Stops the motors and ends the session, as far as the board can still be reached."""
        words = self._end.last_words()
        if not words:
            return
        try:
            self.transport.write(words)
            self.transport.read(_LAST_WORDS_S, _LAST_WORDS_S)
        except BoardError:
            pass  # it has gone: its own time-outs stop it

    def counters(self) -> BridgeCounters:
        """What was carried so far."""
        counters, end = self._counters, self._end
        counters.lost, counters.stale, counters.broken_off = end.assembler.lost, end.stale, self._long.failed
        return counters

    def _send(self, frame: CanFrame) -> None:
        self.bus.send([frame], self.transport.now())
        self._counters.from_board += 1

    def _take(self, frame: CanFrame) -> None:
        """A frame came over the bus."""
        if not self._end.assembler.takes(frame.identifier):
            if self._end.assembler.sends(frame.identifier):
                raise BoardError(
                    f"another board on {self.bus.name} sends as node {self.node}, too (frame {frame.identifier:#05x}); "
                    "expected each board to have a node of its own: the motors were stopped"
                )
            return
        self._counters.to_board += 1
        if self.bus.is_behind and not self._end.fresh([frame]):
            return
        if frame.identifier == self._long.listens_to:
            self._write_long(self._long.receive(frame))
            return
        try:
            data = self._end.to_board(frame)
        except ForeignFrameError as error:
            raise BoardError(
                f"somebody else uses the board's identifiers on {self.bus.name}: {error}; the motors were stopped"
            ) from None
        if data:
            self.transport.write(data)

    def _write_long(self, datagrams: list[bytes]) -> None:
        for datagram in datagrams:
            if data := self._end.long_bytes(datagram):
                self.transport.write(data)
