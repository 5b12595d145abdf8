"""Events of the board, each handed on once and in order (protocol/PROTOCOL.md, "Delivery")."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from boebot.link import messages
from boebot.link.clock_sync import ClockSync
from boebot.link.counters import HostCounters
from boebot.link.line import Send

_NUMBERS = 65536


@dataclass(frozen=True, slots=True)
class BoardEvent:
    """Something that happened on the board."""

    kind: int
    """`messages.EventKind`; a later firmware may know more"""
    value: int
    time: float
    """board time since its reset (s)"""
    earlier: bool = False
    """it happened before the session in which it came: no host was there, or none that received it"""

    def __str__(self) -> str:
        """As in "12.340 s: motors stopped by the dead-man"."""
        return f"{self.time:.3f} s: {self.what()}"

    def what(self) -> str:
        """What happened, in words."""
        match self.kind:
            case messages.EventKind.WHISKERS:
                pressed = [one.name.lower() for one in messages.Whiskers if self.value & one and one.name]
                return f"whiskers pressed: {', '.join(pressed) or 'none'}"
            case messages.EventKind.LATCH if self.value == messages.Latch.NONE:
                return "motors armed"
            case messages.EventKind.LATCH:
                return f"motors latched off: {messages.Latch(self.value).name.lower().replace('_', ' ')}"
            case messages.EventKind.DEAD_MAN:
                return "motors stopped by the dead-man"
            case messages.EventKind.FALLBACK:
                return f"the board's own brain {'took over' if self.value else 'drives no more'}"
        return f"event of kind {self.kind}, value {self.value}"


class Events:
    """The board's events until they are fetched: those first that happened before this session and had not been
    acknowledged (`earlier`). Numbers are of one session; an event that was not acknowledged when it ended comes again.

    Attributes:
        waiting: to be fetched, oldest first. It is the same object as long as the link lives.
    """

    ROOM = 256  # events that wait to be fetched; later ones stay with the board

    def __init__(self, send: Send, counts: HostCounters, clock: ClockSync) -> None:
        """Acknowledges by `send`; `clock` gives the events' times."""
        self.waiting: deque[BoardEvent] = deque()
        self._send = send
        self._counts = counts
        self._clock = clock
        self._last: int | None = None  # number in this session
        self._handed_on: messages.Event | None = None

    def session_opened(self) -> None:
        """Numbers begin anew."""
        self._last = None

    def fetch(self) -> list[BoardEvent]:
        """What waits, oldest first."""
        found = list(self.waiting)
        self.waiting.clear()
        return found

    def receive(self, payload: bytes, now_s: float) -> None:
        """Takes an `event`. Before the board's time is known it is not acknowledged: it comes again."""
        began_us = self._clock.began_us
        if began_us is None:
            return
        event = messages.Event.unpack(payload)
        us = self._clock.estimate.unwrap(event.time, now_s)
        if self._accept(event, us * 1e-6, us < began_us):
            self._send(messages.Acknowledge(event.number))

    def _accept(self, event: messages.Event, time_s: float, earlier: bool) -> bool:
        """Whether it is to be acknowledged."""
        if event.number == self._last:
            self._counts.duplicate += 1
            return True
        if event.number != ((self._last or 0) + 1) % _NUMBERS:
            self._counts.stray += 1
            return False
        if len(self.waiting) >= self.ROOM:
            self._counts.held += 1
            return False
        again = self._last is None and self._handed_on is not None and event[1:] == self._handed_on[1:]
        self._last, self._handed_on = event.number, event
        if again:
            self._counts.duplicate += 1
        else:
            self.waiting.append(BoardEvent(event.kind, event.value, time_s, earlier))
        return True
