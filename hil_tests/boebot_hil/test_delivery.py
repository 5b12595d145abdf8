"""PROTOCOL.md, Delivery: what arrives once, what is repeated, what waits, and how full the line may be."""

from __future__ import annotations

import itertools

import pytest

from boebot.link import messages
from boebot.link.messages import AnswerStatus, Devices, EventKind, Latch
from boebot.link.transport import BaudSelectable
from boebot_hil.rig import CYCLES_PER_S, HOST_NONCE, TICK_S, Rig
from sim_bridge.bench.uno import Uno

pytestmark = pytest.mark.uno(robot="shieldbot", motors=False)

WHISKER_LEFT, BUZZER = 5, 4
FRAME_BYTES = messages.Telemetry.LENGTH + 8
RATE = messages.PARAMETERS["baud_rate"].id


def latch_events(rig: Rig) -> list[int]:
    """Values of the events of latches so far, each once, in their order."""
    found = {event.number: event.value for event in rig.events if event.kind == EventKind.LATCH}
    return [value for _, value in sorted(found.items())]


@pytest.mark.promise("the host sends it again, with the same token, until `stopped` brings the token back")
def test_each_stop_is_confirmed_with_its_token(rig: Rig) -> None:
    for token in (7, 7, 0, 255):
        assert rig.ask(messages.Stop(token), messages.Stopped).token == token


@pytest.mark.promise("any other number is ignored")
def test_an_acknowledgement_of_another_number_ends_no_event(rig: Rig) -> None:
    rig.arm()
    rig.listen(0.1)
    rig.acknowledges = False
    rig.events.clear()
    rig.stop()
    rig.listen(0.1)
    number = rig.events[-1].number
    for other in (number - 1, number + 1, 0xFFFF):
        rig.send(messages.Acknowledge(other & 0xFFFF))
    rig.events.clear()
    rig.listen(0.2)
    assert len(rig.events) >= 5 and {event.number for event in rig.events} == {number}


@pytest.mark.promise(
    "The queue holds 4; when it is full, later changes of one kind merge: the merged event has the latest value",
    "is sent when there is room, and is counted as deferred",
)
def test_when_the_queue_is_full_later_events_of_a_kind_are_one(rig: Rig) -> None:
    rig.arm()
    rig.listen(0.1)
    rig.answers.clear()
    deferred = rig.next(messages.Counters, 1.0).deferred
    rig.events.clear()
    rig.acknowledges = False
    for _ in range(3):
        rig.stop()
        rig.arm()
    rig.stop()
    rig.acknowledges = True
    for _ in range(20):
        rig.listen(TICK_S)
    assert latch_events(rig) == [Latch.STOP_COMMAND, Latch.NONE] * 2 + [Latch.STOP_COMMAND]
    rig.answers.clear()
    assert rig.next(messages.Counters, 1.0).deferred == deferred + 3


@pytest.mark.emulated
@pytest.mark.promise("What happens without a session waits for the next one, with its time, unless it is the whiskers'")
@pytest.mark.promise("A reset forgets all that waits")
def test_touches_without_a_session_and_what_waited_before_a_reset_are_forgotten(rig: Rig) -> None:
    rig.listen(0.1)
    rig.alive = rig.acknowledges = False
    rig.send(messages.Close(rig.seed))
    rig.listen(0.05)
    for level in (0, 1):
        rig.uno.pin(WHISKER_LEFT).drive(level)
        rig.listen(0.1)
    rig.events.clear()
    rig.acknowledges = True
    rig.start(arm=False)
    rig.listen(0.2)
    assert latch_events(rig)[-1:] == [Latch.SESSION_ENDED]
    assert not [event for event in rig.events if event.kind == EventKind.WHISKERS]
    rig.arm()
    rig.listen(0.1)
    rig.acknowledges = False
    rig.stop()
    rig.uno.reset("external")
    rig.listen(0.5)
    rig.events.clear()
    rig.acknowledges = True
    rig.start(arm=False)
    rig.listen(0.2)
    assert rig.events == []


@pytest.mark.emulated
@pytest.mark.promise(
    "While the EEPROM is being written `set_parameter`, `reset_parameters` and `save_parameters` are answered `busy`",
)
@pytest.mark.promise("a save goes on")
def test_while_a_save_goes_on_parameters_are_busy(rig: Rig) -> None:
    """A save of an earlier session, as one session has one request under way at a time."""
    rig.set("track_width", 12_345)
    rig.send(rig.numbered(messages.SaveParameters))
    rig.listen(0.03)
    hello = rig.next_hello()
    rig.send(messages.Open(messages.PROTOCOL_VERSION, hello.board_nonce, HOST_NONCE ^ 1))
    rig.seed = rig.decoder.seed = hello.board_nonce ^ HOST_NONCE ^ 1
    rig._number = 0
    track_width = messages.PARAMETERS["track_width"].id
    for kind, fields in (
        (messages.SetParameter, (track_width, 10_000)),
        (messages.ResetParameters, ()),
        (messages.SaveParameters, ()),
    ):
        answer = rig.request(kind, *fields)
        assert (answer.status, answer.value) == (AnswerStatus.BUSY, 0), kind
    assert rig.request(messages.GetParameter, track_width).value == 12_345
    rig.listen(0.5)
    rig.uno.reset("external")
    assert rig.start(arm=False).parameters_saved == 1
    assert rig.request(messages.GetParameter, track_width).value == 12_345


@pytest.mark.emulated
@pytest.mark.promise("500,000 bit/s unless the board's parameter `baud_rate` says otherwise")
@pytest.mark.promise(
    "sends telemetry every 2, 5, 10, ... ticks, so that it fills no more than half of the line, and says so in `hello`",
)
@pytest.mark.parametrize("baud", [9600, 19200, 38400, 57600, 115200, 250000, 500000, 1000000])
def test_telemetry_fills_no_more_than_half_of_the_line(rig: Rig, baud: int) -> None:
    rig.set("baud_rate", baud // 100)
    assert rig.request(messages.SaveParameters, within_s=1.0).status == AnswerStatus.OK
    rig.uno.reset("external")
    assert isinstance(rig.transport, BaudSelectable)
    rig.transport.set_baud(baud)
    hello = rig.start(arm=False)
    period = next(ticks for ticks in (1, 2, 5, 10) if FRAME_BYTES / (ticks * TICK_S) <= baud / 10 / 2)
    assert hello.telemetry_period == period
    rig.listen(0.5)
    ticks = [message.tick for message in rig.listen(1.0)]
    assert len(ticks) >= 8 and {after - before for before, after in itertools.pairwise(ticks)} == {period}
    assert rig.request(messages.GetParameter, RATE, within_s=1.0).value == baud // 100


@pytest.mark.emulated
@pytest.mark.promise("`devices_telemetry` comes every `devices_period` ticks while one of its devices")
@pytest.mark.uno(robot="boebot")
def test_slow_devices_are_told_every_devices_period(uno: Uno) -> None:
    rig = Rig(uno)
    rig.start(arm=False)
    for period in (2, 5, 20):
        rig.set("devices_period", period)
        rig.listen(0.3)
        begun = len(rig.heard)
        rig.listen(1.0)
        ticks = [message.tick for message in rig.heard[begun:] if isinstance(message, messages.DevicesTelemetry)]
        assert {after - before for before, after in itertools.pairwise(ticks)} == {period}
    rig.set("devices", Devices.SERVO)
    rig.listen(0.1)
    begun = len(rig.heard)
    rig.listen(0.5)
    assert not [message for message in rig.heard[begun:] if isinstance(message, messages.DevicesTelemetry)]


@pytest.mark.emulated
@pytest.mark.promise("A tone that comes twice has the same token and sounds once; a session begins with token 0")
@pytest.mark.uno(robot="boebot")
def test_a_tone_that_comes_twice_sounds_once(uno: Uno) -> None:
    rig = Rig(uno)
    rig.start(arm=False)
    assert rig.devices().buzzer_token == 0
    begun = rig.board.cycle
    for _ in range(5):
        rig.send(messages.Buzzer(1000, 20, 9))
        rig.listen(0.1)
    pulses = rig.uno.pin(BUZZER).all_pulses(begun)
    assert 0.18 <= (pulses[-1].sum() - pulses[0, 0]) / CYCLES_PER_S <= 0.20
    assert rig.devices().buzzer_token == 9
    rig.send(messages.Close(rig.seed))
    rig.start(arm=False)
    assert rig.devices().buzzer_token == 0


@pytest.mark.promise("one event under way at a time, never changes it, and sends it again after `retry_time`")
@pytest.mark.parametrize("retry_ms", [0, 100])
def test_an_event_is_repeated_after_the_retry_time(rig: Rig, retry_ms: int) -> None:
    """By default two ticks and the time of 200 bytes: 24 ms at 500,000 bit/s."""
    rig.arm()
    rig.set("retry_time", retry_ms)
    rig.listen(0.1)
    rig.acknowledges = False
    rig.stop()
    rig.listen(0.05)
    begun = len(rig.heard)
    rig.listen(1.0)
    count = sum(isinstance(message, messages.Event) for message in rig.heard[begun:])
    assert abs(count - 1.0 / (retry_ms / 1000 or 0.024)) <= 2.5
