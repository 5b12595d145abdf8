"""Each part of the link alone: the test gives it messages and the time, and sees what it sends."""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import pytest

from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.clock import ClockSync, RoundTrips
from boebot.link.counters import HostCounters
from boebot.link.delivery import Events, MotorStop, Request, Requests, SlowDevices, TelemetryBuffer, retry_after
from boebot.link.errors import SessionLostError, TakenOverError
from boebot.link.frame import NO_SESSION, SEED, Decoder, encode, reader, text
from boebot.link.line import NEVER, Line
from boebot.link.session import Session

TELEMETRY = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))
DEVICES = messages.DevicesTelemetry(*(0,) * len(messages.DevicesTelemetry._fields))
HELLO = messages.Hello(
    messages.PROTOCOL_VERSION, messages.SCHEMA_HASH, 77, 0, 100, 1000, 1, 1, 1, 0, 0, b"shieldbot".ljust(16, b"\0")
)


@dataclass
class Wire:
    """A transport that delivers what the test puts in, and keeps what was written."""

    time: float = 0.0
    coming: list[tuple[float, bytes]] = field(default_factory=list)
    written: bytes = b""
    name: str = "wire"
    realtime: bool = False

    def now(self) -> float:
        return self.time

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        del wait_s, quiet_s
        found, self.coming = self.coming, []
        return found

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def write(self, data: bytes) -> None:
        self.written += data

    def close(self) -> None:
        """Nothing to close."""


Sent = list[messages.Message]
"""What a part has sent: it sends by `append`."""


def at(*times: float, service: Callable[[float], object]) -> None:
    """Calls `service` at these times."""
    for time in times:
        service(time)


# ---- fields ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [kind for kind in messages.MESSAGES.values() if kind._fields])
def test_each_field_is_read_as_unpacking_all_of_them_does(kind: type[messages.Message]) -> None:
    payload = random.Random(kind.ID).randbytes(kind.LENGTH)
    whole = kind.unpack(payload)
    for name, value in zip(kind._fields, whole, strict=True):
        assert reader(kind, name)(payload) == (value,)
    assert reader(kind, *kind._fields)(payload) == tuple(whole)


def test_a_field_that_a_message_has_not_is_named() -> None:
    with pytest.raises(ValueError, match="message telemetry has no field tock"):
        reader(messages.Telemetry, "tick", "tock")
    assert text(b"boebot\0\0rest") == "boebot"


# ---- line ------------------------------------------------------------------------------------------------------------


def test_line_sends_and_accepts_frames_of_its_session_only() -> None:
    wire, kept = Wire(time=3.0), []
    line = Line(wire, lambda *row: kept.append(row))
    line.use_session(0x12345)
    line.send(messages.Stop(7))
    board = Decoder(0x12345, to_board=True)
    assert board.feed(wire.written) == [(messages.Stop.ID, 0, b"\7")]
    stopped = [encode(messages.Stopped.ID, number, b"\7", seed) for number, seed in enumerate((0x12345, 0x54321))]
    listened: list[bytes] = []
    line.listener = listened.append
    wire.coming = [(1.0, b"\0" + stopped[0]), (2.0, stopped[1])]
    found = [(stamp, line.decoder.feed(data)) for stamp, data in line.read(0.1)]
    assert found == [(1.0, [(messages.Stopped.ID, 0, b"\7")]), (2.0, [])]
    assert (line.decoder.good, line.decoder.bad) == (1, 1)
    assert listened == [b"\0" + stopped[0], stopped[1]]
    assert kept == [("to_board", 3.0, wire.written), ("to_host", 1.0, listened[0]), ("to_host", 2.0, listened[1])]
    line.use_session(0)
    assert line.decoder.seed == NO_SESSION


# ---- session ---------------------------------------------------------------------------------------------------------


class Alone:
    """A session without a link."""

    def __init__(self, take_over: bool = False) -> None:
        self.wire = Wire()
        self.happened: list[str] = []
        self.counts = HostCounters()
        self.session = Session(
            Line(self.wire),
            lambda until: self.wait(until),
            lambda now: self.happened.append(f"opened at {now}"),
            lambda: self.happened.append("ended"),
            counts=self.counts,
            draw=random.Random(1),
            round_trips=RoundTrips(),
            notices=[],
            take_over=take_over,
        )
        self.session._wanted = True

    def wait(self, until: float) -> None:
        self.wire.time = until

    def hello(self, now: float, session: int = 0, board_nonce: int = HELLO.board_nonce) -> None:
        hello = HELLO._replace(session=session, board_nonce=board_nonce)
        self.session.handlers[messages.Hello.ID](hello.pack(), now)

    def sent(self) -> list[messages.Message]:
        """What was sent since the last look: messages of the handshake."""
        data, self.wire.written = self.wire.written, b""
        return [messages.MESSAGES[one].unpack(payload) for one, _, payload in Decoder(to_board=True).feed(b"\0" + data)]

    def open(self) -> int:
        """Its number."""
        self.hello(0.0)
        self.session.service(0.0)
        (opening,) = self.sent()
        assert isinstance(opening, messages.Open) and opening.board_nonce == 77
        number = 77 ^ opening.host_nonce
        self.hello(0.01, session=number)
        assert self.session.is_open
        return number


def test_session_is_opened_by_two_hellos() -> None:
    alone = Alone()
    assert alone.session.service(0.0) == NEVER and alone.sent() == [], "silent until the hello"
    number = alone.open()
    assert alone.happened == ["opened at 0.01"] and alone.counts.sessions == 1
    assert alone.session.hello == HELLO._replace(session=number) and alone.session.time_out_s == 1.0


def test_open_is_sent_again_until_the_board_falls_silent() -> None:
    alone = Alone()
    alone.hello(0.0)
    due = alone.session.service(0.0)
    assert due == pytest.approx(0.022), "two ticks and 100 bytes"
    at(0.01, due, service=alone.session.service)
    assert len(alone.sent()) == 2
    assert alone.session.service(1.1) == NEVER and alone.sent() == []


def test_hello_of_a_reset_board_ends_the_session_and_begins_another() -> None:
    alone = Alone()
    number = alone.open()
    alone.hello(0.5)
    assert alone.session.is_open, "it was sent before the session was opened"
    alone.hello(0.6, board_nonce=78)
    assert (alone.session.is_open, alone.counts.sessions_lost, alone.happened[1:]) == (False, 1, ["ended"])
    alone.session.service(0.6)
    (opening,) = alone.sent()
    assert isinstance(opening, messages.Open) and opening.board_nonce == 78 and 78 ^ opening.host_nonce != number


@pytest.mark.parametrize("telemetry_goes_on", [False, True])
def test_session_gives_way_to_another_host_unless_its_telemetry_goes_on(telemetry_goes_on: bool) -> None:
    alone = Alone()
    alone.open()
    alone.hello(0.5, session=99)
    if telemetry_goes_on:
        alone.session.confirm(0.6)
        alone.hello(0.7, session=99)
        assert alone.session.is_open
    else:
        with pytest.raises(TakenOverError, match="another program has taken the board at wire"):
            alone.hello(0.7, session=99)
        assert not alone.session.is_open and alone.counts.sessions_lost == 1


@pytest.mark.parametrize("take_over", [False, True])
def test_board_of_another_host_is_left_alone_or_taken_over(take_over: bool) -> None:
    alone = Alone(take_over)
    session = alone.session

    def wait(until: float) -> None:
        alone.wire.time = until
        session.service(until)
        opening = next(iter(alone.sent()), None)
        alone.hello(until, session=77 ^ opening.host_nonce if isinstance(opening, messages.Open) else 99)

    alone.wait = wait  # type: ignore[method-assign]
    if take_over:
        session.open(2.0)
        assert session.is_open and alone.wire.time < 0.1
    else:
        with pytest.raises(TakenOverError, match="the board at wire is busy"):
            session.open(2.0)
        assert alone.wire.time == pytest.approx(1.34, abs=0.03), "the other host's time-out and a little"


def test_closed_session_is_not_opened_again() -> None:
    alone = Alone()
    number = alone.open()
    alone.session.close()
    assert alone.happened[1:] == ["ended"] and alone.session.hello is None and alone.counts.sessions_lost == 0
    frames = Decoder(number, to_board=True).feed(b"\0" + alone.wire.written)
    assert [payload for _, _, payload in frames] == [messages.Close(number).pack()]
    alone.sent()
    alone.hello(2.0, board_nonce=78)
    assert alone.session.service(2.0) == NEVER and alone.sent() == []


def test_question_that_nobody_answers_is_asked_again_and_given_up() -> None:
    alone = Alone()
    with pytest.raises(BoardError, match="the board at wire did not say which image it runs"):
        alone.session.ask(messages.Identify(), messages.Identity, "say which image it runs", 0.1)
    assert alone.sent() == [messages.Identify()] * 5


# ---- requests --------------------------------------------------------------------------------------------------------


def requests_of(sent: Sent, restarts: list[float] | None = None) -> Requests:
    return Requests(sent.append, HostCounters(), "wire", (restarts if restarts is not None else []).append)


def get(limit_s: float = 2.0) -> Request:
    return Request(messages.GetParameter, (7,), "send it", limit_s)


def test_requests_go_one_at_a_time_and_again_until_they_are_answered() -> None:
    sent = Sent()
    requests, first, second = requests_of(sent), get(), get()
    requests.submit(first, 0.0)
    requests.submit(second, 0.0)
    assert requests.service(0.0, 0.1) == 0.1
    at(0.05, 0.1, service=lambda now: requests.service(now, 0.1))
    assert sent == [messages.GetParameter(1, 7)] * 2 and requests._counts.retransmitted == 1
    assert requests.receive(messages.Answer(1, 0, 9).pack()) is first and first.answer is not None and first.done
    requests.service(0.12, 0.1)
    assert sent[2:] == [messages.GetParameter(2, 7)] and not second.done
    assert requests.receive(messages.Answer(1, 0, 9).pack()) is None and (
        requests._counts.stray,
        requests._counts.duplicate,
    ) == (1, 0)
    requests.receive(messages.Answer(2, 0, 9).pack())
    assert requests.receive(messages.Answer(2, 0, 9).pack()) is None and requests._counts.duplicate == 1
    assert requests.service(0.3, 0.1) == NEVER


def test_request_that_is_never_answered_begins_a_new_session() -> None:
    sent, restarts = Sent(), list[float]()
    requests, request = requests_of(sent, restarts), get(0.3)
    requests.submit(request, 0.0)
    at(0.0, 0.11, 0.22, 0.33, service=lambda now: requests.service(now, 0.1))
    assert str(request.error) == "the board at wire did not send it within 0.3 s, though asked 3 times"
    assert restarts == [0.33] and len(sent) == 3


def test_request_waits_for_a_session_and_is_given_up_without_one() -> None:
    sent = Sent()
    requests, request = requests_of(sent), get()
    assert requests.service_waiting(0.0) == NEVER
    requests.submit(request, 1.0)
    assert requests.service_waiting(1.5) == 3.0 and not request.done
    requests.service_waiting(3.0)
    assert str(request.error) == "the board at wire was to send it, but no session came about within 2 s" and sent == []


def test_end_of_the_session_fails_its_requests_and_numbers_begin_anew() -> None:
    sent = Sent()
    requests, first, second = requests_of(sent), get(), get()
    requests.submit(first, 0.0)
    requests.submit(second, 0.0)
    requests.service(0.0, 0.1)
    requests.session_ended()
    assert isinstance(first.error, SessionLostError) and str(first.error).endswith("whether it was done is not known")
    assert isinstance(second.error, SessionLostError) and str(second.error).endswith("it was not done")
    requests.session_opened()
    requests.submit(get(), 1.0)
    requests.service(1.0, 0.1)
    assert sent == [messages.GetParameter(1, 7)] * 2


def test_request_numbers_roll_over() -> None:
    sent = Sent()
    requests = requests_of(sent)
    requests._number = 65533
    for number in (65534, 65535, 0, 1):
        requests.submit(get(), 0.0)
        requests.service(0.0, 0.1)
        assert sent[-1] == messages.GetParameter(number, 7)
        assert requests.receive(messages.Answer(number, 0, 0).pack()) is not None


def test_too_many_waiting_requests_are_refused() -> None:
    requests = requests_of(Sent())
    for _ in range(Requests.ROOM):
        requests.submit(get(), 0.0)
    with pytest.raises(BoardError, match="32 requests wait for the board already"):
        requests.submit(get(), 0.0)


def test_retry_time_follows_from_tick_line_and_round_trips() -> None:
    assert retry_after(0.01, 2e-5, 0.0) == pytest.approx(0.012)
    assert retry_after(0.01, 2e-5, 0.030) == pytest.approx(0.045)
    assert retry_after(0.01, 2e-5, 5.0) == pytest.approx(0.108)
    assert retry_after(0.01, 10 / 9600, 0.0) == pytest.approx(0.01 + 1000 / 9600)


# ---- stop ------------------------------------------------------------------------------------------------------------


def test_stop_tokens_roll_over_and_a_late_confirmation_confirms_nothing() -> None:
    sent = Sent()
    stop = MotorStop(sent.append, HostCounters())
    stop._token = 253
    for _ in range(5):
        stop.begin()
        stop.service(0.0, 0.01)
    assert sent == [messages.Stop(token) for token in (254, 255, 0, 1, 2)]
    for token in (254, 255, 0, 1):
        stop.receive(messages.Stopped(token).pack(), 0.0)
        assert stop.pending
    assert stop.service(0.005, 0.01) == 0.01 and stop.service(0.01, 0.01) == 0.02
    assert len(sent) == 6 and stop._counts.retransmitted == 1
    stop.receive(messages.Stopped(2).pack(), 0.0)
    assert not stop.pending and stop.service(1.0, 0.01) == NEVER


def test_session_begins_latched_so_that_a_stop_is_done() -> None:
    stop = MotorStop(Sent().append, HostCounters())
    stop.begin()
    stop.session_opened()
    assert not stop.pending


# ---- clock -----------------------------------------------------------------------------------------------------------


def clock_on(wire: Wire) -> ClockSync:
    """With an open session."""
    clock = ClockSync(Line(wire), random.Random(1))
    clock.session_opened(0.0)
    return clock


def probes_in(wire: Wire) -> list[int]:
    """Tokens of the probes that were sent since the last look."""
    data, wire.written = wire.written, b""
    found = Decoder(0, to_board=True).feed(b"\0" + data)
    return [messages.ClockProbe.unpack(payload).token for _, _, payload in found]


def test_probes_are_irregular_and_often_enough_for_the_session() -> None:
    wire = Wire()
    clock = clock_on(wire)
    dues = [0.0]
    for _ in range(500):
        dues.append(clock.service(dues[-1], 0.2))
        assert clock.service(dues[-1] - 1e-6, 0.2) == dues[-1], "none before its time"
    waits = [later - earlier for earlier, later in itertools.pairwise(dues)]
    assert max(waits) <= 0.05 and len(set(waits)) > 400
    assert len(clock._waiting) == 64


def test_probe_tokens_roll_over() -> None:
    wire = Wire()
    clock = clock_on(wire)
    clock.begin(0.0, 0, 0.0)
    clock._token = 0xFFFF - 2
    due, tokens = 0.0, list[int]()
    for _ in range(5):
        wire.time = due
        due = clock.service(due, 1.0)
        (token,) = probes_in(wire)
        tokens.append(token)
        clock.receive(messages.ClockAnswer(token, round(wire.time * 1e6) + 500).pack(), wire.time + 0.001)
        clock.receive(messages.ClockAnswer(token, 0).pack(), wire.time + 0.9)  # a copy
    assert tokens == [0xFFFE, 0xFFFF, 0, 1, 2]
    assert clock.estimate.probes == 5 and clock.round_trips.longest() == pytest.approx(0.001)
    assert (
        clock.estimate.bounded
        and abs(clock.estimate.observe(round(wire.time * 1e6), wire.time + 0.001)[1] - wire.time) < 600e-6
    )


def test_clock_begins_anew_with_a_session_and_with_another_rate() -> None:
    wire = Wire()
    clock = clock_on(wire)
    clock.begin(7.0, 7_000_123, 0.0)
    assert clock.began_us == 7_000_123
    clock.session_ended()
    assert clock.began_us is None and clock.service(9.0, 1.0) == NEVER
    estimate = clock.estimate
    clock.session_opened(1.0)
    assert clock.estimate is estimate and not estimate.known
    clock._line.known_byte_s = 1e-4
    clock.session_opened(2.0)
    assert clock.estimate is not estimate


# ---- events ----------------------------------------------------------------------------------------------------------


def events_of(sent: Sent) -> Events:
    """With a clock that knows the board's time."""
    clock = clock_on(Wire())
    clock.begin(1.0, 1_000_000, 0.0)
    return Events(sent.append, HostCounters(), clock)


def event(number: int, value: int = 0, time: int = 2_000_000) -> bytes:
    return messages.Event(number, messages.EventKind.DEAD_MAN, value, time).pack()


def receive(events: Events, payloads: Sequence[bytes]) -> list[int]:
    """Values of those that are handed on."""
    for payload in payloads:
        events.receive(payload, 1.0)
    return [one.value for one in events.fetch()]


def test_events_are_handed_on_once_and_in_order() -> None:
    sent = Sent()
    events = events_of(sent)
    assert receive(events, [event(1, 5), event(1, 5), event(3, 7), event(2, 6), event(3, 7)]) == [5, 6, 7]
    assert [one.number for one in sent] == [1, 1, 2, 3]  # type: ignore[union-attr]
    assert (events._counts.duplicate, events._counts.stray, list(events.waiting)) == (1, 1, [])


def test_event_numbers_roll_over() -> None:
    events = events_of(Sent())
    events._last = 65533
    assert receive(events, [event(number % 65536, number % 7) for number in range(65534, 65539)]) == [0, 1, 2, 3, 4]


def test_events_that_nobody_fetches_are_not_acknowledged() -> None:
    sent = Sent()
    events = events_of(sent)
    for number in range(1, Events.ROOM + 2):
        events.receive(event(number, number), 0.0)
    assert len(sent) == len(events.waiting) == Events.ROOM and events._counts.held == 1
    assert len(events.fetch()) == Events.ROOM
    assert receive(events, [event(Events.ROOM + 1, 9)]) == [9]


def test_event_that_was_handed_on_and_not_acknowledged_comes_again_and_is_dropped() -> None:
    events = events_of(Sent())
    assert receive(events, [event(8, 7)]) == [] and receive(events, [event(1, 7)]) == [7]
    events.session_opened()
    assert receive(events, [event(1, 7), event(2, 8)]) == [8] and events._counts.duplicate == 1


def test_event_of_before_the_session_is_marked_and_waits_until_time_is_known() -> None:
    sent = Sent()
    events = events_of(sent)
    events.receive(event(1, time=999_999), 0.0)
    (found,) = events.fetch()
    assert found.earlier and found.time == pytest.approx(0.999999)
    unknown = Events(sent.append, HostCounters(), clock_on(Wire()))
    unknown.receive(event(1), 0.0)
    assert len(sent) == 1 and not unknown.waiting


# ---- telemetry -------------------------------------------------------------------------------------------------------


def telemetry(tick: int) -> bytes:
    return TELEMETRY._replace(tick=tick, time=tick * 10_000).pack()


def test_telemetry_that_nobody_fetches_does_not_fill_the_memory() -> None:
    buffer = TelemetryBuffer(clock_on(Wire()), HostCounters())
    for tick in range(TelemetryBuffer.ROOM + 50):
        buffer.receive(telemetry(tick), tick * 0.01)
        buffer.stamp(tick * 0.01)
    found = buffer.fetch()
    assert len(found) == TelemetryBuffer.ROOM and buffer._counts.dropped == 50 and buffer.waiting == []
    assert found[0][0] == telemetry(50) and found[0][1] == pytest.approx(0.5)


def test_telemetry_that_came_together_is_stamped_together() -> None:
    buffer = TelemetryBuffer(clock_on(Wire()), HostCounters())
    for tick in (3, 4):
        buffer.receive(telemetry(tick), 1.0)
    assert buffer.waiting == [] and buffer.latest == telemetry(4)
    buffer.stamp(1.0)
    (_, early, early_host, _), (_, late, late_host, _) = buffer.fetch()
    assert late - early == pytest.approx(0.01) and late_host - early_host == pytest.approx(0.01)


@pytest.mark.parametrize(("tick", "resets"), [(150, 0), (101, 0), (7, 1)])
def test_ticks_that_have_not_gone_on_are_a_reset(tick: int, resets: int) -> None:
    """A second session begins half a second after tick 100 came, at 100 ticks a second."""
    buffer = TelemetryBuffer(clock_on(Wire()), HostCounters())
    assert buffer.begin(telemetry(100), 1.0, 0.01), "the board has started before"
    buffer.receive(telemetry(100), 1.0)
    buffer.session_ended()
    assert buffer.latest is None
    assert buffer.begin(telemetry(tick), 1.5, 0.01) is bool(resets) and buffer._counts.board_resets == resets


# ---- slow devices ----------------------------------------------------------------------------------------------------


def test_turret_and_tone_are_sent_until_a_message_shows_them() -> None:
    sent = Sent()
    devices = SlowDevices(sent.append, HostCounters())
    turret = messages.Turret(1000, 1)
    devices.set_turret(turret, 24_900)
    devices.play_tone(messages.Buzzer(440, 10, 0))
    at(0.0, 0.05, 0.1, service=lambda now: devices.service(now, 0.1, False))
    assert sent == [messages.Buzzer(440, 10, 1), turret] * 2 and devices._counts.retransmitted == 2
    devices.receive(DEVICES._replace(buzzer_token=1, turret_pulse=24_901).pack())
    at(0.2, 0.3, service=lambda now: devices.service(now, 0.1, False))
    assert len(sent) == 4 and devices.pending, "a dead-man stop may release the turret"
    devices.receive(DEVICES.pack())
    devices.service(0.4, 0.1, False)
    assert sent[4:] == [turret]


def test_turret_of_a_latched_board_waits_and_its_release_does_not() -> None:
    sent = Sent()
    devices = SlowDevices(sent.append, HostCounters())
    devices.set_turret(messages.Turret(1000, 1), 24_900)
    devices.service(0.0, 0.1, True)
    assert sent == []
    devices.set_turret(messages.Turret(0, 0), 5)
    devices.service(0.0, 0.1, True)
    assert sent == [messages.Turret(0, 0)]
    devices.receive(DEVICES.pack())
    assert not devices.pending


@pytest.mark.parametrize("end", ["stop", "session_opened"])
def test_stop_and_new_session_end_pending_commands(end: str) -> None:
    sent = Sent()
    devices = SlowDevices(sent.append, HostCounters())
    devices.set_turret(messages.Turret(1000, 1), 24_900)
    devices.play_tone(messages.Buzzer(440, 10, 0))
    devices.service(0.0, 0.1, False)
    getattr(devices, end)()
    assert devices.pending is (end == "session_opened"), "the turret is to turn back after a reset"
    devices.service(9.0, 0.1, False)
    assert sent[2:] == ([] if end == "stop" else [messages.Turret(1000, 1)])


def test_seed_of_the_handshake_is_never_a_session() -> None:
    """Its frames would pass for those of the handshake."""

    class Draw(random.Random):
        drawn = iter([77 ^ SEED, 77, 5])

        def randrange(self, *_: object) -> int:
            return next(self.drawn)

    alone = Alone()
    alone.session._draw = Draw()
    alone.hello(0.0)
    alone.session.service(0.0)
    assert alone.sent() == [messages.Open(messages.PROTOCOL_VERSION, 77, 5)]
