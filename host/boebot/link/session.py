"""The link to one board: a session that opens itself, delivery of what must arrive, telemetry and set-points
(protocol/PROTOCOL.md).

    listening --hello without session--> opening --hello with our session--> open
        ^                                  |  ^                                |
        +---------1 s of silence-----------+  +-----hello without session------+

The host is silent until the board's hello. When the board was reset, or has not heard the host for too long, its next
hello tells, and the link opens a new session by itself: `sessions` counts them, and who configured and armed the board
does it again. All of that happens inside whatever call waits for the board. Where another host has the board, the link
waits until that one's session can have ended; a host that comes later and takes the board is given way.

Everything that crossed the wire is kept with its stamp when `record` is true.
"""

from __future__ import annotations

import math
import random
import secrets
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from boebot.errors import BoardError, BoebotError, ProtocolError
from boebot.link import finding, messages
from boebot.link.clock import BoardClock
from boebot.link.counters import BoardCounters, HostCounters
from boebot.link.delivery import (
    BoardEvent,
    Events,
    LatchedAgainError,
    LinkTimes,
    Request,
    RequestKind,
    Requests,
    RoundTrips,
    Stopping,
    TakenOverError,
)
from boebot.link.frame import NO_SESSION, SEED, Decoder, encode
from boebot.link.transport import BaudSelectable, CountsOverruns, Stamping, Transport

_M = TypeVar("_M")
Telemetry = tuple[bytes, float, float, float]
"""(payload, board time of its tick in s, host time of that in s, error bound of the host time in s)"""

_TELEMETRY = messages.Telemetry.ID
_SIGNAL = messages.SetpointSignal
_SPEED = messages.SetpointSpeed
_COAST = messages.SetpointCoast
_TIME_OUT = messages.PARAMETERS["session_time_out"]
_PERIOD = messages.PARAMETERS["telemetry_period"]

_NONCES = 1 << 21
_BAUD = 500_000  # assumed for time-outs where the transport cannot tell
_BITS_PER_BYTE = 10
_LOOK_S = 0.02  # how often the opening looks up
_OTHER_HOST_S = 0.3  # besides its patience; the board says hello every 0.2 s
_STOP_BYTES = 20
_PERIODS_LATE = 3  # telemetry that comes later than so many of its periods after its tick is counted
_SHORTEST_S = 1e-4  # a wait that rounds to nothing would never end on a clock that only waits advance
_NEVER = math.inf
_PATIENCE_S = 1.0  # a board that says no hello for so long while we ask has gone: silence again until it does
_TELEMETRY_ROOM = 4096  # messages that nobody fetched
_PROBES_KEPT = 64  # that may still be answered
_PROBES_IN_TIME_OUT = 4.5  # at least four, for the intervals are drawn
_WARM_UP_S = 6.0  # the clock wants many probes at first
_WARM_PROBE_S = 0.02
_PROBE_S = 0.05
_WARM_PROBE_SIMULATED_S = 0.05  # on a line without jitter few do
_PROBE_SIMULATED_S = 0.2
_PROBE_BYTES_EACH = 14
_PROBE_SHARE = 0.1  # of the line
_BUSY_AGAIN_S = 0.05  # while the EEPROM is being written
_ARM_TRIES = 5

# offsets in telemetry
_SUPPLY = 30
_LATCHES = 35

OPEN_LIMIT_S = 2.0
OPEN_LIMIT_RESET_S = 4.0  # where opening the port resets the board: its boot loader waits first


def text(field: bytes) -> str:
    """A text field of a message without its padding."""
    return field.split(b"\0", 1)[0].decode("utf-8", errors="replace")


class Link:
    """The host's end of the link to one board.

    Attributes:
        transport: where the bytes go.
        times: time-outs.
        hello: what the board said of itself last.
        is_open: a session is open, as far as was heard.
        sessions: how many were opened; a change means that the board is latched and may have forgotten everything.
        board_resets: how many of their ends were resets of the board; noticed by its count of ticks.
        sessions_lost: how many ended without the host's wish.
        byte_s: time that a byte needs on the line (s).
        clock: the board's clock against the transport's.
        latest: the newest telemetry of this session, or None.
        notices: what a user should be told, in sentences; whoever shows them takes them out.
        sent, received: (time in s on the transport's clock, bytes), oldest first, if recorded.
    """

    def __init__(
        self, transport: Transport, record: bool = True, times: LinkTimes | None = None, take_over: bool = False
    ) -> None:
        """Nothing is sent yet: see `open`.

        Args:
            transport: where the board is.
            record: keep all that crosses the wire.
            times: time-outs, if not the usual ones.
            take_over: take the board even if another host has it.
        """
        self.transport = transport
        self.times = times or LinkTimes()
        self.decoder = Decoder(NO_SESSION)
        self.hello: messages.Hello | None = None
        self.is_open = False
        self.sessions = 0
        self.board_resets = 0
        self.sessions_lost = 0
        self.latest: bytes | None = None
        self.round_trips = RoundTrips()
        self.board_counters = BoardCounters()
        self.notices: list[str] = []
        self.sent: list[tuple[float, bytes]] = []
        self.received: list[tuple[float, bytes]] = []
        self._record = record
        self._sequence = 0
        self._telemetry: list[Telemetry] = []
        self._dropped = 0
        self._late = 0
        self._late_after_s = _NEVER  # three telemetry periods
        self._take_over = take_over
        self._wanted = False  # a session
        self._refusing = False
        self._heard = finding.Heard()
        self._refused: messages.Hello | None = None
        self._session = 0
        self._own_sessions: deque[int] = deque(maxlen=16)
        self._opened_with = -1  # the board's nonce that opened the session
        self._open_payload = b""
        self._open_due = _NEVER
        self._greeted_s = 0.0  # when the last hello came
        self._foreign_since: float | None = None  # since when another host is known to have the board
        self._replaced_since = _NEVER  # a hello said so; a late copy of an old one may have
        self._last_tick = -1  # of the session before
        self._last_heard_s = 0.0
        self._latest_s = 0.0
        self._due = _NEVER  # when something is to be sent next
        self._requests = Requests()
        self._events = Events()
        self._stopping = Stopping()
        self._probes: dict[int, float] = {}  # token -> when it was sent
        self._probe_token = 0
        self._probe_due = _NEVER
        self._opened_s = 0.0
        self._time_out_s = 1.0  # of the board's patience
        # in simulated time a run has to be the same each time; on a real line no session's seed may come again
        self._draw = random.Random("link") if not transport.realtime else random.Random(secrets.randbits(64))
        self._read = transport.read_stamped if isinstance(transport, Stamping) else partial(_stamp_now, transport)
        self._learn_baud()
        self._answers: list[messages.Identity | messages.Description] = []
        self._handlers: dict[int, Callable[[bytes, float], None]] = {
            messages.Hello.ID: self._hear_hello,
            messages.Identity.ID: lambda payload, _: self._answers.append(messages.Identity.unpack(payload)),
            messages.Description.ID: lambda payload, _: self._answers.append(messages.Description.unpack(payload)),
            messages.Answer.ID: self._hear_answer,
            messages.Event.ID: self._hear_event,
            messages.Stopped.ID: self._hear_stopped,
            messages.Counters.ID: self._hear_counters,
            messages.ClockAnswer.ID: self._hear_clock,
        }

    # ---- session -------------------------------------------------------------------------------------------

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
            now = self.transport.now()
            if self._foreign_since is not None:
                self._wait_for_other_host(now)
            elif now >= search.end_s:
                raise self._heard.verdict(self.transport, limit_s, greeted=self.hello is not None)
            elif self.hello is None:
                baud = search.next_baud(now, self._heard)
                if baud is not None:
                    self._change_baud(baud)
            self._turn(search.look_again_s(now) if self.hello is None else now + _LOOK_S)
        if search.changed:
            self._tell_baud(search)
        self._tell_thinning()
        assert self.hello is not None
        return self.hello

    def close(self) -> None:
        """Ends the session at once, so that the board is free for others; it latches its motors off. The port stays
        open."""
        self._wanted = False
        if self.is_open:
            self._send(messages.Close.ID, messages.Close.STRUCT.pack(self._session))
            self._end_session()
        self._open_due = self._due = _NEVER
        self._session = 0
        self.decoder.seed = NO_SESSION
        self.hello = None

    def identity(self) -> messages.Identity:
        """Which image runs on the board."""
        return self._ask(messages.Identify(), messages.Identity, lambda _: True, "say which image it runs")

    def counters(self) -> HostCounters:
        """What the host's end has counted."""
        requests, events, decoder = self._requests, self._events, self.decoder
        return HostCounters(
            good=decoder.good,
            bad=decoder.bad,
            resynchronised=decoder.resynchronised,
            lost=decoder.lost,
            retransmitted=requests.retransmitted + self._stopping.retransmitted,
            duplicate=requests.duplicate + events.duplicate,
            stray=requests.stray + events.stray,
            overrun=self.transport.overruns if isinstance(self.transport, CountsOverruns) else 0,
            dropped=self._dropped,
            late=self._late,
            held=events.held,
            sessions=self.sessions,
            board_resets=self.board_resets,
            sessions_lost=self.sessions_lost,
        )

    # ---- telemetry, events, set-points ---------------------------------------------------------------------

    def poll(self, wait_s: float, quiet_s: float = 0.0) -> list[Telemetry]:
        """The telemetry that arrived, oldest first; waits for some as `Transport.read` does, and keeps the session
        alive meanwhile. Opens a new session if need be: see `sessions`.

        Raises:
            BoardError: the board has gone, or another program keeps taking it.
            ProtocolError: a board of another protocol has come in its place.
        """
        now = self.transport.now()
        end = now + wait_s
        look = now + quiet_s
        while True:
            if now >= self._due:
                self._service(now)
            wait = min(end, self._due) - now
            self._receive(wait if wait > _SHORTEST_S else _SHORTEST_S, min(look - now, wait) if look > now else 0.0)
            now = self.transport.now()
            if (self._telemetry and now >= look) or now >= end:
                telemetry = self._telemetry
                self._telemetry = []
                return telemetry

    def fetch_telemetry(self) -> list[Telemetry]:
        """The telemetry that arrived while somebody waited for an answer; does not wait."""
        telemetry, self._telemetry = self._telemetry, []
        return telemetry

    def forget_telemetry(self) -> None:
        """Drops the telemetry that arrived while somebody waited for an answer."""
        self._telemetry = []

    def events(self) -> list[BoardEvent]:
        """What happened on the board since the last call, in order. Events that nobody fetches are, after some, no
        longer acknowledged, so that the board keeps them."""
        return list(self._events.fetch()) if self._events.waiting else []

    def send_signal(self, left: float, right: float, time_to_live_ms: int, tick: int) -> None:
        """Motor signals -1..1, in answer to the observation of `tick`."""
        self._send(
            _SIGNAL.ID,
            _SIGNAL.STRUCT.pack(round(left * 10000), round(right * 10000), time_to_live_ms, tick & 0xFFFF),
        )

    def send_speed(self, left_m_s: float, right_m_s: float, time_to_live_ms: int, tick: int) -> None:
        """Wheel speeds along the ground (m/s), in answer to the observation of `tick`."""
        self._send(
            _SPEED.ID,
            _SPEED.STRUCT.pack(round(left_m_s * 10000), round(right_m_s * 10000), time_to_live_ms, tick & 0xFFFF),
        )

    def send_coast(self, time_to_live_ms: int, tick: int) -> None:
        """No pulses, in answer to the observation of `tick`; nothing is latched."""
        self._send(_COAST.ID, _COAST.STRUCT.pack(time_to_live_ms, tick & 0xFFFF))

    # ---- stop ----------------------------------------------------------------------------------------------

    def stop(self) -> None:
        """Stops the motors and latches them off until `arm`. Sent again, while anybody waits for the board, until it
        is confirmed."""
        self._stopping.begin()
        self._service(self.transport.now())

    @property
    def stop_under_way(self) -> bool:
        """Whether a stop was not yet confirmed."""
        return self._stopping.wanted

    def stop_and_confirm(self, limit_s: float | None = None) -> bool:
        """Stops the motors and waits until the board says so. A session that ends meanwhile latches them, too.

        Returns:
            Whether it was confirmed within `limit_s` (None: `LinkTimes.stop_limit_s`).
        """
        self.stop()
        end = self.transport.now() + (self.times.stop_limit_s if limit_s is None else limit_s)
        while self._stopping.wanted and self.transport.now() < end:
            self._turn(end)
        return not self._stopping.wanted

    # ---- requests ------------------------------------------------------------------------------------------

    def arm(self) -> None:
        """Ends the latch: set-points that answer a later tick move the motors.

        Ends the latching that the newest telemetry tells of; a stop that comes meanwhile is not undone.

        Raises:
            LatchedAgainError: there has been another since.
            BoardError: refused while the supply is low; or as `request`.
        """
        limit_s = self.times.request_limit_s
        end = self.transport.now() + limit_s
        latest = self.latest or self._fresh_telemetry(end)
        while True:
            answer = self.request(messages.Arm, latest[_LATCHES], what="arm")
            if answer.status == messages.AnswerStatus.OK:
                return
            supply_v = int.from_bytes(latest[_SUPPLY : _SUPPLY + 2], "little") / 1000
            if answer.status != messages.AnswerStatus.SUPPLY_LOW or supply_v > 0 or self.transport.now() >= end:
                break
            latest = self._fresh_telemetry(end)  # the supply was not yet measured
        where = self.transport.name
        if answer.status == messages.AnswerStatus.LATCHED_AGAIN:
            self._fresh_telemetry(end)  # who tries again knows of it
            raise LatchedAgainError(f"the motors of the board at {where} were latched off once more before they armed")
        if answer.status == messages.AnswerStatus.SUPPLY_LOW:
            known = f" ({supply_v:.2f} V)" if supply_v else ""
            raise BoardError(f"the board at {where} does not arm its motors: its supply is low{known}")
        raise BoardError(f"the board at {where} does not arm its motors: {_reason(answer.status)}")

    def _fresh_telemetry(self, end: float) -> bytes:
        """Telemetry of this session that comes from now on."""
        before, sessions = self.latest, self.sessions
        while self.latest is None or self.latest is before:
            if self.transport.now() >= end:
                raise BoardError(f"the board at {self.transport.name} sends no telemetry")
            if self.sessions != sessions:
                before, sessions = None, self.sessions
            self._turn(end)
        return self.latest

    def get_parameter(self, name: str) -> float:
        """The value of a parameter, in its unit."""
        spec = parameter_spec(name)
        answer = self.request(messages.GetParameter, spec.id, what=f"tell parameter {name}")
        return self._parameter(answer, name) * spec.scale

    def set_parameter(self, name: str, value: float) -> float:
        """Sets a parameter until the board's next reset; returns the value now in force, in its unit."""
        counts = parameter_counts(name, value)
        spec = parameter_spec(name)
        answer = self._request_when_free(messages.SetParameter, spec.id, counts, what=f"set parameter {name}")
        return self._parameter(answer, name) * spec.scale

    def save_parameters(self) -> None:
        """Writes all parameters to the board's EEPROM, so that they outlast resets and power cuts.

        Raises:
            BoardError: the supply is low, what was written does not read back; or as `request`.
        """
        what = "save its parameters"
        answer = self._request_when_free(messages.SaveParameters, what=what, limit_s=self.times.save_limit_s)
        if answer.status != messages.AnswerStatus.OK:
            raise BoardError(f"the board at {self.transport.name} did not {what}: {_reason(answer.status)}")

    def reset_parameters(self) -> None:
        """All parameters to the image's defaults; what is saved stays."""
        what = "reset its parameters"
        answer = self._request_when_free(messages.ResetParameters, what=what)
        if answer.status != messages.AnswerStatus.OK:
            raise BoardError(f"the board at {self.transport.name} did not {what}: {_reason(answer.status)}")

    def _request_when_free(
        self, kind: RequestKind, *arguments: int, what: str, limit_s: float | None = None
    ) -> messages.Answer:
        """As `request`; asks again while the board writes its EEPROM."""
        end = self.transport.now() + self.times.save_limit_s
        while True:
            answer = self.request(kind, *arguments, what=what, limit_s=limit_s)
            now = self.transport.now()
            if answer.status != messages.AnswerStatus.BUSY or now >= end:
                return answer
            again = now + _BUSY_AGAIN_S
            while self.transport.now() < again:
                self._turn(again)

    def request(self, kind: RequestKind, *arguments: int, what: str, limit_s: float | None = None) -> messages.Answer:
        """Asks the board once, for certain, and returns its answer.

        Args:
            kind: the message; its number is given here.
            arguments: its other fields, in wire counts.
            what: what is asked of the board, for the sentence of an error: "arm".

        Raises:
            SessionLostError: the session ended meanwhile; whether it was done is not known.
            BoardError: no answer in time.
        """
        request = self.submit(kind, *arguments, what=what, limit_s=limit_s)
        while not request.done:
            self._turn(_NEVER)
        if request.error is not None:
            raise request.error
        assert request.answer is not None
        return request.answer

    def submit(self, kind: RequestKind, *arguments: int, what: str, limit_s: float | None = None) -> Request:
        """As `request`, but does not wait: the answer comes while somebody polls.

        Raises:
            BoardError: too many wait already.
        """
        request = Request(kind, arguments, what, self.times.request_limit_s if limit_s is None else limit_s)
        request.first_s = self.transport.now()
        self._requests.add(request)
        self._due = -_NEVER
        return request

    # ---- what is due ---------------------------------------------------------------------------------------

    def _turn(self, until: float) -> None:
        """One step: sends what is due and takes what comes, at the latest until the given time."""
        now = self.transport.now()
        if now >= self._due:
            self._service(now)
        self._receive(max(min(until, self._due) - now, _SHORTEST_S), 0.0)

    def _service(self, now: float) -> None:
        """Sends what is due by now, and notes when the next is."""
        if not self.is_open:
            self._due = min(self._service_opening(now), self._service_waiting(now))
            return
        due = min(self._service_stop(now), self._service_requests(now))
        if not self.is_open:
            self._service(now)
            return
        if now >= self._probe_due:
            self._probe(now)
        self._due = min(due, self._probe_due)

    def _service_opening(self, now: float) -> float:
        if self._open_due == _NEVER:
            return _NEVER
        if now - self._greeted_s > _PATIENCE_S:  # it fell silent: so do we
            self._open_due = _NEVER
        elif now >= self._open_due:
            self._send(messages.Open.ID, self._open_payload)
            self._open_due = now + self._handshake_retry_s
        return self._open_due

    def _service_waiting(self, now: float) -> float:
        """Without a session requests wait; returns when the next of them is given up."""
        if now >= self._requests.deadline():
            self._requests.give_up_waiting(now, self._no_session)
        return self._requests.deadline()

    def _service_requests(self, now: float) -> float:
        request = self._requests.begin()
        if request is None:
            return _NEVER
        retry_s = self.times.retry_after(self._tick_s, self.byte_s, self.round_trips.longest())
        if request.tries == 0 or now >= request.last_s + retry_s:
            if request.tries and now >= request.first_s + request.limit_s:
                self._requests.give_up(self._no_answer(request))
                self._end_session()  # the board expects that number still: begin anew
                self._begin_opening(now)
                return _NEVER
            self._send(request.kind.ID, request.payload)
            self._requests.sent(now)
        return request.last_s + retry_s

    def _service_stop(self, now: float) -> float:
        stopping = self._stopping
        if not stopping.wanted:
            return _NEVER
        retry_s = self._tick_s + _STOP_BYTES * self.byte_s
        if stopping.tries == 0 or now >= stopping.last_s + retry_s:
            self._send(messages.Stop.ID, messages.Stop.STRUCT.pack(stopping.token))
            stopping.sent(now)
        return stopping.last_s + retry_s

    def _probe(self, now: float) -> None:
        """Asks for the board's time, and draws when to do so again: at irregular intervals, so that no rhythm of the
        line hides its shortest delay."""
        self._probe_token = (self._probe_token + 1) & 0xFFFF
        if len(self._probes) >= _PROBES_KEPT:
            del self._probes[next(iter(self._probes))]
        self._probes[self._probe_token] = now
        self._send(messages.ClockProbe.ID, messages.ClockProbe.STRUCT.pack(self._probe_token))
        warm = now - self._opened_s < _WARM_UP_S
        if self.transport.realtime:
            wanted = _WARM_PROBE_S if warm else _PROBE_S
        else:
            wanted = _WARM_PROBE_SIMULATED_S if warm else _PROBE_SIMULATED_S
        if self.times.probe_s is not None:
            wanted = self.times.probe_s
        wanted = max(wanted, _PROBE_BYTES_EACH * self.byte_s / _PROBE_SHARE)
        longest = min(wanted, self._time_out_s / _PROBES_IN_TIME_OUT)
        self._probe_due = now + longest * (0.5 + 0.5 * self._draw.random())

    # ---- opening and ending --------------------------------------------------------------------------------

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
        self._due = -_NEVER
        self.decoder.seed = session  # the board may use it in the same breath as its hello

    def _opened(self, now: float) -> None:
        self._opened_s = now
        if self.sessions == 0:
            self.decoder.bad = self.decoder.lost = self.decoder.resynchronised = 0  # leftovers of another session
        self.is_open = True
        self._foreign_since = None
        self._replaced_since = _NEVER
        self.sessions += 1
        self._open_due = _NEVER
        self._requests.new_session()
        self._events.new_session()
        self._stopping.wanted = False  # a new session begins latched
        self.clock.forget()
        self._probe_due = now
        self._due = -_NEVER

    def _end_session(self) -> None:
        self.is_open = False
        self._requests.ended(self.transport.name)
        self._telemetry = []
        if self.latest is not None:
            self._last_tick = int.from_bytes(self.latest[:4], "little")
            self._last_heard_s = self._latest_s
        self.latest = None
        self._probes.clear()
        self._probe_due = _NEVER
        self._due = -_NEVER

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

    def _tell_thinning(self) -> None:
        """Where the line is slow the board sends telemetry less often than its parameter says."""
        assert self.hello is not None
        ticks = self.hello.telemetry_period
        if ticks <= _PERIOD.minimum:
            return
        request = self.submit(messages.GetParameter, _PERIOD.id, what="tell parameter telemetry_period")
        while not request.done:
            self._turn(_NEVER)
        answer = request.answer  # if there is none, whatever is asked next will tell why
        if answer is not None and answer.status == messages.AnswerStatus.OK and answer.value < ticks:
            sent_ms, wanted_ms = (1000 * count * self._tick_s for count in (ticks, answer.value))
            self.notices.append(
                f"the board at {self.transport.name} sends telemetry every {sent_ms:g} ms, not every {wanted_ms:g} ms "
                "as its parameter telemetry_period says: its line is slow"
            )

    def _learn_baud(self) -> None:
        baud = self.transport.baud if isinstance(self.transport, BaudSelectable) else 0
        self.byte_s = _BITS_PER_BYTE / (baud or _BAUD)
        self.clock = BoardClock(byte_s=_BITS_PER_BYTE / baud if baud else 0.0)

    def _change_baud(self, baud: int) -> None:
        assert isinstance(self.transport, BaudSelectable)
        self.transport.set_baud(baud)
        self._learn_baud()
        self.decoder = Decoder(NO_SESSION)

    @property
    def _tick_s(self) -> float:
        return 1.0 / self.hello.tick_rate if self.hello is not None and self.hello.tick_rate else 0.01

    @property
    def _handshake_retry_s(self) -> float:
        return 2 * self._tick_s + 100 * self.byte_s

    # ---- what comes ----------------------------------------------------------------------------------------

    def _receive(self, wait_s: float, quiet_s: float) -> None:
        """Reads and sorts what arrived."""
        for stamp, data in self._read(wait_s, quiet_s):
            if self._record:
                self.received.append((stamp, data))
            if self.hello is None:
                self._heard.take(data)
            for message_id, _, payload in self.decoder.feed(data):
                if message_id != _TELEMETRY:
                    self._handlers[message_id](payload, stamp)
                elif self.is_open:
                    if self.latest is None:
                        self._hear_first_telemetry(payload, stamp)
                    self.latest = payload
                    self._latest_s = stamp
                    self._replaced_since = _NEVER
                    time_us = int.from_bytes(payload[4:8], "little")
                    observed = self.clock.observe(time_us, stamp)
                    self._telemetry.append((payload, *observed))
                    if stamp - observed[1] > self._late_after_s and self.clock.bounded:
                        self._late += 1
        if len(self._telemetry) > _TELEMETRY_ROOM:
            self._dropped += len(self._telemetry) - _TELEMETRY_ROOM
            del self._telemetry[:-_TELEMETRY_ROOM]
        if self._refused is not None and not self._refusing:
            self._refusing = True
            try:
                raise self._refusal(self._refused)
            finally:
                self._refusing = False

    def _hear_first_telemetry(self, payload: bytes, now: float) -> None:
        """Of a session: a count of ticks that has not gone on from that of the session before tells of a reset."""
        tick = int.from_bytes(payload[:4], "little")
        passed = (now - self._last_heard_s) / self._tick_s
        if self._last_tick >= 0 and tick < passed + self._last_tick / 2:  # after a reset at most `passed`
            self.board_resets += 1
            self.board_counters.restarted()
        self.clock.expect(tick * self._tick_s, now)

    def _hear_hello(self, payload: bytes, now: float) -> None:
        hello = messages.Hello.unpack(payload)
        if not _speaks_alike(hello):
            self._refused = hello
            return
        self._greeted_s = now
        self._time_out_s = hello.session_time_out / 1000
        if hello.session and hello.session == self._session:
            self.hello = hello
            self._late_after_s = _PERIODS_LATE * hello.telemetry_period * self._tick_s
            self._replaced_since = _NEVER
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
        if self._open_due == _NEVER or hello.board_nonce != self._opened_with:
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
        self._open_due = _NEVER
        if self._foreign_since is None:
            self._foreign_since = now

    def _hear_answer(self, payload: bytes, now: float) -> None:
        if not self.is_open:
            return
        request = self._requests.take(messages.Answer.unpack(payload))
        if request is None:
            return
        assert request.answer is not None
        self._due = -_NEVER  # the next may go
        if request.arguments[:1] == (_TIME_OUT.id,) and request.answer.status == messages.AnswerStatus.OK:
            self._time_out_s = request.answer.value * _TIME_OUT.scale / 1000

    def _hear_event(self, payload: bytes, now: float) -> None:
        if self.latest is None:
            return  # not acknowledged: it comes again, when board time can be told
        event = messages.Event.unpack(payload)
        number = self._events.take(event, self.clock.unwrap(event.time, now) * 1e-6)
        if number is not None:
            self._send(messages.Acknowledge.ID, messages.Acknowledge.STRUCT.pack(number))

    def _hear_stopped(self, payload: bytes, _: float) -> None:
        if self.is_open:
            self._stopping.take(payload[0])

    def _hear_counters(self, payload: bytes, _: float) -> None:
        if self.is_open:
            self.board_counters.take(messages.Counters.unpack(payload))

    def _hear_clock(self, payload: bytes, now: float) -> None:
        answer = messages.ClockAnswer.unpack(payload)
        sent = self._probes.pop(answer.token, None)
        if sent is not None and self.latest is not None:
            self.round_trips.add(now - sent)
            self.clock.probe(sent, answer.time, now)

    # ---- handshake -----------------------------------------------------------------------------------------

    def _ask(
        self,
        question: messages.Identify | messages.Describe,
        kind: type[_M],
        accept: Callable[[_M], bool],
        what: str,
        limit_s: float | None = None,
    ) -> _M:
        """Sends a question of the handshake, again and again while it stays unanswered; returns the answer."""
        now = self.transport.now()
        end = now + (self.times.request_limit_s if limit_s is None else limit_s)
        self._answers = []
        payload = question.pack()
        while now < end:
            self._send(question.ID, payload)
            until = min(now + max(self._handshake_retry_s, 2 * self.round_trips.longest()), end)
            while (now := self.transport.now()) < until:
                if now >= self._due:
                    self._service(now)
                self._receive(max(min(until, self._due) - now, _SHORTEST_S), 0.0)
                for answer in self._answers:
                    if isinstance(answer, kind) and accept(answer):
                        return answer
                self._answers = []
        raise BoardError(f"the board at {self.transport.name} did not {what}")

    def _refusal(self, hello: messages.Hello) -> ProtocolError:
        """Why the board that said this cannot be spoken with."""
        where = self.transport.name
        self._refused = None
        self._due = _NEVER
        if self.is_open:
            self._end_session()
        if hello.protocol_version != messages.PROTOCOL_VERSION:
            return ProtocolError(
                f"the board at {where} speaks protocol version {hello.protocol_version}, this kit speaks version "
                f"{messages.PROTOCOL_VERSION}; flash the firmware that came with this kit"
            )
        if hello.tick_rate == 0:
            return ProtocolError(f"the board at {where} says that it makes 0 control ticks in a second; expected more")
        return ProtocolError(
            f"the board at {where} was built with message schema {hello.schema_hash:08x}, this kit with "
            f"{messages.SCHEMA_HASH:08x}: {self._difference(hello.board_nonce)}; "
            "flash the firmware that came with this kit"
        )

    def _difference(self, board_nonce: int) -> str:
        """The first message that board and kit understand differently."""
        ours = sorted(messages.MESSAGES)
        theirs: set[int] = set()
        index = 0
        while True:
            try:
                said = self._describe(index, board_nonce)
            except BoebotError:
                return "which message differs it does not say"
            if said.id == 0 or index >= said.count:
                break
            kind = messages.MESSAGES.get(said.id)
            if kind is None:
                return f"its message 0x{said.id:02x} is not known here"
            if said.length != kind.LENGTH:
                return f"message {kind.NAME} (0x{said.id:02x}) has {said.length} bytes there, {kind.LENGTH} here"
            if said.hash != messages.HASHES[said.id]:
                return f"the fields of message {kind.NAME} (0x{said.id:02x}) differ"
            theirs.add(said.id)
            index += 1
        missing = next((number for number in ours if number not in theirs), None)
        if missing is not None:
            return f"it does not know message {messages.MESSAGES[missing].NAME} (0x{missing:02x})"
        return "the messages agree, but flags, values or parameters differ"

    def _describe(self, index: int, board_nonce: int) -> messages.Description:
        return self._ask(
            messages.Describe(index, board_nonce),
            messages.Description,
            lambda said: said.index == index,
            f"describe message {index}",
            limit_s=0.5,
        )

    # ---- inside --------------------------------------------------------------------------------------------

    def _send(self, message_id: int, payload: bytes) -> None:
        frame = encode(message_id, self._sequence, payload, self._session)
        self._sequence = (self._sequence + 1) & 0xFF
        self.transport.write(frame)
        if self._record:
            self.sent.append((self.transport.now(), frame))

    def _parameter(self, answer: messages.Answer, name: str) -> int:
        if answer.status != messages.AnswerStatus.OK:
            raise BoardError(f"the board at {self.transport.name} refuses parameter {name}: {_reason(answer.status)}")
        return answer.value

    def _no_answer(self, request: Request) -> BoardError:
        return BoardError(
            f"the board at {self.transport.name} did not {request.what} within {request.limit_s:g} s, "
            f"though asked {request.tries} times"
        )

    def _no_session(self, request: Request) -> BoardError:
        return BoardError(
            f"the board at {self.transport.name} was to {request.what}, but no session came about within "
            f"{request.limit_s:g} s"
        )


def _stamp_now(transport: Transport, wait_s: float, quiet_s: float) -> list[tuple[float, bytes]]:
    """Reads from a transport that does not stamp what comes."""
    data = transport.read(wait_s, quiet_s)
    return [(transport.now(), data)] if data else []


def _speaks_alike(hello: messages.Hello) -> bool:
    return (
        hello.protocol_version == messages.PROTOCOL_VERSION
        and hello.schema_hash == messages.SCHEMA_HASH
        and hello.tick_rate > 0
    )


def _reason(status: int) -> str:
    """Why a board refuses; a status that this kit does not know is told by its number."""
    try:
        return messages.AnswerStatus(status).name.lower().replace("_", " ")
    except ValueError:
        return f"status {status}"


def parameter_spec(name: str) -> messages.ParameterSpec:
    """The parameter of that name.

    Raises:
        BoebotError: there is none.
    """
    spec = messages.PARAMETERS.get(name)
    if spec is None:
        raise BoebotError(f"there is no parameter {name!r}; expected one of {', '.join(messages.PARAMETERS)}")
    return spec


def parameter_counts(name: str, value: float) -> int:
    """The value, in the parameter's unit, as it goes over the wire.

    Raises:
        BoebotError: there is no such parameter, or it cannot be that.
    """
    spec = parameter_spec(name)
    counts = round(value / spec.scale) if math.isfinite(value) else spec.maximum + 1
    if not spec.minimum <= counts <= spec.maximum:
        raise BoebotError(
            f"parameter {name} cannot be {value:g} {spec.unit}; "
            f"expected {spec.minimum * spec.scale:g} to {spec.maximum * spec.scale:g}"
        )
    return counts
