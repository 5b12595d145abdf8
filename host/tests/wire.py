"""A transport for tests of the link's parts alone: the test gives messages and the time, and sees what is sent."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

from boebot.link import messages
from boebot.link.clock import ClockSync
from boebot.link.frame import Decoder
from boebot.link.line import Line

TELEMETRY = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))
DEVICES = messages.DevicesTelemetry(*(0,) * len(messages.DevicesTelemetry._fields))
HELLO = messages.Hello(
    messages.PROTOCOL_VERSION, messages.SCHEMA_HASH, 77, 0, 100, 1000, 1, 1, 1, 0, 0, b"shieldbot".ljust(16, b"\0")
)


@dataclass
class Wire:
    """A transport that delivers what the test puts in, and keeps what was written."""

    time: float = 0.0
    coming: list[tuple[float, bytes]] = field(default_factory=list)
    written: bytes = b""
    name: str = "wire"
    realtime: bool = False

    def now(self) -> float:
        return self.time

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        del wait_s, quiet_s
        found, self.coming = self.coming, []
        return found

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def write(self, data: bytes) -> None:
        self.written += data

    def close(self) -> None:
        """Nothing to close."""


Sent = list[messages.Message]
"""What a part has sent: it sends by `append`."""


def clock_on(wire: Wire) -> ClockSync:
    """With an open session."""
    clock = ClockSync(Line(wire), random.Random(1))
    clock.session_opened(0.0)
    return clock


def probes_in(wire: Wire) -> list[int]:
    """Tokens of the probes that were sent since the last look."""
    data, wire.written = wire.written, b""
    found = Decoder(0, to_board=True).feed(b"\0" + data)
    return [messages.ClockProbe.unpack(payload).token for _, _, payload in found]
