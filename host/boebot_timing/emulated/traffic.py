"""What a host sends while times are measured: a set-point each tick, or frames without a gap; and probes of the clock.

The protocol's frames to the board have 10 to 16 bytes on the wire, most answers 15: a full line carries more of them
than of longer ones, and the board has work with each.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from boebot.link import messages
from boebot_timing.emulated.line import Line
from boebot_timing.emulated.loads import Bench

SETPOINT_PERIOD = 159_001  # cycles: a prime below the tick, so at least one each tick, at each of its phases
PROBE_PERIOD = 311_009  # cycles; shares no factor with the tick
HOLD = 1_113_007  # cycles from one change of the motor signals to the next: three servo frames at least
TIME_TO_LIVE_MS = 250
SIGNALS = ((3000, -3000), (-1500, 4500))  # in 1/10000; the widths of all of them are whole cycles
EVERY_SETPOINT = 10  # frames of a full line; all others but probes are requests, whose answers fill the way back


class Change(NamedTuple):
    """A set-point that asks for other pulses than the one before: the cycle at which its last byte had come."""

    arrived: int
    signals: tuple[int, int]


class Probe(NamedTuple):
    """A question for the board's time: the cycle at which its last byte had come."""

    arrived: int
    token: int


class Traffic:
    """What all hosts do; see Source for `queue`."""

    def __init__(
        self, line: Line, first: int, signals: Sequence[tuple[int, int]] = SIGNALS, probes: bool = True
    ) -> None:
        """Begins at cycle `first`. `signals`: of the motors, one after the other; `probes`: the clock is asked for."""
        self.line, self.first = line, first
        self._choice, self._probing = signals, probes
        self.changes: list[Change] = []
        self.newest = first
        """the cycle at which the last byte of the last set-point has arrived"""
        self.probes: list[Probe] = []
        self.muted = False
        """no set-point more"""
        self._change_at = self._probe_at = self._next = first
        self._signals = self._count = 0
        self._request: Any = None

    def setpoint(self, at: int) -> None:
        """A set-point in answer to the newest telemetry; now and then another one than before."""
        changed = at >= self._change_at
        if changed:
            self._change_at += HOLD
            self._signals += 1
        signals = self._choice[self._signals % len(self._choice)]
        self.newest = arrived = self.line.send(messages.SetpointSignal(*signals, TIME_TO_LIVE_MS, self.line.tick), at)
        if changed:
            self.changes.append(Change(arrived, signals))

    def probe(self, at: int) -> bool:
        """A probe, if it is time for one."""
        if not self._probing or at < self._probe_at:
            return False
        self._probe_at += PROBE_PERIOD
        token = len(self.probes) & 0xFFFF
        self.probes.append(Probe(self.line.send(messages.ClockProbe(token), at), token))
        return True


class EachTick(Traffic):
    """A set-point each tick."""

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        del bench
        while self._next < until:
            self.setpoint(self._next)
            self.probe(self._next + SETPOINT_PERIOD // 3)
            self._next += SETPOINT_PERIOD


class FullLine(Traffic):
    """Frames back to back: set-points and requests, and as many answers."""

    def queue(self, bench: Bench, until: int) -> None:
        """See Source. The board answers a request that comes again as it answered the first time."""
        if self._request is None:
            self._request = self.line.numbered(messages.SetParameter, messages.PARAMETERS["track_width"].id, 10_000)
        while (at := max(self.first, self.line.free, bench.now)) < until:
            if self._count % EVERY_SETPOINT == 0 and not self.muted:
                self.setpoint(at)
            elif not self.probe(at):
                self.line.send(self._request, at)
            self._count += 1
