"""The host's end of the link to one board (protocol/PROTOCOL.md): what programs call.

`Link` composes the parts: `Line` carries frames, `Session` shakes hands, `Requests`, `Events`, `MotorStop` and
`SlowDevices` deliver, `ClockSync` follows the board's clock, `TelemetryBuffer` keeps what comes.
None of them has a thread: all of that happens inside the calls of `Link` that wait for the board.

When the board was reset, or has ended the session because the host was silent, its next hello says so, and the link
opens a new session by itself: `counts.sessions` counts them, and the program configures and arms the board again.
"""

from __future__ import annotations

import random
import secrets
from functools import partial

from boebot.errors import BoardError
from boebot.link import finding, messages
from boebot.link.clock import ClockSync
from boebot.link.counters import BoardCounters, HostCounters
from boebot.link.delivery import (
    REQUEST_LIMIT_S,
    STOP_LIMIT_S,
    Events,
    MotorStop,
    Request,
    RequestKind,
    Requests,
    SlowDevices,
    StampedTelemetry,
    TelemetryBuffer,
    check,
    retry_after,
)
from boebot.link.errors import LatchedAgainError
from boebot.link.frame import reader
from boebot.link.line import AT_ONCE, NEVER, Append, Handlers, Line
from boebot.link.parameter_requests import BoardParameters
from boebot.link.session import Session
from boebot.link.transport import CountsOverruns, Transport

_TIME_OUT = messages.PARAMETERS["session_time_out"]
_SHORTEST_S = 1e-4  # a wait that rounds to nothing would never end on a clock that only waits advance
_ROUNDING_S = 0.5e-6  # a clock of whole cycles may stop this much before what was waited for
_STOP_BYTES = 20
_FRAME_TICKS = 2  # of the servos: no pulse shows sooner

_TASKS = tuple(task.name.lower() for task in messages.Task)
_LATCH = reader(messages.Telemetry, "latch")
_LATCHES = reader(messages.Telemetry, "latches")
_SUPPLY = reader(messages.Telemetry, "supply")


class Link:
    """The host's end of the link to one board.

    Attributes:
        transport: where the board is.
        notices: sentences for the user; a program that shows them takes them out.
        line, session, clock, telemetry, devices, events, parameters: the parts.
        counts: what the host's end has counted; `counters` brings the frames' counts up to date.
        board_counters: what the board's end has counted.
        task_times: the longest time of each task of the firmware in the session, in 1/16 us, interrupts on top
            included; 65535: that or longer; 0: it took no time, as on the native board (where only the Ping's pulse
            does); None: not yet known. The board sends one after another, all of them in 0.9 s where the line is fast.
        polled_s: when `poll_until` returned last, by the transport's clock.
    """

    def __init__(
        self,
        transport: Transport,
        record: Append | None = None,
    ) -> None:
        """Nothing is sent yet: see `open`.

        Args:
            transport: where the board is.
            record: gets all that crosses the wire, as `Line` says.
        """
        # in simulated time a run has to be the same each time; on a real line no session's seed may come again
        draw = random.Random(secrets.randbits(64) if transport.realtime else "link")
        self.transport = transport
        self.notices: list[str] = []
        self.board_counters = BoardCounters()
        self.task_times: dict[str, int | None] = {}
        self.polled_s = 0.0
        self.counts = counts = HostCounters()
        self.line = line = Line(transport, record)
        self.clock = ClockSync(line, draw)
        self.session = Session(
            line,
            self._turn,
            self._session_opened,
            self._session_ended,
            counts=counts,
            draw=draw,
            round_trips=self.clock.round_trips,
            notices=self.notices,
        )
        self.telemetry = TelemetryBuffer(self.clock, counts)
        self.devices = SlowDevices(line.send, counts)
        self._requests = Requests(line.send, counts, transport.name, self.session.restart)
        self.events = Events(line.send, counts, self.clock)
        self._stop = MotorStop(line.send, counts)
        self.parameters = BoardParameters(line, self.session, self.request, self._turn)
        self._now = line.now
        self._due = NEVER  # when something is to be sent next
        handshake: Handlers = self.session.handlers | {messages.Hello.ID: self._receive_hello}
        self._handlers = self._handlers_without_session = handshake
        self._handlers_in_session: Handlers = handshake | {
            messages.Answer.ID: self._receive_answer,
            messages.Event.ID: self.events.receive,
            messages.Stopped.ID: self._stop.receive,
            messages.Counters.ID: lambda payload, _: self.board_counters.add(messages.Counters.unpack(payload)),
            messages.TaskTime.ID: self._receive_task_time,
            messages.ClockAnswer.ID: self.clock.receive,
            **{kind.ID: partial(self._receive_devices, kind) for kind in messages.DEVICE_MESSAGES},
        }

    # ---- the session -------------------------------------------------------------------------------------------------

    def open(self, limit_s: float | None = None) -> messages.Hello:
        """Waits for the board's hello, checks that both speak the same protocol, and opens a session.

        Finds the baud rate where the transport can change it. Returns at once if a session is open.

        Args:
            limit_s: by the transport's clock; None: 2 s, or 4 s where opening the port resets the board.

        Raises:
            BoardError: nobody answers, or the board has gone.
            ProtocolError: something else speaks, or another version of this protocol.
        """
        if not self.session.is_open:
            self.session.open(limit_s)
        assert self.session.hello is not None
        return self.session.hello

    def close(self) -> None:
        """Ends the session at once, so that the board is free for others; it latches its motors off. The port stays
        open."""
        self.session.close()
        self._due = NEVER

    def identity(self) -> messages.Identity:
        """Which image runs on the board."""
        return self.session.ask(messages.Identify(), messages.Identity, "say which image it runs", REQUEST_LIMIT_S)

    def counters(self) -> HostCounters:
        """`counts`, with those of decoder and transport."""
        decoder, counts = self.line.decoder, self.counts
        counts.good, counts.bad, counts.unknown = decoder.good, decoder.bad, decoder.unknown
        counts.resynchronised, counts.lost = decoder.resynchronised, decoder.lost
        counts.overrun = self.transport.overruns if isinstance(self.transport, CountsOverruns) else 0
        return counts

    # ---- telemetry, events, set-points -------------------------------------------------------------------------------

    def poll(self, wait_s: float, quiet_s: float = 0.0) -> list[StampedTelemetry]:
        """The telemetry that arrived, oldest first; waits for some as `Transport.read` does, and keeps the session
        alive meanwhile. Opens a new session if need be: see `counts.sessions`.

        Raises:
            BoardError: the board has gone, or another program keeps taking it.
            ProtocolError: a board of another protocol has come in its place.
        """
        now = self._now()
        return self.poll_until(now + quiet_s, now + wait_s)

    def poll_until(self, look_s: float, end_s: float) -> list[StampedTelemetry]:
        """As `poll`, by the transport's clock: looks for telemetry from `look_s` on, and waits until `end_s` at most.
        `polled_s` is then the time at which it returned."""
        now = self._now()
        while True:
            if now + _ROUNDING_S >= self._due:
                self._service(now + _ROUNDING_S)
            wait = (end_s if end_s < self._due else self._due) - now
            if wait < _SHORTEST_S:
                wait = _SHORTEST_S
            quiet = look_s - now
            self._receive(wait, 0.0 if quiet <= 0.0 else quiet if quiet < wait else wait)
            now = self._now()
            if (self.telemetry.waiting and now >= look_s) or now >= end_s:
                self.polled_s = now
                return self.telemetry.fetch()

    def send_signal(self, left: float, right: float, time_to_live_ms: int, tick: int) -> None:
        """Motor signals -1..1, in answer to the observation of `tick`."""
        signals = round(left * 10000), round(right * 10000)
        self.line.send_fields(messages.SetpointSignal, *signals, time_to_live_ms, tick & 0xFFFF)

    def send_speed(self, left_m_s: float, right_m_s: float, time_to_live_ms: int, tick: int) -> None:
        """Wheel speeds along the ground (m/s), in answer to the observation of `tick`."""
        speeds = round(left_m_s * 10000), round(right_m_s * 10000)
        self.line.send_fields(messages.SetpointSpeed, *speeds, time_to_live_ms, tick & 0xFFFF)

    def send_coast(self, time_to_live_ms: int, tick: int) -> None:
        """No pulses, in answer to the observation of `tick`; nothing is latched."""
        self.line.send_fields(messages.SetpointCoast, time_to_live_ms, tick & 0xFFFF)

    # ---- slow devices ------------------------------------------------------------------------------------------------

    def set_turret(self, turret: messages.Turret, pulse: int) -> None:
        """Sets the turret until a stop: sent until devices_telemetry shows `pulse` (counts; 0: none), and again when a
        dead-man stop or a new session has released it. While the motors are latched it does not move."""
        self.devices.set_turret(turret, pulse)
        self._service_devices(self._now())

    def play_tone(self, tone: messages.Buzzer) -> None:
        """Plays a tone once, in place of the one before; its token is given here. Sent until the board has begun it or
        the session ends."""
        self.devices.play_tone(tone)
        self._service_devices(self._now())

    # ---- stop --------------------------------------------------------------------------------------------------------

    def stop(self) -> None:
        """Stops the motors and latches them off until `arm`. Sent again, while the program waits for the board, until
        it is confirmed. It frees the turret and silences the buzzer, too."""
        self.devices.stop()
        self._stop.begin()
        self._service(self._now())

    def stop_and_confirm(self, limit_s: float = STOP_LIMIT_S) -> bool:
        """Stops the motors and waits until the board says so. A session that ends meanwhile latches them, too.

        Returns:
            Whether it was confirmed within `limit_s`.
        """
        self.stop()
        end = self._now() + limit_s
        while self._stop.pending and self._now() < end:
            self._turn(end)
        return not self._stop.pending

    # ---- requests ----------------------------------------------------------------------------------------------------

    def request(
        self, kind: RequestKind, *arguments: int, what: str, limit_s: float = REQUEST_LIMIT_S
    ) -> messages.Answer:
        """Asks the board once, for certain, and returns its answer.

        Args:
            kind: the message; its number is given here.
            arguments: its other fields, in wire counts.
            what: the wish in words, for the sentence of an error: "arm".

        Raises:
            SessionLostError: the session ended meanwhile; whether it was done is not known.
            BoardError: no answer in time.
        """
        request = self.submit(kind, *arguments, what=what, limit_s=limit_s)
        while not request.done:
            self._turn(NEVER)
        if request.error is not None:
            raise request.error
        assert request.answer is not None
        return request.answer

    def submit(self, kind: RequestKind, *arguments: int, what: str, limit_s: float = REQUEST_LIMIT_S) -> Request:
        """As `request`, but does not wait: the answer comes while the program polls.

        Raises:
            BoardError: the one before is not done.
        """
        request = Request(kind, arguments, what, limit_s)
        self._requests.submit(request, self._now())
        self._due = AT_ONCE
        return request

    # ---- arming ------------------------------------------------------------------------------------------------------

    def arm(self) -> None:
        """Ends the latch: set-points that answer a later tick move the motors.

        Ends the latching that the newest telemetry shows; a stop that comes meanwhile is not undone.

        Raises:
            LatchedAgainError: there has been another since.
            BoardError: refused while the supply is low; or as `request`.
        """
        end = self._now() + REQUEST_LIMIT_S
        latest = self.telemetry.latest or self._fresh_telemetry(end)
        while True:
            answer = self.request(messages.Arm, *_LATCHES(latest), what="arm")
            if answer.status == messages.AnswerStatus.OK:
                return
            supply_v = _SUPPLY(latest)[0] / 1000
            if answer.status != messages.AnswerStatus.SUPPLY_LOW or supply_v > 0 or self._now() >= end:
                break
            latest = self._fresh_telemetry(end)  # the supply was not yet measured
        where = self.transport.name
        if answer.status == messages.AnswerStatus.LATCHED_AGAIN:
            self._fresh_telemetry(end)  # the next call knows of it
            raise LatchedAgainError(f"the motors of the board at {where} were latched off once more before they armed")
        if answer.status == messages.AnswerStatus.SUPPLY_LOW:
            known = f" ({supply_v:.2f} V)" if supply_v else ""
            raise BoardError(f"the board at {where} does not arm its motors: its supply is low{known}")
        check(answer, where, "does not arm its motors")

    def _fresh_telemetry(self, end: float) -> bytes:
        """Telemetry of this session that comes from now on."""
        before, sessions = self.telemetry.latest, self.counts.sessions
        while self.telemetry.latest is None or self.telemetry.latest is before:
            if self._now() >= end:
                raise BoardError(f"the board at {self.transport.name} sends no telemetry")
            if self.counts.sessions != sessions:
                before, sessions = None, self.counts.sessions
            self._turn(end)
        return self.telemetry.latest

    # ---- the loop ----------------------------------------------------------------------------------------------------

    def _turn(self, until: float) -> None:
        """One step: sends all that is due and receives what comes, at the latest until the given time."""
        now = self._now()
        self._service(now)
        until = min(until, self._due)
        # NEVER: what was waited for is over
        self._receive(max(until - now, _SHORTEST_S) if until < NEVER else 0.0, 0.0)

    def _service(self, now: float) -> None:
        """Sends all that is due by now, and notes when something is next."""
        session = self.session
        if session.is_open:
            due = min(
                self._stop.service(now, session.tick_s + _STOP_BYTES * self.line.byte_s),
                self._requests.service(now, self._retry_s()),
            )
            if session.is_open:
                self._due = min(due, self.clock.service(now, session.time_out_s))
                return
        self._due = min(session.service(now), self._requests.service_waiting(now))

    def _retry_s(self) -> float:
        return retry_after(self.session.tick_s, self.line.byte_s, self.clock.round_trips.longest())

    def _receive(self, wait_s: float, quiet_s: float) -> None:
        """Reads what arrived, and hands each message to its handler; without a session only the handshake's."""
        line = self.line
        for stamp, data in line.read(wait_s, quiet_s):
            for message_id, _, payload in line.decoder.feed(data):
                handler = self._handlers.get(message_id)
                if handler is not None:
                    handler(payload, stamp)
            self.telemetry.stamp(stamp)
        if self.session.refused is not None:
            self.session.raise_refusal()

    def _session_opened(self, now: float) -> None:
        session = self.session
        self._handlers = self._handlers_in_session | {messages.Telemetry.ID: self._receive_first_telemetry}
        self.clock.session_opened(now)
        self.telemetry.session_opened(session.telemetry_s)
        self.devices.session_opened()
        self._requests.session_opened()
        self.events.session_opened()
        self._stop.session_opened()
        self.task_times = dict.fromkeys(_TASKS)
        self._due = AT_ONCE

    def _session_ended(self) -> None:
        self._handlers = self._handlers_without_session
        for part in (self.clock, self.telemetry, self.devices, self._requests):
            part.session_ended()
        self._due = AT_ONCE

    # ---- what comes --------------------------------------------------------------------------------------------------

    def _receive_hello(self, payload: bytes, now: float) -> None:
        self._due = AT_ONCE  # it may want an answer
        self.session.confirm(self.telemetry.latest_s)
        self.session.receive_hello(payload, now)

    def _receive_first_telemetry(self, payload: bytes, now: float) -> None:
        """It shows whether the board was reset before the session."""
        self._handlers[messages.Telemetry.ID] = self.telemetry.receive
        hello = self.session.hello
        assert hello is not None
        resets = self.counts.board_resets
        has_started = self.telemetry.begin(payload, now, self.session.tick_s)
        if self.counts.board_resets != resets:
            self.board_counters.restarted()
        if has_started and finding.by_watchdog(hello.reset_cause):
            cause = finding.hang_in_words(hello.reset_cause)
            notice = f"the last reset of the board at {self.transport.name} was by {cause}"
            if notice not in self.notices:
                self.notices.append(notice)
        self.telemetry.receive(payload, now)

    def _receive_devices(self, kind: type[messages.Message], payload: bytes, now: float) -> None:
        self.devices.receive(payload, kind)
        if self.devices.pending:
            self._service_devices(now)

    def _service_devices(self, now: float) -> None:
        """Sends what turret and buzzer are to do, unless that was done lately."""
        if self.session.is_open:
            latest = self.telemetry.latest
            latched = latest is None or _LATCH(latest) != (messages.Latch.NONE,)
            self.devices.service(now, self._retry_s() + _FRAME_TICKS * self.session.tick_s, latched)

    def _receive_answer(self, payload: bytes, _: float) -> None:
        request = self._requests.receive(payload)
        if request is None:
            return
        assert request.answer is not None
        self._due = AT_ONCE  # the next may go
        if request.arguments[:1] == (_TIME_OUT.id,) and request.answer.status == messages.AnswerStatus.OK:
            self.session.time_out_s = request.answer.value * _TIME_OUT.scale

    def _receive_task_time(self, payload: bytes, _: float) -> None:
        task, longest = messages.TaskTime.unpack(payload)
        if task < len(_TASKS):  # this kit knows it
            self.task_times[_TASKS[task]] = longest
