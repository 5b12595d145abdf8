"""What a line may do to what it carries: lose, double, delay, hold back and damage frames; repeatably, by a seed."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

Latency = Callable[[random.Random], float]


def none(_: random.Random) -> float:
    """No latency beside the line's own."""
    return 0.0


def uniform(least_s: float, most_s: float) -> Latency:
    """Any latency between the two, as likely as any other."""
    return lambda draw: draw.uniform(least_s, most_s)


@dataclass
class Channel:
    """Carries frames in both directions, "board" and "host".

    Attributes:
        loss, duplication: how likely a frame is lost, or comes twice.
        copy_delay_s: how much later the copy may come; so retries and copies may overtake each other.
        bit_errors: how likely a bit is wrong.
        latency: seconds from the line's end to the receiver, by direction; frames keep their order.
        batch_s: what comes to the host comes at multiples of this, as over USB.
        stalled: frames to the board wait, and come all at once when that ends.
        trace: every frame with its time and direction, as sent, if it is a list.
    """

    loss: float = 0.0
    duplication: float = 0.0
    copy_delay_s: float = 0.05
    bit_errors: float = 0.0
    to_board: Latency = none
    to_host: Latency = none
    batch_s: float = 0.0
    seed: object = 1
    stalled: bool = False
    trace: list[tuple[float, str, bytes]] | None = None
    held: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._draw = random.Random(f"channel {self.seed}")
        self._last = {"board": 0.0, "host": 0.0}

    def carry(self, way: str, frame: bytes, at_s: float) -> list[tuple[float, bytes]]:
        """When and as what a frame arrives that has left the line at `at_s`: nothing if it is lost."""
        if self.trace is not None:
            self.trace.append((at_s, way, frame))
        if way == "board" and self.stalled:
            self.held.append(frame)
            return []
        draw = self._draw
        if self.loss and draw.random() < self.loss:
            return []
        at_s = max(at_s + (self.to_board if way == "board" else self.to_host)(draw), self._last[way])
        if self.batch_s and way == "host":
            at_s = (at_s // self.batch_s + 1) * self.batch_s
        self._last[way] = at_s
        arrivals = [(at_s, self._damage(frame))]
        if self.duplication and draw.random() < self.duplication:
            arrivals.append((at_s + draw.uniform(0.0, self.copy_delay_s), self._damage(frame)))
        return arrivals

    def _damage(self, frame: bytes) -> bytes:
        if not self.bit_errors:
            return frame
        damaged = bytearray(frame)
        for index in range(8 * len(damaged)):
            if self._draw.random() < self.bit_errors:
                damaged[index // 8] ^= 1 << index % 8
        return bytes(damaged)
