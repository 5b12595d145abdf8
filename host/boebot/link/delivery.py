"""How each class of messages is delivered (protocol/PROTOCOL.md, "Delivery"): telemetry as it comes, requests and
events exactly once and in order, a stop until it is confirmed, turret and buzzer until a message shows them.

None of these has a thread: `boebot.link.link.Link` calls them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from boebot.devices.buzzer import next_token
from boebot.errors import BoardError, BoebotError
from boebot.link import messages
from boebot.link.clock import ClockSync
from boebot.link.counters import HostCounters
from boebot.link.errors import SessionLostError
from boebot.link.frame import reader
from boebot.link.line import NEVER, Send

StampedTelemetry = tuple[bytes, float, float, float]
"""(payload, board time of its tick in s, host time of that in s, error bound of the host time in s)"""

REQUEST_LIMIT_S = 2.0  # an unanswered request is given up after this
SAVE_LIMIT_S = 5.0  # the same for saving parameters, which the board answers when the EEPROM is written
STOP_LIMIT_S = 2.0  # how long `Link.stop_and_confirm` waits
_PATIENCE = 1.5  # of the longest round trip
_NUMBERS = 65536  # of requests and events
_TOKENS = 256
_NEAR = 2  # counts that the board's pulse may lie beside the host's: both round
_PERIODS_LATE = 3  # telemetry that comes more of its periods after its tick is counted
_TICK = reader(messages.Telemetry, "tick")
_TIME = reader(messages.Telemetry, "time")
_TICK_AND_TIME = reader(messages.Telemetry, "tick", "time")
_BUZZER_TOKEN = reader(messages.DevicesTelemetry, "buzzer_token")
_TURRET_PULSE = reader(messages.DevicesTelemetry, "turret_pulse")


def retry_after(tick_s: float, byte_s: float, longest_s: float) -> float:
    """When to send a request again (s): after one tick and 100 bytes, or 1.5 times the longest round trip lately, at
    most 10 ticks and 400 bytes."""
    return min(max(tick_s + 100 * byte_s, _PATIENCE * longest_s), 10 * tick_s + 400 * byte_s)


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
        """Takes a `telemetry`; `stamp` follows when all that came with it was received. A copy counts for nothing."""
        if payload == self.latest:
            self._counts.duplicate += 1
            return
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
        self.number = -1  # in the session; -1: it has none yet
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
    """The requests of one link, one at a time."""

    def __init__(self, send: Send, counts: HostCounters, where: str, restart: Callable[[float], None]) -> None:
        """Sends by `send` to the board at `where`. `restart` begins another session: a board that does not
        answer a request still expects its number."""
        self._send = send
        self._counts = counts
        self._where = where
        self._restart = restart
        self._under_way: Request | None = None
        self._number = 0

    def submit(self, request: Request, now_s: float) -> None:
        """Takes it.

        Raises:
            BoardError: the one before is not done.
        """
        if self._under_way is not None:
            raise BoardError(
                f"the board at {self._where} is asked to {self._under_way.what}; expected its answer first"
            )
        request.first_s = now_s
        self._under_way = request

    def service(self, now_s: float, retry_s: float) -> float:
        """In a session: sends a request that is due; returns when it is the next time (s)."""
        request = self._under_way
        if request is None:
            return NEVER
        if request.tries == 0:
            self._number = request.number = (self._number + 1) % _NUMBERS
            request.first_s = now_s
        elif now_s < request.last_s + retry_s:
            return request.last_s + retry_s
        elif now_s >= request.first_s + request.limit_s:
            request.error = BoardError(
                f"the board at {self._where} did not {request.what} within {request.limit_s:g} s, "
                f"though asked {request.tries} times"
            )
            self._under_way = None
            self._restart(now_s)
            return NEVER
        else:
            self._counts.retransmitted += 1
        self._send(request.kind(request.number, *request.arguments))
        request.tries += 1
        request.last_s = now_s
        return now_s + retry_s

    def service_waiting(self, now_s: float) -> float:
        """Without a session: gives up what waits for too long; returns when that is (s)."""
        request = self._under_way
        if request is None:
            return NEVER
        if now_s >= request.first_s + request.limit_s:
            self._under_way = None
            request.error = BoardError(
                f"the board at {self._where} was to {request.what}, but no session came about within "
                f"{request.limit_s:g} s"
            )
        return request.first_s + request.limit_s

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
        request, self._under_way = self._under_way, None
        if request is not None:
            known = "it was not done" if request.tries == 0 else "whether it was done is not known"
            request.error = SessionLostError(
                f"the session with the board at {self._where} ended while it was asked to {request.what}; {known}"
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


class MotorStop:
    """The stop command of one link.

    Attributes:
        pending: a stop is not yet confirmed.
    """

    def __init__(self, send: Send, counts: HostCounters) -> None:
        self.pending = False
        self._send = send
        self._counts = counts
        self._token = 0
        self._sent_s: float | None = None  # when the stop of this token was last sent

    def begin(self) -> None:
        """A new stop; it replaces one that is not yet confirmed."""
        self._token = (self._token + 1) % _TOKENS
        self.pending = True
        self._sent_s = None

    def service(self, now_s: float, retry_s: float) -> float:
        """Sends the stop if it is time; returns when it is the next time (s)."""
        if not self.pending:
            return NEVER
        if self._sent_s is None or now_s >= self._sent_s + retry_s:
            self._counts.retransmitted += self._sent_s is not None
            self._sent_s = now_s
            self._send(messages.Stop(self._token))
        return self._sent_s + retry_s

    def receive(self, payload: bytes, _: float) -> None:
        """Takes a `stopped`."""
        if messages.Stopped.unpack(payload).token == self._token:
            self.pending = False

    def session_opened(self) -> None:
        """The motors are latched off at the beginning of a session."""
        self.pending = False


Kind = type[messages.Message]


class SlowDevices:
    """The slow devices behind one link.

    Attributes:
        latest: the newest message of each kind in this session (payload): most robots send none.
        pending: a message is to show that turret or buzzer do what they were asked.
    """

    ROOM = 4096  # messages that wait to be fetched

    def __init__(self, send: Send, counts: HostCounters) -> None:
        self.latest: dict[Kind, bytes] = {}
        self.pending = False
        self._send = send
        self._counts = counts
        self._waiting: list[tuple[Kind, bytes]] = []
        self._turret: messages.Turret | None = None
        self._pulse = 0  # that shows it
        self._turret_sent_s: float | None = None
        self._tone: messages.Buzzer | None = None
        self._token = 0  # of the session's last tone
        self._tone_sent_s: float | None = None

    def set_turret(self, turret: messages.Turret, pulse: int) -> None:
        """What the turret is to do until a stop; devices_telemetry then shows `pulse` (counts; 0: none)."""
        self._turret, self._pulse, self._turret_sent_s = turret, pulse if turret.hold else 0, None
        self.pending = True

    def play_tone(self, tone: messages.Buzzer) -> None:
        """Plays a tone in place of one that has not begun; its token is given here."""
        self._token = next_token(self._token)
        self._tone, self._tone_sent_s = tone._replace(token=self._token), None
        self.pending = True

    def stop(self) -> None:
        """A stop releases the turret and silences the buzzer."""
        self._turret = self._tone = None
        self.pending = False

    def session_opened(self) -> None:
        """Tokens begin anew. A tone is not played again in another session; the turret is to turn back."""
        self._token = 0
        self._tone = None
        self._turret_sent_s = None
        self.pending = self._turret is not None

    def session_ended(self) -> None:
        """What came in it and was not fetched is dropped."""
        self.latest = {}
        self._waiting = []

    def receive(self, payload: bytes, kind: Kind = messages.DevicesTelemetry) -> None:
        """Takes a message. A tone that has begun is not sent again, nor is the release of a turret that is free. One
        that holds an angle still is to: a dead-man stop may release it."""
        self.latest[kind] = payload
        self._waiting.append((kind, payload))
        if len(self._waiting) > self.ROOM:
            self._counts.dropped += 1
            del self._waiting[0]
        if self.pending and kind is messages.DevicesTelemetry:
            if self._tone is not None and _BUZZER_TOKEN(payload) == (self._tone.token,):
                self._tone = None
            if self._pulse == 0 and self._turret_is_shown():
                self._turret = None
            self.pending = self._turret is not None or self._tone is not None

    def service(self, now_s: float, retry_s: float, latched: bool) -> None:
        """Sends what was not yet sent, or was `retry_s` ago and is not shown. A turret does not move while the motors
        are latched off."""
        if self._tone is not None and (self._tone_sent_s is None or now_s >= self._tone_sent_s + retry_s):
            self._counts.retransmitted += self._tone_sent_s is not None
            self._tone_sent_s = now_s
            self._send(self._tone)
        turret, sent_s = self._turret, self._turret_sent_s
        if turret is None or (latched and turret.hold):
            return
        if sent_s is None or (now_s >= sent_s + retry_s and not self._turret_is_shown()):
            self._counts.retransmitted += sent_s is not None
            self._turret_sent_s = now_s
            self._send(turret)

    def fetch(self) -> list[tuple[Kind, bytes]]:
        """Messages that came since the last call, kind and payload, oldest first."""
        found, self._waiting = self._waiting, []
        return found

    def _turret_is_shown(self) -> bool:
        newest = self.latest.get(messages.DevicesTelemetry)
        if newest is None:
            return False
        (pulse,) = _TURRET_PULSE(newest)
        return bool(pulse == self._pulse or (pulse != 0 != self._pulse and abs(pulse - self._pulse) <= _NEAR))
