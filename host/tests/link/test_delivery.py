"""Each way of delivery alone: the test gives it messages and the time, and sees what it sends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest
from wire import DEVICES, TELEMETRY, Sent, Wire, clock_on

from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.counters import HostCounters
from boebot.link.delivery import Events, MotorStop, Request, Requests, SlowDevices, TelemetryBuffer, retry_after
from boebot.link.errors import SessionLostError
from boebot.link.line import NEVER


def at(*times: float, service: Callable[[float], object]) -> None:
    """Calls `service` at these times."""
    for time in times:
        service(time)


# ---- requests --------------------------------------------------------------------------------------------------------


def requests_of(sent: Sent, restarts: list[float] | None = None) -> Requests:
    return Requests(sent.append, HostCounters(), "wire", (restarts if restarts is not None else []).append)


def get(limit_s: float = 2.0) -> Request:
    return Request(messages.GetParameter, (7,), "send it", limit_s)


def test_requests_go_one_at_a_time_and_again_until_they_are_answered() -> None:
    sent = Sent()
    requests, first, second = requests_of(sent), get(), get()
    requests.submit(first, 0.0)
    with pytest.raises(BoardError, match="the board at wire is asked to send it; expected"):
        requests.submit(second, 0.0)
    assert requests.service(0.0, 0.1) == 0.1
    at(0.05, 0.1, service=lambda now: requests.service(now, 0.1))
    assert sent == [messages.GetParameter(1, 7)] * 2 and requests._counts.retransmitted == 1
    assert requests.receive(messages.Answer(1, 0, 9).pack()) is first and first.answer is not None and first.done
    requests.submit(second, 0.12)
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
    requests.service(0.0, 0.1)
    requests.session_ended()
    assert isinstance(first.error, SessionLostError) and str(first.error).endswith("whether it was done is not known")
    requests.submit(second, 0.0)
    requests.session_ended()
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
