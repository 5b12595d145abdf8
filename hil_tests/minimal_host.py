"""The least that a host must do, for tests of the board alone: hello, open, requests, as PROTOCOL.md says, with its
plainest frame (protocol/reference_frame.py). No world, no retries unless a test asks for them.

Time is the board's; every wait is in seconds of it and says what it waits for.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from boebot.link import messages
from sim_bridge._core import ffi, lib
from sim_bridge.boards.board import BoardAccess
from sim_bridge.boards.emulated import avr_image, image_file, native_board, native_library

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "protocol"))
import reference_frame

CYCLES_PER_S = 16_000_000
TICK_S = 0.010
HOST_NONCE = 0x0A5A5A

_M = TypeVar("_M", bound=messages.Message)


def power_on(kind: str, pin_map: str = "shieldbot", image: str | None = None) -> BoardAccess:
    """An emulated board, "native" or "avr", with no world around it."""
    if kind == "avr":
        from sim_bridge.boards.avr import create

        return create(image_file(image) if image else avr_image(pin_map)).access()
    board = native_board(native_library(pin_map))
    return BoardAccess(lib, ffi, ffi.cast("board *", board.address), owner=board)


def _unstuff(data: bytes) -> bytes | None:
    blocks, at = [], 0
    while at < len(data):
        if data[at] == 0 or at + data[at] > len(data):
            return None
        blocks.append(data[at + 1 : at + data[at]])
        at += data[at]
    return b"\0".join(blocks)


class MinimalHost:
    """Speaks with one board over its line. `messages` are all that it understood, in order."""

    def __init__(self, board: BoardAccess) -> None:
        """Of a board that was just powered on."""
        self.board = board
        self.messages: list[Any] = []
        self.seed = 0
        self.number = 0
        self._sequence = 0
        self._pending = bytearray()

    def send(self, message: messages.Message) -> None:
        """Puts one message on the line: of the handshake with its seed, others with the session's."""
        handshake = message.DELIVERY == "handshake"
        seed = reference_frame.SEED if handshake else self.seed
        self.board.send(reference_frame.frame(message.ID, self._sequence, message.pack(), seed))
        self._sequence = (self._sequence + 1) & 0xFF

    def listen(self, seconds: float) -> list[Any]:
        """Lets time pass; returns what came meanwhile."""
        before = len(self.messages)
        self.board.run(round(seconds * CYCLES_PER_S))
        for _, byte in self.board.receive():
            if byte:
                self._pending.append(byte)
            elif self._pending:
                self._take(bytes(self._pending))
                self._pending.clear()
        return self.messages[before:]

    def _take(self, block: bytes) -> None:
        stuffed, tail = block[:-3], block[-3:]
        content = _unstuff(stuffed)
        kind = messages.MESSAGES.get(content[0]) if content else None
        if content is None or kind is None or len(content) != kind.LENGTH + 2:
            return
        seed = reference_frame.SEED if kind.DELIVERY == "handshake" else self.seed
        check = reference_frame.crc21(stuffed, seed)
        if tail == bytes(0x80 | check >> shift & 0x7F for shift in (14, 7, 0)):
            self.messages.append(kind.unpack(content[2:]))

    def wait_for(self, kind: type[_M], condition: Callable[[_M], bool], within_s: float, what: str) -> _M:
        """The first message of that kind from now on that is as wished; fails after `within_s`."""
        for _ in range(round(within_s / TICK_S) + 1):
            for message in self.listen(TICK_S):
                if isinstance(message, kind) and condition(message):
                    return message
        raise AssertionError(f"waited {within_s} s in vain for {what}")

    def hello(self, within_s: float = 1.0) -> messages.Hello:
        """The next hello."""
        return self.wait_for(messages.Hello, lambda _: True, within_s, "a hello")

    def open(self) -> messages.Hello:
        """Opens a session; returns the board's hello in it."""
        heard = self.wait_for(messages.Hello, lambda hello: hello.session == 0, 2.0, "a hello without a session")
        self.seed, self.number = heard.board_nonce ^ HOST_NONCE, 0
        self.send(messages.Open(messages.PROTOCOL_VERSION, heard.board_nonce, HOST_NONCE))
        return self.wait_for(messages.Hello, lambda hello: hello.session == self.seed, 0.3, "the session")

    def take_over(self) -> messages.Hello:
        """Opens another session in place of the one that is open; returns the board's hello in it."""
        heard = self.hello()
        self.send(messages.Open(messages.PROTOCOL_VERSION, heard.board_nonce, HOST_NONCE))
        self.seed, self.number = heard.board_nonce ^ HOST_NONCE, 0
        return self.wait_for(messages.Hello, lambda hello: hello.session == self.seed, 0.3, "the session")

    def ask(self, kind: type[Any], *fields: int, within_s: float = 1.0) -> messages.Answer:
        """Sends a numbered request, keeps the session open, returns the answer."""
        number = self.begin(kind, *fields)
        for _ in range(round(within_s / 0.1) + 1):
            try:
                return self.wait_for(messages.Answer, lambda answer: answer.number == number, 0.1, "an answer")
            except AssertionError:
                self.send(messages.ClockProbe(0))
        raise AssertionError(f"waited {within_s} s in vain for the answer to {kind.__name__}")

    def begin(self, kind: type[Any], *fields: int) -> int:
        """Sends a numbered request; returns its number."""
        self.number = (self.number + 1) & 0xFFFF
        self.send(kind(self.number, *fields))
        return self.number
