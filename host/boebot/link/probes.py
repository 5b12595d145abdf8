"""Clock probes: questions for the board's time, sent at irregular intervals (protocol/PROTOCOL.md, "Clock")."""

from __future__ import annotations

import random

from boebot.link.delivery import LinkTimes

KEPT = 64  # that may still be answered
_IN_TIME_OUT = 4.5  # at least four, for the intervals are drawn
_WARM_UP_S = 6.0  # the clock wants many probes at first
_WARM_S = 0.02
_THEN_S = 0.05
_WARM_SIMULATED_S = 0.05  # on a line without jitter few do
_THEN_SIMULATED_S = 0.2
_BYTES_EACH = 14
_SHARE = 0.1  # of the line
_TOKENS = 1 << 16


class ClockProbes:
    """The probes of one link.

    Attributes:
        token: of the newest.
        waiting: token -> when it was sent (s), oldest first.
    """

    def __init__(self, realtime: bool, times: LinkTimes, draw: random.Random) -> None:
        self.token = 0
        self.waiting: dict[int, float] = {}
        self._times = times
        self._draw = draw
        self._warm_s, self._then_s = (_WARM_S, _THEN_S) if realtime else (_WARM_SIMULATED_S, _THEN_SIMULATED_S)

    def next(self, now_s: float) -> int:
        """The token of a probe that is sent now."""
        self.token = (self.token + 1) % _TOKENS
        if len(self.waiting) >= KEPT:
            del self.waiting[next(iter(self.waiting))]
        self.waiting[self.token] = now_s
        return self.token

    def due(self, now_s: float, opened_s: float, byte_s: float, time_out_s: float) -> float:
        """When to send the one after (s): drawn, so that no rhythm of the line hides its shortest delay; often enough
        for a session that ends after `time_out_s` of silence."""
        wanted = self._warm_s if now_s - opened_s < _WARM_UP_S else self._then_s
        if self._times.probe_s is not None:
            wanted = self._times.probe_s
        wanted = max(wanted, _BYTES_EACH * byte_s / _SHARE)
        return now_s + min(wanted, time_out_s / _IN_TIME_OUT) * (0.5 + 0.5 * self._draw.random())

    def answered(self, token: int) -> float | None:
        """When the probe of that token was sent; None: it was answered before, or never sent."""
        return self.waiting.pop(token, None)
