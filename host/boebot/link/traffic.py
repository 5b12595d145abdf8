"""The traffic of an open session: requests and stops that are sent until they are answered, events that are
acknowledged, telemetry, clock probes, turret and buzzer (protocol/PROTOCOL.md, "Delivery", "Clock")."""

from __future__ import annotations

from boebot.errors import BoardError
from boebot.link import messages, reset_cause
from boebot.link.counters import BoardCounters, HostCounters
from boebot.link.delivery import Events, LinkTimes, Request, RequestKind, Requests, Stopping
from boebot.link.line import NEVER, Append
from boebot.link.opening import Opening
from boebot.link.probes import ClockProbes
from boebot.link.transport import CountsOverruns, Transport
from boebot.link.wanted import Wanted

Telemetry = tuple[bytes, float, float, float]
"""(payload, board time of its tick in s, host time of that in s, error bound of the host time in s)"""

_TIME_OUT = messages.PARAMETERS["session_time_out"]
_PERIOD = messages.PARAMETERS["telemetry_period"]
_STOP_BYTES = 20
_PERIODS_LATE = 3  # telemetry that comes later than so many of its periods after its tick is counted
_TELEMETRY_ROOM = 4096  # messages that nobody fetched
_LATCH = messages.Telemetry.OFFSETS["latch"]
_FRAME_TICKS = 2  # of the servos: no pulse shows sooner
_TASKS = tuple(task.name.lower() for task in messages.Task)


def _no_task_times() -> dict[str, int | None]:
    return dict.fromkeys(_TASKS)


class Traffic(Opening):
    """A session and what goes to and fro in it.

    Attributes, besides those of `Opening` and `Line`:
        board_resets: how many ends of sessions were resets of the board; noticed by its count of ticks.
        latest: the newest telemetry of this session, or None.
        latest_devices: the newest devices_telemetry of this session, or None: most robots have none.
        board_counters: what the board's end has counted.
        task_times: how long each task of the firmware took at most since the session was opened, by its name: cycles of
            1/16 us, interrupts on top included; 65535: so long or longer; 0: it took no time, as on the native board
            (where only the Ping's pulse does); None: not yet told. The board tells one after another, all of them in
            0.8 s where the line is fast.
    """

    def __init__(self, transport: Transport, record: Append | None, times: LinkTimes, take_over: bool) -> None:
        super().__init__(transport, record, times, take_over)
        self.board_resets = 0
        self.latest: bytes | None = None
        self.latest_devices: bytes | None = None
        self.board_counters = BoardCounters()
        self.task_times = _no_task_times()
        self._telemetry: list[Telemetry] = []
        self._unstamped: list[bytes] = []  # of the piece that is being heard
        self._devices: list[bytes] = []
        self._wants = Wanted()
        self._dropped = 0
        self._late = 0
        self._late_after_s = NEVER  # three telemetry periods
        self._last_tick = -1  # of the session before
        self._last_heard_s = 0.0
        self._latest_s = 0.0
        self._first_us = 0  # board time of the session's first telemetry
        self._requests = Requests()
        self._events = Events()
        self._stopping = Stopping()
        self._probes = ClockProbes(transport.realtime, self.times, self._draw)
        self._probe_due = NEVER
        self._handlers |= {
            messages.Telemetry.ID: self._hear_telemetry,
            messages.DevicesTelemetry.ID: self._hear_devices,
            messages.Answer.ID: self._hear_answer,
            messages.Event.ID: self._hear_event,
            messages.Stopped.ID: self._hear_stopped,
            messages.Counters.ID: self._hear_counters,
            messages.TaskTime.ID: self._hear_task_time,
            messages.ClockAnswer.ID: self._hear_clock,
        }

    def counters(self) -> HostCounters:
        """What the host's end has counted."""
        requests, events, decoder = self._requests, self._events, self.decoder
        return HostCounters(
            good=decoder.good,
            bad=decoder.bad,
            unknown=decoder.unknown,
            resynchronised=decoder.resynchronised,
            lost=decoder.lost,
            retransmitted=requests.retransmitted + self._stopping.retransmitted + self._wants.retransmitted,
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

    # ---- requests ----------------------------------------------------------------------------------------------------

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
            self._turn(NEVER)
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
        request.first_s = self._now()
        self._requests.add(request)
        self._due = -NEVER
        return request

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

    # ---- what is due -------------------------------------------------------------------------------------------------

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
            self._send(messages.ClockProbe.ID, messages.ClockProbe.STRUCT.pack(self._probes.next(self._now())))
            self._probe_due = self._probes.due(now, self._opened_s, self.byte_s, self._time_out_s)
        self._due = min(due, self._probe_due)

    def _service_waiting(self, now: float) -> float:
        """Without a session requests wait; returns when the next of them is given up."""
        if now >= self._requests.deadline():
            self._requests.give_up_waiting(now, self._no_session)
        return self._requests.deadline()

    def _service_requests(self, now: float) -> float:
        request = self._requests.begin()
        if request is None:
            return NEVER
        retry_s = self.times.retry_after(self._tick_s, self.byte_s, self.round_trips.longest())
        if request.tries == 0 or now >= request.last_s + retry_s:
            if request.tries and now >= request.first_s + request.limit_s:
                self._requests.give_up(self._no_answer(request))
                self._end_session()  # the board expects that number still: begin anew
                self._begin_opening(now)
                return NEVER
            self._send(request.kind.ID, request.payload)
            self._requests.sent(now)
        return request.last_s + retry_s

    def _service_stop(self, now: float) -> float:
        stopping = self._stopping
        if not stopping.wanted:
            return NEVER
        retry_s = self._tick_s + _STOP_BYTES * self.byte_s
        if stopping.tries == 0 or now >= stopping.last_s + retry_s:
            self._send(messages.Stop.ID, messages.Stop.STRUCT.pack(stopping.token))
            stopping.sent(now)
        return stopping.last_s + retry_s

    # ---- session -----------------------------------------------------------------------------------------------------

    def _opened(self, now: float) -> None:
        super()._opened(now)
        self._requests.new_session()
        self._events.new_session()
        self._stopping.wanted = False  # a new session begins latched
        self._wants.new_session()
        self.task_times = _no_task_times()
        self._probe_due = now

    def _end_session(self) -> None:
        super()._end_session()
        self._requests.ended(self.transport.name)
        self._telemetry, self._unstamped = [], []
        if self.latest is not None:
            self._last_tick = int.from_bytes(self.latest[:4], "little")
            self._last_heard_s = self._latest_s
        self.latest = self.latest_devices = None
        self._devices = []
        self._probes.waiting.clear()
        self._probe_due = NEVER

    def _open_told(self) -> None:
        self._tell_thinning()

    def _tell_thinning(self) -> None:
        """Where the line is slow the board sends telemetry less often than its parameter says."""
        assert self.hello is not None
        ticks = self.hello.telemetry_period
        if ticks <= _PERIOD.minimum:
            return
        request = self.submit(messages.GetParameter, _PERIOD.id, what="tell parameter telemetry_period")
        while not request.done:
            self._turn(NEVER)
        answer = request.answer  # if there is none, whatever is asked next will tell why
        if answer is not None and answer.status == messages.AnswerStatus.OK and answer.value < ticks:
            sent_ms, wanted_ms = (1000 * count * self._tick_s for count in (ticks, answer.value))
            self.notices.append(
                f"the board at {self.transport.name} sends telemetry every {sent_ms:g} ms, not every {wanted_ms:g} ms "
                "as its parameter telemetry_period says: its line is slow"
            )

    # ---- what comes --------------------------------------------------------------------------------------------------

    def _hear_hello(self, payload: bytes, now: float) -> None:
        super()._hear_hello(payload, now)
        if self.is_open and self.hello is not None:
            self._late_after_s = _PERIODS_LATE * self.hello.telemetry_period * self._tick_s

    def _hear_telemetry(self, payload: bytes, now: float) -> None:
        if not self.is_open:
            return
        if self.latest is None:
            self._hear_first_telemetry(payload, now)
        self.latest = payload
        self._latest_s = now
        self._replaced_since = NEVER
        self._unstamped.append(payload)

    def _piece_heard(self, now: float) -> None:
        payloads = self._unstamped
        if not payloads:
            return
        self._unstamped = []
        times = [int.from_bytes(payload[4:8], "little") for payload in payloads]
        stamps = self.clock.observe_all(times, now)
        self._telemetry += [(payload, *stamp) for payload, stamp in zip(payloads, stamps, strict=True)]
        if now - stamps[-1][1] > self._late_after_s and self.clock.bounded:  # the others have come before
            self._late += 1
        if (excess := len(self._telemetry) - _TELEMETRY_ROOM) > 0:
            self._dropped += excess
            del self._telemetry[:excess]

    def _hear_devices(self, payload: bytes, now: float) -> None:
        if not self.is_open:
            return
        self.latest_devices = payload
        self._devices.append(payload)
        if len(self._devices) > _TELEMETRY_ROOM:
            self._dropped += 1
            del self._devices[0]
        if self._wants.any:
            self._wants.shown(payload)
            self._tell_wanted(now)

    def _tell_wanted(self, now: float) -> None:
        """Tells the board what is wanted of turret and buzzer and not yet shown, unless that was done lately."""
        if not self.is_open:
            return
        latched = self.latest is None or self.latest[_LATCH] != messages.Latch.NONE
        retry_s = self.times.retry_after(self._tick_s, self.byte_s, self.round_trips.longest())
        retry_s += _FRAME_TICKS * self._tick_s
        for message in self._wants.due(now, retry_s, latched, self.latest_devices):
            self._send(message.ID, message.pack())

    def _hear_first_telemetry(self, payload: bytes, now: float) -> None:
        """Of a session: a count of ticks that has not gone on from that of the session before tells of a reset."""
        tick = int.from_bytes(payload[:4], "little")
        passed = (now - self._last_heard_s) / self._tick_s
        was_reset = self._last_tick >= 0 and tick < passed + self._last_tick / 2  # after a reset at most `passed`
        if was_reset:
            self.board_resets += 1
            self.board_counters.restarted()
        if was_reset or self._last_tick < 0:
            self._tell_watchdog()
        self.clock.expect(tick * self._tick_s, now)
        self._first_us = self.clock.unwrap(int.from_bytes(payload[4:8], "little"), now)

    def _tell_watchdog(self) -> None:
        assert self.hello is not None
        cause = self.hello.reset_cause
        if reset_cause.by_watchdog(cause):
            told = f"the last reset of the board at {self.transport.name} was by {reset_cause.hang_in_words(cause)}"
            if told not in self.notices:
                self.notices.append(told)

    def _hear_answer(self, payload: bytes, now: float) -> None:
        if not self.is_open:
            return
        request = self._requests.take(messages.Answer.unpack(payload))
        if request is None:
            return
        assert request.answer is not None
        self._due = -NEVER  # the next may go
        if request.arguments[:1] == (_TIME_OUT.id,) and request.answer.status == messages.AnswerStatus.OK:
            self._time_out_s = request.answer.value * _TIME_OUT.scale / 1000

    def _hear_event(self, payload: bytes, now: float) -> None:
        if self.latest is None:
            return  # not acknowledged: it comes again, when board time can be told
        event = messages.Event.unpack(payload)
        us = self.clock.unwrap(event.time, now)
        number = self._events.take(event, us * 1e-6, us < self._first_us)
        if number is not None:
            self._send(messages.Acknowledge.ID, messages.Acknowledge.STRUCT.pack(number))

    def _hear_stopped(self, payload: bytes, _: float) -> None:
        if self.is_open:
            self._stopping.take(payload[0])

    def _hear_counters(self, payload: bytes, _: float) -> None:
        if self.is_open:
            self.board_counters.take(messages.Counters.unpack(payload))

    def _hear_task_time(self, payload: bytes, _: float) -> None:
        task, longest = messages.TaskTime.unpack(payload)
        if self.is_open and task < len(_TASKS):
            self.task_times[_TASKS[task]] = longest

    def _hear_clock(self, payload: bytes, now: float) -> None:
        answer = messages.ClockAnswer.unpack(payload)
        sent = self._probes.answered(answer.token)
        if sent is not None and self.latest is not None:
            self.round_trips.add(now - sent)
            self.clock.probe(sent, answer.time, now)
