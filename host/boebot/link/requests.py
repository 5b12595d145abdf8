"""Requests to the board, each carried out exactly once and in order (protocol/PROTOCOL.md, "Delivery")."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from boebot.errors import BoardError, BoebotError
from boebot.link import messages
from boebot.link.counters import HostCounters
from boebot.link.errors import SessionLostError
from boebot.link.line import NEVER, Send

_NUMBERS = 65536

RequestKind = (
    type[messages.GetParameter]
    | type[messages.SetParameter]
    | type[messages.SaveParameters]
    | type[messages.ResetParameters]
    | type[messages.Arm]
)


class Request:
    """One request: done when `answer` or `error` is there."""

    def __init__(self, kind: RequestKind, arguments: tuple[int, ...], what: str, limit_s: float) -> None:
        self.kind = kind
        self.arguments = arguments
        self.what = what
        """for people: what the board was asked to do, as in "arm" """
        self.limit_s = limit_s
        self.answer: messages.Answer | None = None
        self.error: BoebotError | None = None
        self.number = 0  # in the session; 0: it has none yet
        self.tries = 0
        self.first_s = 0.0  # when it was submitted; then, when it was first sent
        self.last_s = 0.0  # when it was last sent

    @property
    def done(self) -> bool:
        """Whether it was answered, or given up."""
        return self.answer is not None or self.error is not None


def check(answer: messages.Answer, where: str, what: str) -> None:
    """Raises BoardError unless the board at `where` agrees; `what`: what it does instead, for the sentence."""
    if answer.status != messages.AnswerStatus.OK:
        reason = messages.AnswerStatus(answer.status).name.lower().replace("_", " ")
        raise BoardError(f"the board at {where} {what}: {reason}")


class Requests:
    """The requests of one link: one is under way at a time, the others wait."""

    ROOM = 32  # requests that may wait

    def __init__(self, send: Send, counts: HostCounters, where: str, restart: Callable[[float], None]) -> None:
        """Sends by `send` to the board at `where`. `restart` begins another session: a board that does not
        answer a request still expects its number."""
        self._send = send
        self._counts = counts
        self._where = where
        self._restart = restart
        self._under_way: Request | None = None
        self._waiting: deque[Request] = deque()
        self._number = 0

    def submit(self, request: Request, now_s: float) -> None:
        """Queues it.

        Raises:
            BoardError: too many wait already.
        """
        if len(self._waiting) >= self.ROOM:
            raise BoardError(f"{self.ROOM} requests wait for the board already; expected fewer at a time")
        request.first_s = now_s
        self._waiting.append(request)

    def service(self, now_s: float, retry_s: float) -> float:
        """In a session: sends a request that is due; returns when it is the next time (s)."""
        request = self._under_way
        if request is None:
            if not self._waiting:
                return NEVER
            request = self._under_way = self._waiting.popleft()
            self._number = request.number = (self._number + 1) % _NUMBERS
        if request.tries and now_s < request.last_s + retry_s:
            return request.last_s + retry_s
        if request.tries and now_s >= request.first_s + request.limit_s:
            request.error = BoardError(
                f"the board at {self._where} did not {request.what} within {request.limit_s:g} s, "
                f"though asked {request.tries} times"
            )
            self._under_way = None
            self._restart(now_s)
            return NEVER
        self._send(request.kind(request.number, *request.arguments))
        if request.tries:
            self._counts.retransmitted += 1
        else:
            request.first_s = now_s
        request.tries += 1
        request.last_s = now_s
        return now_s + retry_s

    def service_waiting(self, now_s: float) -> float:
        """Without a session: gives up what waits for too long; returns when the next of them is given up (s)."""
        for request in [request for request in self._waiting if now_s >= request.first_s + request.limit_s]:
            self._waiting.remove(request)
            request.error = BoardError(
                f"the board at {self._where} was to {request.what}, but no session came about within "
                f"{request.limit_s:g} s"
            )
        return min((request.first_s + request.limit_s for request in self._waiting), default=NEVER)

    def receive(self, payload: bytes) -> Request | None:
        """Takes an `answer`: the request that is now done, or None: that was answered before, or never asked."""
        answer = messages.Answer.unpack(payload)
        request = self._under_way
        if request is None or answer.number != request.number:
            if answer.number == self._number:
                self._counts.duplicate += 1
            else:
                self._counts.stray += 1
            return None
        request.answer = answer
        self._under_way = None
        return request

    def session_opened(self) -> None:
        """Numbers begin anew."""
        self._number = 0

    def session_ended(self) -> None:
        """Fails what was asked in it."""
        waiting, self._waiting = self._waiting, deque()
        if self._under_way is not None:
            waiting.appendleft(self._under_way)
            self._under_way = None
        for request in waiting:
            known = "it was not done" if request.tries == 0 else "whether it was done is not known"
            request.error = SessionLostError(
                f"the session with the board at {self._where} ended while it was asked to {request.what}; {known}"
            )
