"""The session: handshake, refusals, requests, events, stop, parameters, and what happens when it ends."""

from __future__ import annotations

import itertools
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from types import SimpleNamespace

import pytest
from channel import Channel, uniform
from linked import Recorded, listen, newest_tick, open_link, sent, sent_kinds, tick_of

from boebot.errors import BoardError, BoebotError, ProtocolError
from boebot.link import finding, messages
from boebot.link.errors import LatchedAgainError, SessionLostError, TakenOverError
from boebot.link.frame import encode, text
from boebot.link.link import Link
from boebot_timing.board import measure
from peer import InProcess, Peer, without

Latch = messages.Latch
ROUND_S = 0.04 * (len(messages.Task) + 1)
"""In which the time of each task and the counters come once, one of them with every fourth telemetry."""


# ---- handshake -------------------------------------------------------------------------------------------------------


def test_host_is_silent_until_the_hello() -> None:
    peer = Peer()
    peer.answers = False
    peer.reset()
    session = InProcess(peer)
    link = Recorded(session)
    with pytest.raises(BoardError, match="nothing answers"):
        link.open(0.5)
    assert sent(link) == []


@pytest.mark.parametrize("ran_for_s", [0.0, 0.25, 3.0])
def test_opening_at_any_time(ran_for_s: float) -> None:
    peer = Peer()
    session = InProcess(peer)
    session.read(ran_for_s, ran_for_s)
    link = Recorded(session)
    hello = link.open()
    assert hello.session == peer.session == peer.openings[-1]
    assert text(hello.robot) == "shieldbot"
    assert session.now() - ran_for_s < 0.13, "a hello every 10 ticks, and one in answer"
    assert listen(link, 0.05), "telemetry flows"
    assert link.counters().lost == link.counters().bad == 0
    assert len(peer.openings) == 1


def test_lost_open_and_lost_hello_are_made_good() -> None:
    peer = Peer()
    session = InProcess(peer)
    whole = session.channel.carry
    losses = {"board": 3, "host": 2}

    def lossy(way: str, frame: bytes, at_s: float) -> list[tuple[float, bytes]]:
        if losses[way] and sent(link):
            losses[way] -= 1
            return []
        return whole(way, frame, at_s)

    session.channel.carry = lossy  # type: ignore[method-assign]
    link = Recorded(session)
    link.open()
    assert losses == {"board": 0, "host": 0}
    assert len(peer.openings) == 1, "an open that comes again confirms"


def test_other_protocol_version_is_refused_and_both_are_named() -> None:
    peer = Peer()
    ours = finding.version_name()
    for version, name in ((2, "2"), (0x41, r"4\.1")):
        peer.protocol_version = version
        peer.reset()
        with pytest.raises(ProtocolError, match=rf"version {name}, this kit speaks version {re.escape(ours)};"):
            Link(InProcess(peer)).open()


ADDED = 0x9E  # a message that no minor version has yet


def test_host_talks_to_a_board_that_has_more_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    """A later minor version: what it adds is counted and ignored."""
    peer = Peer()
    peer.protocol_version += 1
    session = InProcess(peer)
    usual = peer._telemetry

    def telemetry() -> messages.Telemetry:
        peer._frames.append(encode(ADDED, peer._sequence, b"more", peer.session))
        peer._sequence = (peer._sequence + 1) & 0xFF
        return usual()._replace(ping_status=9)

    monkeypatch.setattr(peer, "_telemetry", telemetry)
    link = Recorded(session)
    link.open()
    seen = listen(link, 0.5)
    assert len(seen) >= 45 and link.parameters.get("track_width") > 0
    counters = link.counters()
    assert counters.unknown >= 45 and (counters.bad, counters.lost, counters.stray) == (0, 0, 0)
    assert link.telemetry.latest is not None
    assert messages.PingStatus(messages.Telemetry.unpack(link.telemetry.latest).ping_status).name == "UNKNOWN_9"


def test_host_that_knows_more_talks_to_a_board_and_leaves_out_what_came_later(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer()
    monkeypatch.setattr(messages, "PROTOCOL_VERSION", messages.PROTOCOL_VERSION + 1)
    later = messages.PARAMETERS["start_beep"]._replace(
        id=len(messages.PARAMETERS), since=messages.PROTOCOL_VERSION % 16
    )
    monkeypatch.setitem(messages.PARAMETERS, "later", later)
    link = Link(InProcess(peer))
    link.open()
    assert listen(link, 0.1) and "later" not in link.parameters.names and "start_beep" in link.parameters.names
    added = SimpleNamespace(ID=ADDED & 0x7F, STRUCT=struct.Struct("4s"))
    link.line.send_fields(added, b"more")  # type: ignore[arg-type]
    listen(link, 0.1)
    assert (peer.decoder.unknown, peer.decoder.bad) == (1, 0)


def _shorter_event(peer: Peer) -> None:
    peer.described[messages.Event.ID] = (5, 77)


def _other_fields(peer: Peer) -> None:
    peer.described[messages.Telemetry.ID] = (messages.Telemetry.LENGTH, 77)


def _unknown_message(peer: Peer) -> None:
    peer.described[0x55] = (3, 77)


def _missing_message(peer: Peer) -> None:
    del peer.described[messages.Arm.ID]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (_shorter_event, r"message event \(0xa1\) has 5 bytes there, 9 here"),
        (_other_fields, r"the fields of message telemetry \(0x90\) differ"),
        (_unknown_message, r"its message 0x55 is not known here"),
        (_missing_message, r"it does not know message arm \(0x24\)"),
        (lambda peer: None, "the messages agree, but flags, values or parameters differ"),
    ],
)
def test_other_schema_is_refused_and_the_message_that_differs_is_named(
    change: Callable[[Peer], None], sentence: str
) -> None:
    peer = Peer()
    peer.schema_hash = 0xDEADBEEF
    change(peer)
    peer.reset()
    session = InProcess(peer)
    with pytest.raises(ProtocolError, match=f"schema deadbeef, this kit with {messages.SCHEMA_HASH:08x}: {sentence}; "):
        Link(session).open()
    assert session.now() < 1.0


def test_board_without_control_ticks_is_refused() -> None:
    peer = Peer()
    peer.tick_rate = 0
    peer.reset()
    with pytest.raises(ProtocolError, match="makes 0 control ticks in a second; expected more"):
        Link(InProcess(peer)).open()


def test_board_of_another_kind_in_mid_session_is_refused() -> None:
    link, peer, _ = open_link()
    peer.schema_hash = 0xDEADBEEF
    peer.reset()
    with pytest.raises(ProtocolError, match="schema deadbeef"):
        listen(link, 1.0)


class Noise(InProcess):
    """Something that sends bytes of another kind."""

    data = b"Hello from another sketch\r\n"

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        super().read_stamped(wait_s, quiet_s)
        return [(self.now(), self.data)]


class Garbage(Noise):
    data = bytes(range(128, 256)) + b"\0"


class Mute(InProcess):
    """A board that hears nothing."""

    def write(self, data: bytes) -> None:
        del data


@pytest.mark.parametrize(
    ("kind", "error", "sentence"),
    [
        (Noise, ProtocolError, "does not speak this kit's protocol: other firmware, which says 'Hello from another"),
        (Garbage, ProtocolError, "does not speak this kit's protocol .* no valid frame"),
        (Mute, BoardError, "says hello, but does not hear us: no session within 2 s"),
    ],
)
def test_what_does_not_answer_is_distinguished(
    kind: Callable[[Peer], InProcess], error: type[BoebotError], sentence: str
) -> None:
    session = kind(Peer())
    with pytest.raises(error, match=sentence):
        Link(session).open()
    assert session.now() <= 2.01, "the verdict comes in time"


def test_session_of_another_host_is_waited_for() -> None:
    first, peer, session = open_link()
    second = Link(session)
    second.open()
    assert 1.0 < session.now() < 1.3, "after the board's patience with the first"
    assert peer.session == second.session.hello.session  # type: ignore[union-attr]
    del first


def test_board_that_another_host_keeps_is_busy() -> None:
    peer = Peer()
    session = InProcess(peer)
    link = Recorded(session)
    session.read(0.05, 0.05)
    peer._open(messages.Open(messages.PROTOCOL_VERSION, peer.nonce, 12345))

    def keep(_: int) -> None:
        peer._heard_s = session.now()

    session.before_tick = keep
    with pytest.raises(TakenOverError, match="the board at peer is busy: another program drives it"):
        link.open()
    assert sent(link) == [], "and is not disturbed"


def test_host_that_was_replaced_gives_way() -> None:
    link, peer, _ = open_link()
    peer._open(messages.Open(messages.PROTOCOL_VERSION, peer.nonce, 12345))
    with pytest.raises(TakenOverError, match="another program has taken the board at peer"):
        listen(link, 0.5)
    assert peer.session == peer.openings[-1] and len(peer.openings) == 2


def test_close_ends_the_session_at_once() -> None:
    link, peer, session = open_link()
    link.arm()
    link.close()
    session.read(0.01, 0.01)
    assert peer.session == 0 and peer.latch == Latch.SESSION_ENDED
    begun = session.now()
    assert Link(session).open() and session.now() - begun < 0.15


# ---- ends and resets -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at_ms", [0, 3, 7, 50, 333])
def test_reset_at_any_moment_and_the_traffic_resumes(at_ms: int) -> None:
    link, peer, session = open_link()
    listen(link, 0.5 + at_ms / 1000)
    reset_s = session.now()
    peer.reset()
    while link.counts.sessions == 1 or not listen(link, 0.005):
        listen(link, 0.001)
        assert session.now() - reset_s < 1.0
    assert session.now() - reset_s < 0.05, "the board says hello at once"
    assert (link.counts.sessions, link.counts.board_resets, link.counts.sessions_lost) == (2, 1, 1)
    assert peer.latch == Latch.START


def test_reset_during_a_request_is_said() -> None:
    link, peer, _session = open_link()
    request = link.submit(messages.SetParameter, 7, 9, what="set parameter infrared_period")
    peer.reset()
    listen(link, 0.1)
    assert isinstance(request.error, SessionLostError)
    assert "whether it was done is not known" in str(request.error) or "it was not done" in str(request.error)
    assert link.session.is_open and link.parameters.set("infrared_period", 9) == 9


def test_host_that_slept_finds_its_session_ended_and_opens_another() -> None:
    link, peer, session = open_link()
    link.arm()
    session.read(3.0, 3.0)
    assert peer.session == 0 and peer.latch == Latch.SESSION_ENDED
    assert listen(link, 0.2)
    assert (link.counts.sessions, link.counts.board_resets) == (2, 0)
    assert peer.latch == Latch.SESSION_ENDED, "not armed by itself"


@pytest.mark.parametrize("time_out_ms", [200, 1000, 1500])
def test_idle_host_keeps_the_session(time_out_ms: int) -> None:
    link, _peer, _session = open_link()
    link.parameters.set("session_time_out", time_out_ms / 1000)
    before = len([kind for kind in sent_kinds(link) if kind == "clock_probe"])
    listen(link, 6 + 20 * time_out_ms / 1000)
    probes = [at for at, frame in sent(link) if frame[2] == messages.ClockProbe.ID][before:]
    late = [b - a for a, b in itertools.pairwise(probes)]
    assert link.counts.sessions == 1
    assert max(late) <= time_out_ms / 4000, "at least four in that time"
    assert len(set(late)) > len(late) / 2, "at irregular intervals"


def test_late_hello_of_the_time_before_does_no_harm() -> None:
    peer = Peer()
    trace: list[tuple[float, str, bytes]] = []
    link, peer, session = open_link(peer, Channel(trace=trace))
    hellos = [frame for _, way, frame in trace if way == "host" and frame[2] == messages.Hello.ID]
    session._schedule(session.now() + 0.03, "host", hellos[0])
    listen(link, 0.5)
    assert link.counts.sessions == 1


def test_frames_of_an_earlier_session_are_refused() -> None:
    link, peer, _session = open_link()
    link.arm()
    link.send_signal(1.0, 1.0, 2000, peer.ticks)
    old = [frame for _, frame in sent(link) if frame[2] not in (messages.Open.ID,)]
    peer.reset()
    listen(link, 0.1)
    link.arm()
    good = peer.decoder.good
    carried_out = len(peer.carried_out)
    for frame in old:
        peer.receive(frame)
    assert (peer.decoder.good, len(peer.carried_out)) == (good, carried_out)
    assert not peer.moving


def test_frames_of_an_earlier_session_would_count_without_the_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the seed is good for: the test above fails without it."""
    from boebot.link import line as module
    from boebot.link.frame import SEED, Decoder, encode

    monkeypatch.setattr(module, "encode", lambda number, sequence, payload, _: encode(number, sequence, payload, SEED))

    class Seedless(Decoder):
        seed = property(lambda self: SEED, lambda self, _: Decoder.seed.fset(self, SEED))  # type: ignore[attr-defined]

    monkeypatch.setattr(module, "Decoder", Seedless)
    link, peer, _session = open_link(Peer(protections=without(seed=False)))
    link.arm()
    old = [frame for _, frame in sent(link) if frame[2] == messages.Arm.ID]
    peer.reset()
    listen(link, 0.1)
    good = peer.decoder.good
    peer.receive(old[0])
    assert peer.decoder.good == good + 1


# ---- requests --------------------------------------------------------------------------------------------------------


def test_request_is_repeated_until_it_is_answered_and_carried_out_once() -> None:
    link, peer, session = open_link()
    whole = session.channel.carry
    losses = [True, False, True, True, False]

    def lossy(way: str, frame: bytes, at_s: float) -> list[tuple[float, bytes]]:
        if frame[2] in (messages.SetParameter.ID, messages.Answer.ID) and losses and losses.pop(0):
            return []
        return whole(way, frame, at_s)

    session.channel.carry = lossy  # type: ignore[method-assign]
    assert link.parameters.set("infrared_period", 7) == 7
    assert [message for _, message in peer.carried_out] == [messages.SetParameter(1, 7, 7)]
    assert link.counters().retransmitted >= 2 and peer.counts["duplicate"] >= 1


def test_request_that_is_never_answered_ends_in_one_sentence_and_the_next_is_answered() -> None:
    link, peer, session = open_link()
    whole = session.channel.carry
    session.channel.carry = lambda way, frame, at_s: (  # type: ignore[method-assign]
        [] if frame[2] == messages.SetParameter.ID else whole(way, frame, at_s)
    )
    begun = session.now()
    with pytest.raises(BoardError, match=r"did not set parameter infrared_period within 2 s, though asked \d+ times"):
        link.parameters.set("infrared_period", 7)
    assert session.now() - begun < 2.1
    session.channel.carry = whole  # type: ignore[method-assign]
    assert link.parameters.get("infrared_period") == 5
    assert peer.parameter("infrared_period") == 5


def test_slow_line_is_not_flooded_with_retries() -> None:
    """A round trip of 40 ms, as by Bluetooth: once it is known, answers are waited for."""
    link, _, _ = open_link(channel=Channel(to_board=uniform(0.019, 0.020), to_host=uniform(0.019, 0.020)))
    listen(link, 1.0)
    before = link.counters().retransmitted
    for _ in range(10):
        link.parameters.get("infrared_period")
    assert link.counters().retransmitted == before


# ---- arming and stop -------------------------------------------------------------------------------------------------


def test_armed_board_obeys_until_it_is_stopped() -> None:
    link, peer, _session = open_link()
    ticks = listen(link, 0.02)
    link.send_signal(0.5, 0.5, 250, ticks[-1])
    listen(link, 0.02)
    assert not peer.moving and peer.accepted == [], "latched"
    link.arm()
    ticks = listen(link, 0.02)
    link.send_signal(0.5, 0.5, 250, ticks[-1])
    listen(link, 0.01)
    assert peer.moving
    assert link.stop_and_confirm()
    assert peer.latch == Latch.STOP_COMMAND and not peer.moving


def test_stop_is_sent_again_until_it_is_confirmed() -> None:
    link, peer, session = open_link()
    link.arm()
    whole = session.channel.carry
    losses = [True, True, False, True]

    def lossy(way: str, frame: bytes, at_s: float) -> list[tuple[float, bytes]]:
        if frame[2] in (messages.Stop.ID, messages.Stopped.ID) and losses and losses.pop(0):
            return []
        return whole(way, frame, at_s)

    session.channel.carry = lossy  # type: ignore[method-assign]
    begun = session.now()
    assert link.stop_and_confirm()
    assert peer.stops == 2 and session.now() - begun < 0.05, "again after a tick and 20 bytes"


def test_stop_goes_before_a_request_under_way() -> None:
    link, peer, session = open_link()
    session.channel.stalled = True
    link.submit(messages.GetParameter, 7, what="send it")
    listen(link, 0.1)
    session.channel.stalled = False
    link.stop()
    listen(link, 0.003)
    assert peer.stops == 1


def test_stop_that_nobody_confirms_is_said() -> None:
    link, _, session = open_link()
    session.channel.stalled = True
    assert not link.stop_and_confirm(0.3)


def test_arm_does_not_undo_a_stop_that_it_does_not_know_of() -> None:
    link, peer, _session = open_link()
    listen(link, 0.05)
    peer._latch(Latch.STOP_COMMAND)
    with pytest.raises(LatchedAgainError):
        link.arm()
    assert peer.latch != Latch.NONE
    link.arm()
    listen(link, 0.02)
    assert link.telemetry.latest is not None and not messages.Telemetry.unpack(link.telemetry.latest).latch


def test_arm_would_undo_it_without_the_count_of_latches() -> None:
    link, peer, _ = open_link(Peer(protections=without(latches=False)))
    listen(link, 0.05)
    peer._latch(Latch.STOP_COMMAND)
    link.arm()
    assert peer.latch == Latch.NONE


def test_arm_is_refused_while_the_supply_is_low() -> None:
    link, peer, _ = open_link()
    listen(link, 0.05)
    peer.supply_mv = 3900
    listen(link, 0.05)
    with pytest.raises(BoardError, match=r"does not arm its motors: its supply is low \(3\.90 V\)"):
        link.arm()


# ---- events ----------------------------------------------------------------------------------------------------------


def test_events_come_once_and_in_order_over_a_bad_line() -> None:
    link, peer, _session = open_link(channel=Channel(loss=0.3, duplication=0.3, seed=7))
    sent_values: list[int] = []
    received: list[int] = []
    for number in range(200):
        peer._happened(messages.EventKind.DEAD_MAN, number)
        sent_values.append(number)
        for _ in range(12):
            listen(link, 0.01)
            received += [event.value for event in link.events.fetch() if event.kind == messages.EventKind.DEAD_MAN]
    listen(link, 1.0)
    received += [event.value for event in link.events.fetch() if event.kind == messages.EventKind.DEAD_MAN]
    assert link.counts.sessions == 1
    assert received == sorted(set(received)), "each once, in order"
    assert len(received) == len(sent_values) - peer.counts["deferred"] and received[-1] == sent_values[-1]
    assert link.counters().duplicate > 0


# ---- set-points and telemetry ----------------------------------------------------------------------------------------


def test_set_points_name_their_tick() -> None:
    link, peer, _ = open_link()
    link.send_signal(0.5, -1.0, 250, 0x12345)
    link.send_speed(0.1, -0.05, 250, 0x12346)
    link.send_coast(100, 0x12347)
    listen(link, 0.02)
    assert peer.setpoints == [
        messages.SetpointSignal(5000, -10000, 250, 0x2345),
        messages.SetpointSpeed(1000, -500, 250, 0x2346),
        messages.SetpointCoast(100, 0x2347),
    ]
    assert peer.decoder.lost == 0


@pytest.mark.parametrize("protected", [True, False])
def test_motion_held_up_for_two_seconds_moves_nothing(protected: bool) -> None:
    """The line stalls with motion commands queued and lets them all go at once; without the age they would count."""
    channel = Channel()
    peer = Peer(protections=without(age=protected))
    link, peer, _session = open_link(peer, channel)
    link.parameters.set("session_time_out", 1.5)
    link.arm()
    channel.stalled = True
    for _ in range(100):
        listen(link, 0.01)
        link.send_signal(1.0, 1.0, 250, newest_tick(link))
    for _ in range(40):
        listen(link, 0.01)
    channel.stalled = False
    moved = False
    for frame in channel.held:
        peer.receive(frame)
        moved |= peer.moving
    assert peer.session and len(peer.setpoints) == 100
    assert moved is not protected


def test_telemetry_that_comes_during_a_request_is_kept() -> None:
    link, _, session = open_link()
    session.channel.stalled = True
    request = link.submit(messages.GetParameter, 7, what="send it")
    while not request.done and session.now() < 0.2:
        link._turn(0.2)
    ticks = [tick_of(payload) for payload, *_ in link.telemetry.fetch()]
    assert len(ticks) >= 15 and ticks == list(range(ticks[0], ticks[0] + len(ticks)))


def test_late_telemetry_is_counted() -> None:
    """Later than three periods of 10 ms after its tick; the line itself takes 0.9 ms."""
    channel = Channel()
    link, _, _ = open_link(channel=channel)
    listen(link, 2.0)
    channel.to_host = lambda _: 0.025
    listen(link, 0.5)
    assert link.counters().late == 0
    channel.to_host = lambda _: 0.035
    listen(link, 0.5)
    late = link.counters().late
    assert 45 <= late <= 50
    channel.to_host = lambda _: 0.0
    listen(link, 0.5)
    assert link.counters().late - late <= 4, "those that were under way"


def test_stops_without_a_host_are_reported_in_the_next_session() -> None:
    """The host sleeps in mid-drive: dead-man, end of the session. Both come with their times, once, and are earlier."""
    link, peer, session = open_link()
    link.arm()
    listen(link, 0.1)
    link.events.fetch()
    link.send_signal(0.5, 0.5, 250, peer.ticks - 1)
    listen(link, 0.05)
    asleep = session.now()
    while session.now() < asleep + 3.0:
        session._buffer.clear()
        InProcess.read_stamped(session, 0.1)
    session._buffer.clear()
    assert not peer.session
    listen(link, 1.0)
    found = link.events.fetch()
    assert [(event.kind, event.value) for event in found] == [
        (messages.EventKind.DEAD_MAN, peer.accepted[-1].answers_tick),
        (messages.EventKind.LATCH, messages.Latch.SESSION_ENDED),
    ]
    assert all(event.earlier for event in found)
    times = [event.time - asleep for event in found]
    assert times == pytest.approx([0.2, 1.0], abs=0.06)
    link.arm()
    listen(link, 0.1)
    assert [(event.value, event.earlier) for event in link.events.fetch()] == [(messages.Latch.NONE, False)]


@pytest.mark.parametrize("first_tick", [0, 0xFFFF - 50, 0xFFFFFFFF - 50])
def test_ticks_roll_over(first_tick: int) -> None:
    peer = Peer()
    peer.first_tick = first_tick
    peer.reset()
    link, peer, _ = open_link(peer)
    link.arm()
    for _ in range(100):
        listen(link, 0.01)
        link.send_signal(0.1, 0.1, 250, newest_tick(link))
    listen(link, 0.02)
    assert len(peer.accepted) >= 98 and peer.counts["late"] <= 2


def test_longest_times_of_tasks_are_those_of_this_session() -> None:
    link, peer, _ = open_link()
    assert set(link.task_times.values()) == {None}
    names = [task.name.lower() for task in messages.Task]
    peer.task_times = [100 + number for number in range(len(names))]
    assert measure(link, 0.0) == dict(zip(names, peer.task_times, strict=True))
    peer.task_times[3] = 65535
    assert measure(link, 0.0)[names[3]] == link.task_times[names[3]] == 65535
    peer.reset()
    listen(link, 0.1)
    assert link.session.is_open and link.task_times[names[3]] is None
    assert set(measure(link, 0.0).values()) == {0}


def test_longest_times_lost_on_the_line_come_again() -> None:
    link, peer, _ = open_link(channel=Channel(loss=0.2))
    peer.task_times = [7] * len(messages.Task)
    assert set(measure(link, 0.0).values()) == {7}
    assert link.counters().lost > 10


@pytest.mark.parametrize("period", [1, 10])
def test_measuring_the_tasks_lasts_as_long_as_asked_and_a_round(period: int) -> None:
    peer = Peer()
    peer.telemetry_period = period
    link, peer, _ = open_link(peer)
    begun, round_s = link.transport.now(), ROUND_S * period
    measure(link, 1.0)
    assert 1.0 + round_s <= link.transport.now() - begun < 1.0 + round_s + 0.1


def test_a_board_that_leaves_out_a_task_is_named_with_it() -> None:
    link, peer, _ = open_link()
    peer.silent_tasks = {messages.Task.TURRET, messages.Task.DEVICES}
    begun = link.transport.now()
    with pytest.raises(BoardError, match=f"tasks turret, devices within {0.5 + 4 * ROUND_S:.1f} s"):
        measure(link, 0.5)
    assert link.transport.now() - begun < 0.7 + 4 * ROUND_S


def test_a_task_that_this_kit_does_not_know_is_left_out() -> None:
    link, _, _ = open_link()
    link._handlers[messages.TaskTime.ID](messages.TaskTime(len(messages.Task), 9).pack(), 0.0)
    assert set(link.task_times.values()) == {None}


def test_same_run_twice_is_the_same_to_the_last_byte() -> None:
    traces: list[list[tuple[float, str, bytes]]] = [[], []]
    for trace in traces:
        link, _, _ = open_link(channel=Channel(trace=trace))
        listen(link, 2.0)
    assert traces[0] == traces[1] and len(traces[0]) > 200


def test_the_link_is_imported_on_every_system() -> None:
    """A port is not before one is opened, with what only POSIX has."""
    script = (
        "import sys\n"
        "for name in ('fcntl', 'grp', 'pty', 'serial', 'termios', 'tty'):\n    sys.modules[name] = None\n"
        "import boebot.boards, boebot.link.link\n"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
