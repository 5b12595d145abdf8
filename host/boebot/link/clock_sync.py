"""The board's clock by its answers to probes, sent at irregular intervals (protocol/PROTOCOL.md, "Clock")."""

from __future__ import annotations

import random
from collections import deque

from boebot.link import messages
from boebot.link.clock import BoardClock
from boebot.link.line import NEVER, Line
from boebot.link.times import LinkTimes

_KEPT = 64  # probes that may still be answered
_IN_TIME_OUT = 4.5  # at least four, for the intervals are drawn
_WARM_UP_S = 6.0  # the clock wants many probes at first
_WARM_S = 0.02
_THEN_S = 0.05
_WARM_SIMULATED_S = 0.05  # on a line without jitter few do
_THEN_SIMULATED_S = 0.2
_BYTES_EACH = 14
_SHARE = 0.1  # of the line
_TOKENS = 1 << 16
_RECENT = 8  # round trips that retries follow
_REMEMBERED = 256  # for figures


class RoundTrips:
    """Round trips of clock probes (s)."""

    def __init__(self) -> None:
        self._seen: deque[float] = deque(maxlen=_REMEMBERED)
        self._recent: deque[float] = deque([0.0], maxlen=_RECENT)

    def add(self, took_s: float) -> None:
        """A probe was answered after `took_s`."""
        self._seen.append(took_s)
        self._recent.append(took_s)

    def longest(self) -> float:
        """Of the last eight; 0 before the first."""
        return max(self._recent)

    def quantile(self, share: float) -> float | None:
        """Of the last 256; None before the first."""
        ordered = sorted(self._seen)
        return ordered[min(int(share * len(ordered)), len(ordered) - 1)] if ordered else None


class ClockSync:
    """The probes of one link, and what follows from their answers.

    Attributes:
        estimate: the board's clock against the transport's.
        round_trips: of the probes.
        began_us: board time of the session's first telemetry; None before.
    """

    def __init__(self, line: Line, times: LinkTimes, draw: random.Random) -> None:
        """Probes by `line`; `draw` makes their intervals irregular."""
        self.round_trips = RoundTrips()
        self.began_us: int | None = None
        self._line = line
        self._times = times
        self._draw = draw
        self._token = 0  # of the newest probe
        self._waiting: dict[int, float] = {}  # token -> when it was sent, oldest first
        self._due_s = NEVER
        self._opened_s = 0.0
        realtime = line.transport.realtime
        self._warm_s, self._then_s = (_WARM_S, _THEN_S) if realtime else (_WARM_SIMULATED_S, _THEN_SIMULATED_S)
        self._renew_estimate()

    def session_opened(self, now_s: float) -> None:
        """Begins anew: the board may have been reset, or another one may be there."""
        if self._byte_s != self._line.known_byte_s:
            self._renew_estimate()
        self.estimate.forget()
        self._opened_s = self._due_s = now_s

    def session_ended(self) -> None:
        """No more probes until the next session."""
        self._waiting.clear()
        self._due_s = NEVER
        self.began_us = None

    def begin(self, tick_s: float, raw_us: int, now_s: float) -> None:
        """The session's first telemetry: its time by the count of ticks, which rolls over late, and by the clock."""
        self.estimate.expect(tick_s, now_s)
        self.began_us = self.estimate.unwrap(raw_us, now_s)

    def service(self, now_s: float, time_out_s: float) -> float:
        """Sends a probe if it is time; returns when it is the next time (s): drawn, so that no rhythm of the line hides
        its shortest delay; often enough for a session that ends after `time_out_s` of silence."""
        if now_s >= self._due_s:
            self._send_probe()
            wanted = self._warm_s if now_s - self._opened_s < _WARM_UP_S else self._then_s
            if self._times.probe_s is not None:
                wanted = self._times.probe_s
            wanted = min(max(wanted, _BYTES_EACH * self._line.byte_s / _SHARE), time_out_s / _IN_TIME_OUT)
            self._due_s = now_s + wanted * (0.5 + 0.5 * self._draw.random())
        return self._due_s

    def receive(self, payload: bytes, now_s: float) -> None:
        """Takes a `clock_answer`."""
        answer = messages.ClockAnswer.unpack(payload)
        sent_s = self._waiting.pop(answer.token, None)
        if sent_s is not None and self.began_us is not None:
            self.round_trips.add(now_s - sent_s)
            self.estimate.probe(sent_s, answer.time, now_s)

    def _send_probe(self) -> None:
        self._token = (self._token + 1) % _TOKENS
        if len(self._waiting) >= _KEPT:
            del self._waiting[next(iter(self._waiting))]
        self._waiting[self._token] = self._line.now()
        self._line.send(messages.ClockProbe(self._token))

    def _renew_estimate(self) -> None:
        self._byte_s = self._line.known_byte_s
        self.estimate = BoardClock(byte_s=self._byte_s)
