"""Telemetry as it comes: stamped, and kept until it is fetched."""

from __future__ import annotations

from boebot.link import messages
from boebot.link.clock_sync import ClockSync
from boebot.link.counters import HostCounters
from boebot.link.fields import reader
from boebot.link.line import NEVER

StampedTelemetry = tuple[bytes, float, float, float]
"""(payload, board time of its tick in s, host time of that in s, error bound of the host time in s)"""

_PERIODS_LATE = 3  # telemetry that comes more of its periods after its tick is counted
_TICK = reader(messages.Telemetry, "tick")
_TIME = reader(messages.Telemetry, "time")
_TICK_AND_TIME = reader(messages.Telemetry, "tick", "time")


class TelemetryBuffer:
    """The telemetry of one link.

    Attributes:
        latest: the newest of this session, or None.
        latest_s: when the newest of all came.
        waiting: to be fetched, oldest first.
    """

    ROOM = 4096  # messages that wait to be fetched

    def __init__(self, clock: ClockSync, counts: HostCounters) -> None:
        """`clock` stamps them."""
        self.latest: bytes | None = None
        self.waiting: list[StampedTelemetry] = []
        self._clock = clock
        self._counts = counts
        self._piece: list[bytes] = []  # not yet stamped
        self._late_after_s = NEVER
        self.latest_s = 0.0
        self._last_tick = -1  # of the session before
        self._last_s = 0.0  # when that came

    def session_opened(self, period_s: float) -> None:
        """Telemetry comes every `period_s` in this session."""
        self._late_after_s = _PERIODS_LATE * period_s

    def session_ended(self) -> None:
        """What came in it and was not fetched is dropped."""
        self.waiting, self._piece = [], []
        if self.latest is not None:
            (self._last_tick,) = _TICK(self.latest)
            self._last_s = self.latest_s
        self.latest = None

    def begin(self, payload: bytes, now_s: float, tick_s: float) -> bool:
        """The first telemetry of a session, before `receive`: whether the board has started since the session before,
        or this is the first session. After a reset the board has counted no more ticks than have passed."""
        tick, raw_us = _TICK_AND_TIME(payload)
        passed = (now_s - self._last_s) / tick_s
        is_first = self._last_tick < 0
        was_reset = not is_first and tick < passed + self._last_tick / 2
        self._counts.board_resets += was_reset
        self._clock.begin(tick * tick_s, raw_us, now_s)
        return is_first or was_reset

    def receive(self, payload: bytes, now_s: float) -> None:
        """Takes a `telemetry`; `stamp` follows when all that came with it was received."""
        self.latest = payload
        self.latest_s = now_s
        self._piece.append(payload)

    def stamp(self, now_s: float) -> None:
        """Stamps what came together, at that time."""
        payloads = self._piece
        if not payloads:
            return
        estimate, newest = self._clock.estimate, payloads.pop()
        board_s, host_s, bound_s = estimate.observe(_TIME(newest)[0], now_s)
        self.waiting += [(payload, *estimate.stamp_earlier(_TIME(payload)[0])) for payload in payloads]
        self.waiting.append((newest, board_s, host_s, bound_s))
        payloads.clear()
        if now_s - host_s > self._late_after_s and estimate.bounded:  # the others have come before
            self._counts.late += 1
        if (excess := len(self.waiting) - self.ROOM) > 0:
            self._counts.dropped += excess
            del self.waiting[:excess]

    def fetch(self) -> list[StampedTelemetry]:
        """What waits, oldest first."""
        found, self.waiting = self.waiting, []
        return found
