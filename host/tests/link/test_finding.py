"""Finding the board at a port: the rate at which it speaks, and what answers there if it is none of ours."""

from __future__ import annotations

import random

import pytest
from channel import Channel

from boebot.errors import BoardError, BoebotError, ProtocolError
from boebot.link import messages
from boebot.link.finding import RATES
from boebot.link.frame import SEED, encode
from boebot.link.link import Link
from peer import InProcess, Peer


class Port(InProcess):
    """A port whose rate can be chosen; at any but the board's own it carries garbage."""

    realtime = True
    resets_board = False

    def __init__(self, peer: Peer, own: int | None, asked: int = 500_000, given: bool = False) -> None:
        super().__init__(peer)
        self.own, self.baud, self.baud_given = own, asked, given
        self.tried = [asked]
        self._noise = random.Random("port")

    def set_baud(self, rate: int) -> None:
        self.baud = rate
        self.tried.append(rate)
        self._buffer.clear()

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        pieces = super().read_stamped(wait_s, quiet_s)
        if self.baud == self.own:
            return pieces
        return [(at, self._noise.randbytes(max(1, len(data) * self.baud // 500_000))) for at, data in pieces]

    def write(self, data: bytes) -> None:
        if self.baud == self.own:
            super().write(data)


@pytest.mark.parametrize("own", RATES)
def test_rate_is_found_and_said(own: int) -> None:
    port = Port(Peer(), own)
    link = Link(port)
    link.open()
    assert port.baud == own and port.now() < 2.0
    if own == 500_000:
        assert link.notices == [] and port.tried == [500_000]
    else:
        assert link.notices == [f"the board at peer speaks at {own} baud, not at 500000"]


def test_rate_that_was_given_and_is_wrong_is_said() -> None:
    port = Port(Peer(), 115_200, given=True)
    with pytest.raises(ProtocolError, match="the board at peer speaks at 115200 baud, not at 500000 as asked for"):
        Link(port).open()
    assert port.now() < 2.0


def test_board_in_a_session_of_another_host_is_found_too() -> None:
    """It says hello only five times a second; its telemetry shows the rate."""
    peer = Peer()
    port = Port(peer, 57_600)
    port.read(0.05)
    peer._open(messages.Open(messages.PROTOCOL_VERSION, peer.nonce, 12345))
    Link(port).open()
    assert port.baud == 57_600 and port.now() < 2.5


@pytest.mark.parametrize("spoilt", [0.01, 0.02, 0.05])
def test_line_that_spoils_bytes_is_not_confused_with_another_rate(spoilt: float) -> None:
    """`spoilt` bytes of a hundred are wrong. Where no session comes about in time, that is the error."""
    opened, lines = 0, 30
    for seed in range(lines):
        port = Port(Peer(), 500_000)
        port.channel = Channel(bit_errors=1 - (1 - spoilt) ** (1 / 8), seed=seed)
        link = Link(port)
        said = ""
        try:
            link.open()
            opened += 1
        except BoebotError as error:
            said = str(error)
        assert not said or "spoils what it carries: " in said
        assert link.notices == [] and port.baud == 500_000
    assert opened == lines or (spoilt == 0.05 and opened >= lines / 2)


class LateHello(Port):
    """A board that starts slowly: 0.2 s of silence, then its hello in pieces of 8 bytes."""

    _waiting = b""

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        pieces = super().read_stamped(wait_s if not self._waiting else 0.001, quiet_s)
        if self.now() < 0.2:
            return []
        self._waiting += b"".join(data for _, data in pieces)
        data, self._waiting = self._waiting[:8], self._waiting[8:]
        return [(self.now(), data)]


def test_hello_that_is_not_yet_whole_is_waited_for() -> None:
    port = LateHello(Peer(), 500_000)
    Link(port).open()
    assert port.tried == [500_000]


class Sketch(Port):
    """Other firmware: says something readable, at its own rate."""

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        super().read_stamped(wait_s, quiet_s)
        data = b"Temperature: 21.5 C\r\n"
        return [(self.now(), data if self.baud == self.own else bytes(byte ^ 0xA5 for byte in data))]


class Old(Port):
    """Firmware of another version: its frames have the handshake's checksum, and ids that are not known."""

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        super().read_stamped(wait_s, quiet_s)
        return [(self.now(), encode(messages.Identify.ID, 3, b"other layout", SEED) * 3)]


class Dumb(Port):
    """Sends telemetry of some session, and never says hello."""

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        super().read_stamped(wait_s, quiet_s)
        return [(self.now(), encode(messages.Telemetry.ID, 3, bytes(messages.Telemetry.LENGTH), 77) * 3)]


class Silent(Port):
    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        super().read_stamped(wait_s, quiet_s)
        return []


@pytest.mark.parametrize(
    ("port", "error", "sentence"),
    [
        (Silent(Peer(), None), BoardError, r"nothing answers at peer within 2 s: is the robot on and flashed\?"),
        (
            Sketch(Peer(), 9_600),
            ProtocolError,
            r"does not speak this kit's protocol: other firmware, which says 'Temperature: 21\.5 C.*' at 9600 baud",
        ),
        (
            Port(Peer(), None),
            ProtocolError,
            r"\(\d+ bytes, no valid frame\): other firmware, at no usual baud rate",
        ),
        (Old(Peer(), None), ProtocolError, r"speaks another version of this protocol at 500000 baud"),
        (Dumb(Peer(), None), ProtocolError, r"sends frames but does not say hello within 2 s"),
    ],
    ids=["silent", "sketch", "garbage", "version", "dumb"],
)
def test_other_answers_are_distinguished_in_time(port: Port, error: type[BoebotError], sentence: str) -> None:
    with pytest.raises(error, match=sentence):
        Link(port).open()
    assert port.now() <= 2.05


def test_board_that_opening_resets_is_given_four_seconds() -> None:
    peer = Peer()
    peer.answers = False
    peer.reset()
    port = Port(peer, 500_000)
    port.resets_board = True

    def start() -> None:
        peer.answers = True
        peer.reset()

    port.at(1.8, start)
    Link(port).open()
    assert 1.8 < port.now() < 2.0 and port.tried == [500_000], "waited for at the rate that was asked for"
    silent = Silent(Peer(), None)
    silent.resets_board = True
    with pytest.raises(BoardError, match="nothing answers at peer within 4 s"):
        Link(silent).open()
