"""The session: handshake, refusals, requests, parameters."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from boebot.errors import BoardError, BoebotError, ProtocolError
from boebot.link import frame, messages
from boebot.link.session import Link, text
from peer import InProcess, Peer


def link_to(peer: Peer) -> Link:
    return Link(InProcess(peer))


def test_handshake_with_a_board_that_has_just_started() -> None:
    link = link_to(Peer())
    hello = link.handshake()
    assert hello.schema_hash == messages.SCHEMA_HASH
    assert text(hello.pin_map) == "shieldbot"
    assert link.sent == [], "a board that says hello need not be asked"


def test_handshake_with_a_board_that_has_run_for_a_while() -> None:
    peer = Peer()
    session = InProcess(peer)
    session.read(1.0, 1.0)  # its hello has gone by
    link = Link(session)
    assert link.handshake().tick_rate == 100
    assert link.decoder.lost == link.decoder.bad == 0
    assert link.poll(0.05), "telemetry goes on"


def test_other_protocol_version_is_refused_and_both_are_named() -> None:
    peer = Peer()
    peer.protocol_version = 9
    peer.reset()
    with pytest.raises(ProtocolError, match=rf"version 9.*version {messages.PROTOCOL_VERSION}"):
        link_to(peer).handshake()


def test_other_schema_is_refused_and_both_are_named() -> None:
    peer = Peer()
    peer.schema_hash = 0xDEADBEEF
    peer.reset()
    with pytest.raises(ProtocolError, match=rf"deadbeef.*{messages.SCHEMA_HASH:08x}"):
        link_to(peer).handshake()


def test_board_without_control_ticks_is_refused() -> None:
    peer = Peer()
    peer.tick_rate = 0
    peer.reset()
    with pytest.raises(ProtocolError, match="makes 0 control ticks in a second; expected more"):
        link_to(peer).handshake()


class Noise(InProcess):
    """Something that sends bytes of another kind."""

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        super().read(wait_s, quiet_s)
        return b"Hello from another sketch\r\n"


class Silence(InProcess):
    """A port that nobody answers at."""

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        self._now += wait_s
        return b""


class Mute(InProcess):
    """A board that sends telemetry but answers nothing."""

    def write(self, data: bytes) -> None:
        del data


@pytest.mark.parametrize(
    ("kind", "error", "sentence"),
    [
        (Silence, BoardError, "nothing answers"),
        (Noise, ProtocolError, "does not speak this kit's protocol"),
        (Mute, ProtocolError, "does not say hello"),
    ],
)
def test_what_does_not_answer_is_told_apart(
    kind: Callable[[Peer], InProcess], error: type[BoebotError], sentence: str
) -> None:
    session = kind(Peer())
    if kind is Mute:
        session.read(0.5, 0.5)
    with pytest.raises(error, match=sentence):
        Link(session).handshake()
    assert session.now() < 2.0, "the verdict comes in time"


def test_request_is_repeated_until_it_is_answered() -> None:
    peer = Peer()
    session = InProcess(peer)
    link = Link(session)
    link.handshake()
    losses = [True, True, False]
    whole = session.write
    session.write = lambda data: None if losses and losses.pop(0) else whole(data)  # type: ignore[method-assign]
    assert link.set_parameter("infrared_period", 7) == 7
    assert peer.parameters == {messages.PARAMETERS["infrared_period"].id: 7}


def test_request_that_is_never_answered_ends_in_one_sentence() -> None:
    session = InProcess(Peer())
    link = Link(session)
    link.handshake()
    session.write = lambda data: None  # type: ignore[method-assign]
    with pytest.raises(BoardError, match="did not say which image it runs, though asked 5 times"):
        link.identity()


def test_telemetry_that_comes_during_a_request_is_kept() -> None:
    session = InProcess(Peer())
    link = Link(session)
    link.handshake()
    answers: list[bytes] = []
    whole = session.write

    def answer_late(data: bytes) -> None:
        answers.append(data)
        if len(answers) == 2:
            whole(data)

    session.write = answer_late  # type: ignore[method-assign]
    link.identity()
    ticks = [messages.Telemetry.unpack(payload).tick for payload in link.poll(0.02)]
    assert len(ticks) >= 10 and ticks == list(range(ticks[0], ticks[0] + len(ticks)))


@pytest.mark.parametrize("value", [1, 251, -5])
def test_parameter_out_of_range_is_refused_before_it_is_sent(value: float) -> None:
    link = link_to(Peer())
    link.handshake()
    with pytest.raises(BoebotError, match=r"infrared_period cannot be .* ticks; expected 2 to 250"):
        link.set_parameter("infrared_period", value)
    assert link.sent == []


def test_unknown_parameter_is_named() -> None:
    with pytest.raises(BoebotError, match="no parameter 'speed'; expected one of devices"):
        link_to(Peer()).get_parameter("speed")


def test_parameter_travels_in_its_unit() -> None:
    peer = Peer()
    link = link_to(peer)
    link.handshake()
    assert link.set_parameter("servo_left_centre", 1499.5) == 1499.5
    assert peer.parameters[messages.PARAMETERS["servo_left_centre"].id] == 23992
    assert link.get_parameter("servo_left_centre") == 1499.5


@pytest.mark.parametrize(
    ("status", "reason"), [(messages.ParameterStatus.OUT_OF_RANGE, "out of range"), (99, "status 99")]
)
def test_board_that_refuses_a_parameter_is_believed(status: int, reason: str) -> None:
    peer = Peer()
    link = link_to(peer)
    link.handshake()
    refusal = messages.Parameter(messages.PARAMETERS["devices"].id, 0, status)
    peer.receive = lambda data: peer._send(refusal)  # type: ignore[method-assign]
    with pytest.raises(BoardError, match=f"refuses parameter devices: {reason}"):
        link.set_parameter("devices", 3)


def test_set_points_are_numbered_and_name_their_tick() -> None:
    peer = Peer()
    link = link_to(peer)
    link.handshake()
    link.send_signal(0.5, -1.0, 250, 0x12345)
    link.send_speed(0.1, -0.05, 250, 0x12346)
    link.send_stop()
    assert peer.setpoints == [
        messages.SetpointSignal(5000, -10000, 250, 0x2345),
        messages.SetpointSpeed(1000, -500, 250, 0x2346),
        messages.Stop(),
    ]
    assert peer.decoder.lost == 0
    sent = frame.Decoder(frame.TO_BOARD).feed(b"".join(data for _, data in link.sent))
    assert [sequence for _, sequence, _ in sent] == [0, 1, 2]
