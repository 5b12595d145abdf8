"""The session with one board: it opens itself, and again when the board was reset or lost it
(protocol/PROTOCOL.md, "Session").

    listening --hello without session--> opening --hello with our session--> open
        ^                                  |  ^                                |
        +---------1 s of silence-----------+  +-----hello without session------+

The host is silent until the board's hello. Where another host has the board, the link waits until that one's session
can have ended; to a host that comes later and takes the board it gives way.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable
from typing import TypeVar

from boebot.errors import BoardError, ProtocolError
from boebot.link import finding, messages
from boebot.link.clock import RoundTrips
from boebot.link.counters import HostCounters
from boebot.link.errors import TakenOverError
from boebot.link.frame import SEED
from boebot.link.line import NEVER, Handlers, Line
from boebot.link.transport import BaudSelectable

_M = TypeVar("_M", messages.Identity, messages.Description)

_NONCES = 1 << 21
_LOOK_S = 0.02  # how often the opening looks up
_OTHER_HOST_S = 0.3  # besides its time-out; the board says hello every 0.2 s
_PATIENCE_S = 1.0  # without a hello for this long while we ask, the board has gone: silence again until the next
_DESCRIBE_S = 0.5

OPEN_LIMIT_S = 2.0
OPEN_LIMIT_RESET_S = 4.0  # where opening the port resets the board: its boot loader waits first


class Session:
    """The handshake of one link, and what the host knows by it.

    Attributes:
        hello: the board's last; None: there was none, or the link was closed.
        is_open: a session is open, as far as the host knows.
        time_out_s: silence of the host after which the board ends the session.
        handlers: of the handshake's messages.
        refused: hello of a board that cannot be spoken with; `raise_refusal` says why.
    """

    def __init__(
        self,
        line: Line,
        wait: Callable[[float], None],
        opened: Callable[[float], None],
        ended: Callable[[], None],
        *,
        counts: HostCounters,
        draw: random.Random,
        round_trips: RoundTrips,
        notices: list[str],
    ) -> None:
        """Sends nothing yet: see `open`.

        Args:
            line: to the board.
            wait: lets the link work, at the latest until that time (s); returns after each piece of bytes.
            opened: called with the time when a session is open.
            ended: called when it is over, for whatever reason.
            counts: of the link.
            draw: gives nonces.
            round_trips: on this line; questions wait for them.
            notices: gets sentences for the user.
        """
        self.hello: messages.Hello | None = None
        self.is_open = False
        self.time_out_s = 1.0
        self.refused: messages.Hello | None = None
        self._line = line
        self._wait, self._opened, self._ended = wait, opened, ended
        self._counts = counts
        self._draw = draw
        self._round_trips = round_trips
        self._notices = notices
        self._wanted = False
        self._refusing = False
        self._number = 0
        self._own_numbers: deque[int] = deque(maxlen=16)
        self._opened_with = -1  # the board's nonce that opened the session
        self._opening = messages.Open(0, 0, 0)
        self._open_due = NEVER
        self._hello_s = 0.0  # when the last one came
        self._other_host_since: float | None = None
        self._replaced_since = NEVER  # a hello said so; a late copy of an old one may have
        self._answers: list[messages.Identity | messages.Description] = []
        self.handlers: Handlers = {
            messages.Hello.ID: self.receive_hello,
            messages.Identity.ID: lambda payload, _: self._answers.append(messages.Identity.unpack(payload)),
            messages.Description.ID: lambda payload, _: self._answers.append(messages.Description.unpack(payload)),
        }

    @property
    def tick_s(self) -> float:
        """The board's control tick."""
        return 1.0 / self.hello.tick_rate if self.hello is not None and self.hello.tick_rate else 0.01

    @property
    def telemetry_s(self) -> float:
        """From one telemetry to the next."""
        assert self.hello is not None, "a session is open"
        return self.hello.telemetry_period * self.tick_s

    # ---- opening and ending ------------------------------------------------------------------------------------------

    def open(self, limit_s: float | None = None) -> None:
        """See `Link.open`."""
        line, transport = self._line, self._line.transport
        if limit_s is None:
            limit_s = OPEN_LIMIT_RESET_S if getattr(transport, "resets_board", False) else OPEN_LIMIT_S
        search = finding.BoardSearch(transport, limit_s)
        self._wanted = True
        self._other_host_since = None
        held = b""
        if transport.realtime and self.hello is None:
            held = transport.read(0.0)  # what the port has held is of an earlier time
        line.listener = search.listen
        try:
            while not self.is_open:
                now = line.now()
                if self._other_host_since is not None:
                    if now - self._other_host_since > self.time_out_s + _OTHER_HOST_S:  # it is still there
                        raise TakenOverError(f"the board at {transport.name} is busy: another program drives it")
                elif now >= search.end_s:
                    raise search.failure(self.hello, line.decoder.good, line.decoder.bad)
                elif self.hello is None and (baud := search.next_baud(now)) is not None:
                    line.change_baud(baud)
                self._wait(now + _LOOK_S)
        except BoardError as error:
            raise (search.explained(error, held) if self.hello is None else error) from None
        finally:
            line.listener = None
        if search.changed:
            self._report_baud(search)

    def close(self) -> None:
        """Ends the session at once; sends nothing more until `open`."""
        self._wanted = False
        if self.is_open:
            self._line.send(messages.Close(self._number))
            self._end()
        self._open_due = NEVER
        self._use_number(0)
        self.hello = None

    def restart(self, now_s: float) -> None:
        """Ends the session and begins another."""
        self._end()
        self._begin(now_s)

    def confirm(self, latest_s: float) -> None:
        """Something of this session came then: no other host has replaced it before."""
        if latest_s >= self._replaced_since:
            self._replaced_since = NEVER

    def service(self, now_s: float) -> float:
        """While no session is open: sends the open that is due; returns when it is the next time (s)."""
        if now_s - self._hello_s > _PATIENCE_S:
            self._open_due = NEVER
        elif now_s >= self._open_due:
            self._line.send(self._opening)
            self._open_due = now_s + self._retry_s
        return self._open_due

    @property
    def _retry_s(self) -> float:
        return 2 * self.tick_s + 100 * self._line.byte_s

    def _begin(self, now_s: float) -> None:
        """Draws a session for the nonce of the board's last hello; its first open is due at once."""
        assert self.hello is not None
        board_nonce = self.hello.board_nonce
        number = 0
        while number in (0, SEED) or number in self._own_numbers:
            host_nonce = self._draw.randrange(_NONCES)
            number = board_nonce ^ host_nonce
        self._own_numbers.append(number)
        self._opened_with = board_nonce
        self._other_host_since = None
        self._opening = messages.Open(messages.PROTOCOL_VERSION, board_nonce, host_nonce)
        self._open_due = now_s
        self._use_number(number)  # the board may use it in the same breath as its hello

    def _use_number(self, number: int) -> None:
        self._number = number
        self._line.use_session(number)

    def _confirmed(self, now_s: float) -> None:
        """The board has confirmed our session."""
        decoder = self._line.decoder
        if self._counts.sessions == 0:
            decoder.bad = decoder.lost = decoder.resynchronised = 0  # leftovers of another session
        self.is_open = True
        self._other_host_since = None
        self._counts.sessions += 1
        self._open_due = NEVER
        self._opened(now_s)

    def _end(self) -> None:
        self.is_open = False
        self._ended()

    def _report_baud(self, search: finding.BoardSearch) -> None:
        """The board was found at another rate than asked for."""
        transport = self._line.transport
        found = f"the board at {transport.name} speaks at {search.baud} baud, not at {search.asked}"
        if isinstance(transport, BaudSelectable) and transport.baud_given:
            self.close()
            raise ProtocolError(f"{found} as asked for")
        self._notices.append(found)

    # ---- hellos ------------------------------------------------------------------------------------------------------

    def receive_hello(self, payload: bytes, now_s: float) -> None:
        """Takes a `hello`.

        Raises:
            TakenOverError: another host has taken the board.
        """
        hello = messages.Hello.unpack(payload)
        if not finding.speaks_alike(hello):
            self.refused = hello
            return
        self._hello_s = now_s
        self.time_out_s = hello.session_time_out / 1000
        if hello.session and hello.session == self._number:
            self.hello = hello
            self._replaced_since = NEVER
            if not self.is_open:
                self._confirmed(now_s)
        elif hello.session == 0 or hello.session in self._own_numbers:
            self._receive_no_session(hello, now_s)
        else:
            self._receive_other_host(hello, now_s)

    def _receive_no_session(self, hello: messages.Hello, now_s: float) -> None:
        if self.is_open:
            if hello.board_nonce == self._opened_with:
                return  # it was sent before the session was opened, and has come late
            self._counts.sessions_lost += 1
            self._end()
        self.hello = hello
        if self._wanted and (self._open_due == NEVER or hello.board_nonce != self._opened_with):
            self._begin(now_s)

    def _receive_other_host(self, hello: messages.Hello, now_s: float) -> None:
        if self.is_open:
            # a late copy of an earlier hello says the same, but then telemetry of ours goes on
            self._replaced_since = min(self._replaced_since, now_s)
            if now_s - self._replaced_since < self.tick_s * max(10, 2 * hello.telemetry_period):
                return
            self._counts.sessions_lost += 1
            self._end()
            self._use_number(0)
            raise TakenOverError(f"another program has taken the board at {self._line.transport.name}")
        self.hello = hello
        self._open_due = NEVER
        if self._other_host_since is None:
            self._other_host_since = now_s

    # ---- questions of the handshake ----------------------------------------------------------------------------------

    def ask(
        self,
        question: messages.Identify | messages.Describe,
        kind: type[_M],
        what: str,
        limit_s: float,
        accept: Callable[[_M], bool] = lambda _: True,
    ) -> _M:
        """Sends a question of the handshake, again and again while it stays unanswered; returns the answer.

        Raises:
            BoardError: none came within `limit_s`; `what`: what the board did not do then.
        """
        line = self._line
        now = line.now()
        end = now + limit_s
        self._answers = []
        while now < end:
            line.send(question)
            until = min(now + max(self._retry_s, 2 * self._round_trips.longest()), end)
            while (now := line.now()) < until:
                self._wait(until)
                answers, self._answers = self._answers, []
                for answer in answers:
                    if isinstance(answer, kind) and accept(answer):
                        return answer
        raise BoardError(f"the board at {line.transport.name} did not {what}")

    def raise_refusal(self) -> None:
        """Raises why the board of `refused` cannot be spoken with, unless that is being found out already."""
        hello, self.refused = self.refused, None
        if hello is None or self._refusing:
            return
        self._refusing = True
        try:
            self._open_due = NEVER
            if self.is_open:
                self._end()
            raise finding.refusal(hello, self._line.transport.name, lambda index: self._describe(hello, index))
        finally:
            self._refusing = False

    def _describe(self, hello: messages.Hello, index: int) -> messages.Description:
        """What the board says of message `index` of its table."""
        if hello.session:
            raise BoardError(f"the board at {self._line.transport.name} has a session with another host")
        return self.ask(
            messages.Describe(index, hello.board_nonce),
            messages.Description,
            f"describe message {index}",
            _DESCRIBE_S,
            lambda answer: answer.index == index,
        )
