"""What a host sends while times are measured: a set-point each tick, or frames without a gap.

The protocol's frames to the board have 10 to 16 bytes on the wire, most answers 15: a full line carries more of them
than of longer ones, and the board has work with each.
"""

from __future__ import annotations

from boebot.link import messages
from boebot_timing.emulated.line import Line
from sim_bridge.bench.bench import Bench

SETPOINT_PERIOD = 159_001  # cycles: a prime below the tick, so at least one each tick, at each of its phases
TIME_TO_LIVE_MS = 250
EVERY_SETPOINT = 10  # frames of a full line; all others are requests, whose answers fill the way back


class EachTick:
    """A set-point each tick."""

    def __init__(self, line: Line, first: int, signals: tuple[int, int]) -> None:
        """Begins at cycle `first`. `signals`: of the motors, in 1/10,000."""
        self.line, self.signals, self._next = line, signals, first

    def setpoint(self, at: int) -> int:
        """A set-point in answer to the newest telemetry. Returns the cycle at which its last byte has arrived."""
        return self.line.send(messages.SetpointSignal(*self.signals, TIME_TO_LIVE_MS, self.line.tick), at)

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        del bench
        while self._next < until:
            self.setpoint(self._next)
            self._next += SETPOINT_PERIOD


class FullLine(EachTick):
    """Frames back to back: set-points and one request again and again, which the board answers each time."""

    def __init__(self, line: Line, first: int, signals: tuple[int, int]) -> None:
        super().__init__(line, first, signals)
        self._count = 0
        self._request = line.numbered(messages.SetParameter, messages.PARAMETERS["track_width"].id, 10_000)

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        while (at := max(self._next, self.line.free, bench.now)) < until:
            if self._count % EVERY_SETPOINT == 0:
                self.setpoint(at)
            else:
                self.line.send(self._request, at)
            self._count += 1
