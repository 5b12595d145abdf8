"""What must arrive: requests exactly once and in order, events exactly once and in order, a stop until it is confirmed
(protocol/PROTOCOL.md, "Delivery").

State and numbers only: nothing here sends, waits or knows a clock. `session.py` passes the time in and the messages on.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from boebot.errors import BoardError, BoebotError
from boebot.link import messages

_NUMBERS = 65536
_TOKENS = 256
_PATIENCE = 1.5  # of the longest round trip
_RECENT = 8  # round trips that retries heed
_REMEMBERED = 256  # for figures

RequestKind = (
    type[messages.GetParameter]
    | type[messages.SetParameter]
    | type[messages.SaveParameters]
    | type[messages.ResetParameters]
    | type[messages.Arm]
)


class LatchedAgainError(BoardError):
    """The motors were latched off once more before they were armed."""


class TakenOverError(BoardError):
    """Another program has the board."""


class SessionLostError(BoardError):
    """The session ended while something was asked of the board; whether it was done is not known."""


@dataclass(frozen=True, kw_only=True)
class LinkTimes:
    """The link's time-outs (s). All that is None follows from tick and baud rate."""

    retry_s: float | None = None
    """an unanswered request is sent again after this; None: see `retry_after`"""
    request_limit_s: float = 2.0
    """an unanswered request is given up after this"""
    save_limit_s: float = 5.0
    """the same for saving parameters, which the board answers when the EEPROM is written"""
    stop_limit_s: float = 2.0
    """an unconfirmed stop is given up after this, where somebody waits for it"""
    open_limit_s: float | None = None
    """nothing was heard, or no session came about; None: 2 s, 4 s where opening the port resets the board"""
    probe_s: float | None = None
    """greatest time between two clock probes; None: as the clock wants it. The session may need them more often"""

    def retry_after(self, tick_s: float, byte_s: float, longest_s: float) -> float:
        """When to send a request again: one tick and 100 bytes, or 1.5 times the longest round trip lately, at most 10
        ticks and 400 bytes."""
        if self.retry_s is not None:
            return self.retry_s
        return min(max(tick_s + 100 * byte_s, _PATIENCE * longest_s), 10 * tick_s + 400 * byte_s)


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


class Request:
    """One request on its way: done when `answer` or `error` is there."""

    def __init__(self, kind: RequestKind, arguments: tuple[int, ...], what: str, limit_s: float) -> None:
        self.kind = kind
        self.arguments = arguments
        self.what = what
        """for people: what the board was asked to do, as in "arm" """
        self.limit_s = limit_s
        self.answer: messages.Answer | None = None
        self.error: BoebotError | None = None
        self.payload = b""
        self.tries = 0
        self.first_s = self.last_s = 0.0  # when it was sent
        self._number = 0

    @property
    def done(self) -> bool:
        """Whether it was answered, or given up."""
        return self.answer is not None or self.error is not None

    def numbered(self, number: int) -> None:
        """Gives it its number in the session."""
        self._number = number
        self.payload = self.kind.STRUCT.pack(number, *self.arguments)

    @property
    def number(self) -> int:
        """In the session; 0 before it has one."""
        return self._number


class Requests:
    """The host's requests of one session: one under way at a time, the others wait.

    Attributes:
        under_way: what was sent and is not yet answered.
        retransmitted, duplicate, stray: counted.
    """

    ROOM = 32  # requests that may wait

    def __init__(self) -> None:
        self.under_way: Request | None = None
        self.retransmitted = 0
        self.duplicate = 0
        self.stray = 0
        self._waiting: deque[Request] = deque()
        self._number = 0

    def add(self, request: Request) -> None:
        """Queues it.

        Raises:
            BoardError: too many wait already.
        """
        if len(self._waiting) >= self.ROOM:
            raise BoardError(f"{self.ROOM} requests wait for the board already; expected fewer at a time")
        self._waiting.append(request)

    def deadline(self) -> float:
        """When the first of those that wait is given up."""
        return min((request.first_s + request.limit_s for request in self._waiting), default=math.inf)

    def give_up_waiting(self, now_s: float, error: Callable[[Request], BoebotError]) -> None:
        """Fails those that have waited for too long for a session."""
        for request in [request for request in self._waiting if now_s >= request.first_s + request.limit_s]:
            self._waiting.remove(request)
            request.error = error(request)

    def begin(self) -> Request | None:
        """The request under way; if there is none, the next that waits gets its number and is."""
        if self.under_way is None and self._waiting:
            self._number = self._number + 1 & _NUMBERS - 1
            self.under_way = self._waiting.popleft()
            self.under_way.numbered(self._number)
        return self.under_way

    def sent(self, now_s: float) -> None:
        """The request under way was sent, or sent again."""
        request = self.under_way
        assert request is not None
        if request.tries:
            self.retransmitted += 1
        else:
            request.first_s = now_s
        request.tries += 1
        request.last_s = now_s

    def take(self, answer: messages.Answer) -> Request | None:
        """The request that this answers, now done; None: it was answered before, or never asked."""
        request = self.under_way
        if request is None or answer.number != request.number:
            if answer.number == self._number:
                self.duplicate += 1
            else:
                self.stray += 1
            return None
        request.answer = answer
        self.under_way = None
        return request

    def give_up(self, error: BoebotError) -> None:
        """The request under way was not answered in time."""
        if self.under_way is not None:
            self.under_way.error = error
            self.under_way = None

    def new_session(self) -> None:
        """Numbers begin anew."""
        self._number = 0

    def ended(self, where: str) -> None:
        """The session is over: fails what was asked in it."""
        waiting, self._waiting = self._waiting, deque()
        if self.under_way is not None:
            waiting.appendleft(self.under_way)
            self.under_way = None
        for request in waiting:
            known = "it was not done" if request.tries == 0 else "whether it was done is not known"
            request.error = SessionLostError(
                f"the session with the board at {where} ended while it was asked to {request.what}; {known}"
            )


@dataclass(frozen=True, slots=True)
class BoardEvent:
    """Something that happened on the board."""

    kind: int
    """`messages.EventKind`; a later firmware may know more"""
    value: int
    time: float
    """board time since its reset (s)"""
    earlier: bool = False
    """it happened before the session in which it was told: no host was there, or none that heard it"""

    def __str__(self) -> str:
        """As in "12.340 s: motors stopped by the dead-man"."""
        return f"{self.time:.3f} s: {self._what()}"

    def _what(self) -> str:
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
    """The board's events, each handed on once and in order, until somebody fetches them. Numbers are of one session; an
    event that was told and not acknowledged when a session ended is told again in the next.

    Attributes:
        duplicate, stray, held: counted.
    """

    ROOM = 256  # events that wait to be fetched; later ones stay with the board

    def __init__(self) -> None:
        self.waiting: deque[BoardEvent] = deque()
        self.duplicate = 0
        self.stray = 0
        self.held = 0
        self._last: int | None = None
        self._handed_on: messages.Event | None = None

    def new_session(self) -> None:
        """Numbers begin anew."""
        self._last = None

    def take(self, event: messages.Event, time_s: float, earlier: bool) -> int | None:
        """The number to acknowledge, or None: not to be acknowledged.

        Args:
            event: as it came.
            time_s: board time since its reset.
            earlier: it is of before this session.
        """
        if event.number == self._last:
            self.duplicate += 1
            return event.number
        if event.number != (0 if self._last is None else self._last) + 1 & _NUMBERS - 1:
            self.stray += 1
            return None
        if len(self.waiting) >= self.ROOM:
            self.held += 1
            return None
        again = self._last is None and self._handed_on is not None and event[1:] == self._handed_on[1:]
        self._last, self._handed_on = event.number, event
        if again:
            self.duplicate += 1
        else:
            self.waiting.append(BoardEvent(event.kind, event.value, time_s, earlier))
        return event.number

    def fetch(self) -> Iterator[BoardEvent]:
        """Takes out what waits, oldest first."""
        while self.waiting:
            yield self.waiting.popleft()


class Stopping:
    """A stop that is sent again, with the same token, until it is confirmed.

    Attributes:
        wanted: not yet confirmed.
    """

    def __init__(self) -> None:
        self.wanted = False
        self.retransmitted = 0
        self.token = 0
        self.tries = 0
        self.last_s = 0.0

    def begin(self) -> None:
        """A new stop; one that is under way already goes on under the new token."""
        self.token = (self.token + 1) % _TOKENS
        self.wanted = True
        self.tries = 0

    def sent(self, now_s: float) -> None:
        """It was sent, or sent again."""
        if self.tries:
            self.retransmitted += 1
        self.tries += 1
        self.last_s = now_s

    def take(self, token: int) -> bool:
        """Whether this confirms it."""
        if not self.wanted or token != self.token:
            return False
        self.wanted = False
        return True
