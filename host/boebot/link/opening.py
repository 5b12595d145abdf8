"""The session with one board: it opens itself, and again when the board was reset or lost it
(protocol/PROTOCOL.md, "Session").

    listening --hello without session--> opening --hello with our session--> open
        ^                                  |  ^                                |
        +---------1 s of silence-----------+  +-----hello without session------+

The host is silent until the board's hello. Where another host has the board, the link waits until that one's session
can have ended; a host that comes later and takes the board is given way.
"""

from __future__ import annotations

import random
import secrets
from collections import deque
from collections.abc import Callable
from typing import TypeVar

from boebot.errors import BoardError, ProtocolError
from boebot.link import finding, messages, mismatch
from boebot.link.clock import BoardClock
from boebot.link.delivery import LinkTimes, RoundTrips, TakenOverError
from boebot.link.frame import NO_SESSION, SEED
from boebot.link.line import NEVER, SHORTEST_S, Append, Line
from boebot.link.transport import BaudSelectable, Transport

_M = TypeVar("_M")

_NONCES = 1 << 21
_LOOK_S = 0.02  # how often the opening looks up
_OTHER_HOST_S = 0.3  # besides its patience; the board says hello every 0.2 s
_PATIENCE_S = 1.0  # a board that says no hello for so long while we ask has gone: silence again until it does

OPEN_LIMIT_S = 2.0
OPEN_LIMIT_RESET_S = 4.0  # where opening the port resets the board: its boot loader waits first


class Opening(Line):
    """A line with a session.

    Attributes:
        times: time-outs.
        is_open: a session is open, as far as was heard.
        sessions: how many were opened; a change means that the board is latched and may have forgotten everything.
        sessions_lost: how many ended without the host's wish.
        clock: the board's clock against the transport's.
        round_trips: of clock probes.
        notices: what a user should be told, in sentences; whoever shows them takes them out.
    """

    def __init__(self, transport: Transport, record: Append | None, times: LinkTimes, take_over: bool) -> None:
        self.times = times
        self.is_open = False
        self.sessions = 0
        self.sessions_lost = 0
        self.round_trips = RoundTrips()
        self.notices: list[str] = []
        self._take_over = take_over
        self._wanted = False  # a session
        self._refusing = False
        self._own_sessions: deque[int] = deque(maxlen=16)
        self._opened_with = -1  # the board's nonce that opened the session
        self._open_payload = b""
        self._open_due = NEVER
        self._greeted_s = 0.0  # when the last hello came
        self._foreign_since: float | None = None  # since when another host is known to have the board
        self._replaced_since = NEVER  # a hello said so; a late copy of an old one may have
        self._opened_s = 0.0
        self._time_out_s = 1.0  # of the board's patience
        # in simulated time a run has to be the same each time; on a real line no session's seed may come again
        self._draw = random.Random("link") if not transport.realtime else random.Random(secrets.randbits(64))
        self._answers: list[messages.Identity | messages.Description] = []
        super().__init__(transport, record)
        self._handlers |= {
            messages.Hello.ID: self._hear_hello,
            messages.Identity.ID: lambda payload, _: self._answers.append(messages.Identity.unpack(payload)),
            messages.Description.ID: lambda payload, _: self._answers.append(messages.Description.unpack(payload)),
        }

    def open(self, limit_s: float | None = None) -> messages.Hello:
        """Waits for the board's hello, checks that both speak the same protocol, and opens a session.

        Finds the baud rate where the transport can change it. Returns at once if a session is open.

        Args:
            limit_s: by the transport's clock; None: as `LinkTimes.open_limit_s` says.

        Raises:
            BoardError: nobody answers, or the board has gone.
            ProtocolError: something else speaks, or another version of this protocol.
        """
        if limit_s is None:
            limit_s = self.times.open_limit_s
        if limit_s is None:
            limit_s = OPEN_LIMIT_RESET_S if getattr(self.transport, "resets_board", False) else OPEN_LIMIT_S
        if self.is_open:
            assert self.hello is not None
            return self.hello
        search = finding.BaudSearch(self.transport, limit_s)
        self._wanted = True
        self._foreign_since = None
        if self.transport.realtime and self.hello is None:
            self.transport.read(0.0)  # what the port has held is of an earlier time
        while not self.is_open:
            now = self._now()
            if self._foreign_since is not None:
                self._wait_for_other_host(now)
            elif now >= search.end_s:
                counts = self.decoder.good, self.decoder.bad
                raise self._heard.verdict(self.transport, limit_s, self.hello, counts)
            elif self.hello is None:
                baud = search.next_baud(now, self._heard)
                if baud is not None:
                    self._change_baud(baud)
            self._turn(search.look_again_s(now) if self.hello is None else now + _LOOK_S)
        if search.changed:
            self._tell_baud(search)
        self._open_told()
        assert self.hello is not None
        return self.hello

    def close(self) -> None:
        """Ends the session at once, so that the board is free for others; it latches its motors off. The port stays
        open."""
        self._wanted = False
        if self.is_open:
            self._send(messages.Close.ID, messages.Close.STRUCT.pack(self._session))
            self._end_session()
        self._open_due = self._due = NEVER
        self._session = 0
        self.decoder.seed = NO_SESSION
        self.hello = None

    @property
    def _tick_s(self) -> float:
        return 1.0 / self.hello.tick_rate if self.hello is not None and self.hello.tick_rate else 0.01

    @property
    def _handshake_retry_s(self) -> float:
        return 2 * self._tick_s + 100 * self.byte_s

    def _learn_baud(self) -> None:
        super()._learn_baud()
        self.clock = BoardClock(byte_s=self.line_s)

    # ---- opening and ending ------------------------------------------------------------------------------------------

    def _service_opening(self, now: float) -> float:
        if self._open_due == NEVER:
            return NEVER
        if now - self._greeted_s > _PATIENCE_S:  # it fell silent: so do we
            self._open_due = NEVER
        elif now >= self._open_due:
            self._send(messages.Open.ID, self._open_payload)
            self._open_due = now + self._handshake_retry_s
        return self._open_due

    def _begin_opening(self, now: float) -> None:
        """Draws a session for the nonce of the board's last hello; its first open is due at once."""
        assert self.hello is not None
        board_nonce = self.hello.board_nonce
        session = 0
        while session in (0, SEED) or session in self._own_sessions:
            host_nonce = self._draw.randrange(_NONCES)
            session = board_nonce ^ host_nonce
        self._session = session
        self._own_sessions.append(session)
        self._opened_with = board_nonce
        self._foreign_since = None
        self._open_payload = messages.Open(messages.PROTOCOL_VERSION, board_nonce, host_nonce).pack()
        self._open_due = now
        self._due = -NEVER
        self.decoder.seed = session  # the board may use it in the same breath as its hello

    def _opened(self, now: float) -> None:
        """The board has confirmed our session."""
        self._opened_s = now
        if self.sessions == 0:
            self.decoder.bad = self.decoder.lost = self.decoder.resynchronised = 0  # leftovers of another session
        self.is_open = True
        self._foreign_since = None
        self._replaced_since = NEVER
        self.sessions += 1
        self._open_due = NEVER
        self.clock.forget()
        self._due = -NEVER

    def _end_session(self) -> None:
        """The session is over, for whatever reason."""
        self.is_open = False
        self._due = -NEVER

    def _open_told(self) -> None:
        """The session that `open` waited for is there: what a user should know of it."""

    def _wait_for_other_host(self, now: float) -> None:
        """Another host has the board: takes it over if so wished, or gives up when that one is still there."""
        assert self._foreign_since is not None
        if self._take_over:
            self._begin_opening(now)
        elif now - self._foreign_since > self._time_out_s + _OTHER_HOST_S:
            raise TakenOverError(f"the board at {self.transport.name} is busy: another program drives it")

    def _tell_baud(self, search: finding.BaudSearch) -> None:
        """The board was found at another rate than asked for."""
        where = self.transport.name
        if isinstance(self.transport, BaudSelectable) and self.transport.baud_given:
            self.close()
            raise ProtocolError(
                f"the board at {where} speaks at {search.baud} baud, not at {search.asked} as asked for"
            )
        self.notices.append(f"the board at {where} speaks at {search.baud} baud, not at {search.asked}")

    # ---- what comes --------------------------------------------------------------------------------------------------

    def _hear_hello(self, payload: bytes, now: float) -> None:
        hello = messages.Hello.unpack(payload)
        if not mismatch.speaks_alike(hello):
            self._refused = hello
            return
        self._greeted_s = now
        self._time_out_s = hello.session_time_out / 1000
        if hello.session and hello.session == self._session:
            self.hello = hello
            self._replaced_since = NEVER
            if not self.is_open:
                self._opened(now)
        elif hello.session == 0 or hello.session in self._own_sessions:
            self._hear_no_session(hello, now)
        else:
            self._hear_other_host(hello, now)

    def _hear_no_session(self, hello: messages.Hello, now: float) -> None:
        if self.is_open:
            if hello.board_nonce == self._opened_with:
                return  # it was said before the session was opened, and has come late
            self.sessions_lost += 1
            self._end_session()
        self.hello = hello
        if not self._wanted:
            return
        if self._open_due == NEVER or hello.board_nonce != self._opened_with:
            self._begin_opening(now)

    def _hear_other_host(self, hello: messages.Hello, now: float) -> None:
        if self.is_open:
            # a late copy of an earlier hello says the same, but then telemetry of ours goes on
            self._replaced_since = min(self._replaced_since, now)
            if now - self._replaced_since < self._tick_s * max(10, 2 * hello.telemetry_period):
                return
            self.sessions_lost += 1
            self._end_session()
            self._session = 0
            raise TakenOverError(f"another program has taken the board at {self.transport.name}")
        self.hello = hello
        self._open_due = NEVER
        if self._foreign_since is None:
            self._foreign_since = now

    # ---- questions of the handshake ----------------------------------------------------------------------------------

    def identity(self) -> messages.Identity:
        """Which image runs on the board."""
        return self._ask(messages.Identify(), messages.Identity, lambda _: True, "say which image it runs")

    def _ask(
        self,
        question: messages.Identify | messages.Describe,
        kind: type[_M],
        accept: Callable[[_M], bool],
        what: str,
        limit_s: float | None = None,
    ) -> _M:
        """Sends a question of the handshake, again and again while it stays unanswered; returns the answer."""
        now = self._now()
        end = now + (self.times.request_limit_s if limit_s is None else limit_s)
        self._answers = []
        payload = question.pack()
        while now < end:
            self._send(question.ID, payload)
            until = min(now + max(self._handshake_retry_s, 2 * self.round_trips.longest()), end)
            while (now := self._now()) < until:
                if now >= self._due:
                    self._service(now)
                self._receive(max(min(until, self._due) - now, SHORTEST_S), 0.0)
                for answer in self._answers:
                    if isinstance(answer, kind) and accept(answer):
                        return answer
                self._answers = []
        raise BoardError(f"the board at {self.transport.name} did not {what}")

    def _refuse(self) -> None:
        if self._refused is None or self._refusing:
            return
        self._refusing = True
        try:
            raise self._refusal(self._refused)
        finally:
            self._refusing = False

    def _refusal(self, hello: messages.Hello) -> ProtocolError:
        """Why the board that said this cannot be spoken with."""
        self._refused = None
        self._due = NEVER
        if self.is_open:
            self._end_session()

        def describe(index: int) -> messages.Description:
            if hello.session:
                raise BoardError(f"the board at {self.transport.name} has a session with another host")
            return self._ask(
                messages.Describe(index, hello.board_nonce),
                messages.Description,
                lambda said: said.index == index,
                f"describe message {index}",
                limit_s=0.5,
            )

        return mismatch.refusal(hello, self.transport.name, describe)
