"""A test rig: one board on a bench, its serial line in our hands and, where it is emulated, its pins too.

Every wait is in the board's own time and says what it waits for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any, TypeVar

import numpy as np

from boebot.boards import BoardRequest, BoardSession, open_board
from boebot.link import frame, messages
from boebot.robots import load_robot

_M = TypeVar("_M")  # a message

CYCLES_PER_S = 16_000_000
CYCLES_PER_US = 16
TICK_S = 0.010
FRAME_CYCLES = 320_000  # 20 ms servo frame


class Rig:
    """Speaks frames with the board, one message at a time, without the kit's session layer."""

    def __init__(self, session: BoardSession) -> None:
        self.session = session
        self.transport = session.transport
        self.decoder = frame.Decoder()
        self.telemetry: list[messages.Telemetry] = []
        self.answers: list[Any] = []
        self.received = bytearray()
        self._sequence = 0

    @classmethod
    def open(cls, url: str, robot: str = "shieldbot", arena: str = "empty", seed: int = 1, noise: bool = False) -> Rig:
        """A rig around the board at `url`, by default in an empty field and without noise."""
        return cls(open_board(url, BoardRequest(robot=load_robot(robot), arena=arena, seed=seed, noise=noise)))

    def __enter__(self) -> Rig:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.session.close()

    @property
    def board(self) -> Any:
        """The emulated board's pins."""
        return self.session.board  # type: ignore[attr-defined]

    # ---- line --------------------------------------------------------------------------------------------------------

    def send(self, message: Any) -> int:
        """Sends one message; returns its sequence number."""
        sequence = self._sequence
        self._sequence = (sequence + 1) & 0xFF
        self.transport.write(frame.encode(message.ID, sequence, message.pack()))
        return sequence

    def listen(self, seconds: float) -> list[messages.Telemetry]:
        """Lets time pass; returns the telemetry that came meanwhile."""
        before = len(self.telemetry)
        end = self.transport.now() + seconds
        while (left := end - self.transport.now()) > 1e-9:
            self._take(self.transport.read(left, left))
        return self.telemetry[before:]

    def _take(self, data: bytes) -> None:
        self.received += data
        for message_id, _, payload in self.decoder.feed(data):
            message = messages.MESSAGES[message_id].unpack(payload)
            if isinstance(message, messages.Telemetry):
                self.telemetry.append(message)
            else:
                self.answers.append(message)

    def ask(self, request: Any, answer: type[_M], within_s: float = 0.1) -> _M:
        """Sends a request and returns the answer."""
        self.send(request)
        found: _M = self.wait_for(
            lambda: next((a for a in reversed(self.answers) if isinstance(a, answer)), None),
            within_s,
            answer.__name__,
        )
        return found

    def wait_for(self, condition: Callable[[], Any], within_s: float, what: str) -> Any:
        """Listens until `condition()` is true; fails after `within_s` of the board's time."""
        end = self.transport.now() + within_s
        while not (value := condition()):
            assert self.transport.now() < end, f"waited {within_s} s in vain for {what}"
            self.listen(TICK_S / 10)
        return value

    def latest(self) -> messages.Telemetry:
        """The telemetry of a tick that begins from now on."""
        count = len(self.telemetry)
        self.wait_for(lambda: len(self.telemetry) > count + 1, 3 * TICK_S, "telemetry")
        return self.telemetry[-1]

    def drive(self, left: float, right: float, time_to_live_ms: int = 250) -> int:
        """Sends motor signals in [-1, 1]."""
        return self.send(messages.SetpointSignal(round(left * 1e4), round(right * 1e4), time_to_live_ms, 0))

    def drive_for(self, left: float, right: float, seconds: float) -> None:
        """Sends motor signals every 50 ms for that long."""
        end = self.transport.now() + seconds
        while self.transport.now() < end - 1e-9:
            self.drive(left, right)
            self.listen(min(0.05, end - self.transport.now()))

    def flood(self, setpoint: messages.SetpointSignal, seconds: float) -> None:
        """Saturates the line both ways for that long: set-points and requests without a gap, 50,000 bytes/s, so that
        answers and telemetry fill the other direction too."""
        request = messages.GetParameter(0)
        for _ in range(round(seconds / TICK_S)):
            wire = bytearray()
            while len(wire) < 500:
                wire += frame.encode(setpoint.ID, 0, setpoint.pack())
                wire += frame.encode(request.ID, 0, request.pack()) * 3
            self.transport.write(bytes(wire[:500]))  # the last frame is cut, and so refused
            self.listen(TICK_S)

    def start(self) -> messages.Hello:
        """Waits for the board to be up."""
        return self.ask(messages.HelloRequest(messages.PROTOCOL_VERSION), messages.Hello, within_s=1.0)

    # ---- pins --------------------------------------------------------------------------------------------------------

    def pulses(self, pin: int) -> np.ndarray:
        """Start and width, in cycles, of every high pulse that the board gave on `pin`: shape (n, 2)."""
        return np.array(list(_pulses(self.board.pin_log(), pin)), dtype=np.int64).reshape(-1, 2)


def _pulses(log: np.ndarray, pin: int) -> Iterator[tuple[int, int]]:
    rise = None
    for edge in log[log["pin"] == pin]:
        if edge["level"] == 1:
            rise = int(edge["cycle"])
        elif rise is not None:
            yield rise, int(edge["cycle"]) - rise
            rise = None
