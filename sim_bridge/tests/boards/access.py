"""One emulated board by itself, without a simulated world: its pins are driven, bytes are sent, what it does is logged.
No bench (sim_bridge/bench), whose world lets time pass in steps: here a run is cut anywhere, and tests prove that this
changes nothing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from boebot.errors import BoardError
from sim_bridge.boards.board import LEVELS, BoardMemory, Edge, EmulatedBoard, Level, ResetCause

ROOM = 4096  # bytes that are read from the line at once
SUPPLY = 128  # BOARD_ANALOG_SUPPLY of board.h


class SentByte(NamedTuple):
    """A byte that left the board; `cycle` is the end of its stop bit."""

    cycle: int
    byte: int


class BoardAccess(BoardMemory):
    """One board's operations, times in CPU cycles since power-on, pins by their Arduino numbers (A0 is 14)."""

    def __init__(self, board: EmulatedBoard, logs: bool = True) -> None:
        """Becomes the listener of the board, and keeps it alive. `logs`: what `log` gives is kept until then."""
        ffi, log, volts = board.ffi, list[tuple[int, int, int]](), dict[int, float]()
        sink = ffi.callback("board_edge_sink", lambda _, *edge: log.append(edge))
        source = ffi.callback("board_analog_source", lambda _, cycle, channel: volts.get(channel, 0.0))
        board.called_by_c += [sink, source]
        if logs:
            board.handle.sink = sink
        board.handle.op.analog(board.handle, source, ffi.NULL)
        self._listens_to: EmulatedBoard | None = board
        self._log, self._volts = log, volts
        self._bytes, self._cycles = ffi.new("uint8_t[]", ROOM), ffi.new("uint64_t[]", ROOM)

    @property
    def board(self) -> EmulatedBoard:
        """The board itself."""
        if self._listens_to is None:
            raise BoardError("this board is closed")
        return self._listens_to

    def _call(self, operation: str, *arguments: Any) -> Any:
        """One of the operations of board.h."""
        board = self.board.handle
        return getattr(board.op, operation)(board, *arguments)

    @property
    def now(self) -> int:
        """The cycle up to which the board has run."""
        return int(self._call("now"))

    def advance(self, until: int) -> None:
        """Runs until `until`, or up to an instruction's length beyond, or to an edge that ends the run. A crash raises
        BoardError."""
        if state := self._call("advance", until):
            self.board.raise_ended()
            if state == self.board.lib.BOARD_PAUSED:
                return
            raise BoardError(f"The board stopped: {self.fault}.")

    def run(self, cycles: int) -> None:
        """Runs `cycles` further."""
        self.advance(self.now + cycles)

    def drive(self, pin: int, level: Level, at: int = 0) -> None:
        """From cycle `at` (or now) on the outside drives `pin`; replaces what was queued for it from then on."""
        self._call("drive", at, pin, level)

    def send(self, data: bytes | Iterable[int], at: int = 0) -> None:
        """Puts bytes on the line towards the board, not before cycle `at`."""
        data = bytes(data)
        self._call("send", at, data, len(data))

    def receive(self) -> list[SentByte]:
        """Takes the bytes that left the board since the last call."""
        data, cycles = self.received()
        return [SentByte(cycle, byte) for cycle, byte in zip(cycles, data, strict=True)]

    def received(self) -> tuple[bytes, list[int]]:
        """Takes the bytes that left the board since the last call, and the cycle at which each one's stop bit ended."""
        data, cycles, ffi = b"", [], self.board.ffi
        while count := self._call("receive", self._bytes, self._cycles, ROOM):
            data += ffi.buffer(self._bytes, count)[:]
            cycles += ffi.unpack(self._cycles, count)
        return data, cycles

    def line_rate(self, baud: int) -> None:
        """Sets the outside's bit rate."""
        self._call("line_rate", baud)

    def reset(self, cause: ResetCause = ResetCause.EXTERNAL) -> None:
        """Resets the microcontroller at its next instruction."""
        self._call("reset", cause)

    def log(self) -> list[Edge]:
        """Takes the output edges since the last call."""
        found = [Edge(cycle, pin, LEVELS[level]) for cycle, pin, level in self._log]
        self._log.clear()
        return found

    def analog(self, channel: int, volts: float) -> None:
        """Sets the voltage at analog channel 0..5."""
        self._volts[channel] = volts

    def supply(self, volts: float) -> None:
        """Sets the voltage at VCC and AVCC; 5 V before."""
        self._volts[SUPPLY] = volts

    @property
    def fault(self) -> str | None:
        """What is wrong after a crash, with function and line where they are known, or None."""
        return self.board.fault()

    def close(self) -> None:
        """Lets go of the board."""
        if self._listens_to is not None:
            if not self._listens_to.is_closed:  # it would be written to
                board, null = self._listens_to.handle, self._listens_to.ffi.NULL
                board.sink = null
                board.op.analog(board, null, null)
            self._listens_to = None
