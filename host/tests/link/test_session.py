"""The handshake alone: the test gives it hellos and the time, and sees what it sends."""

from __future__ import annotations

import random

import pytest
from wire import HELLO, Wire

from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.clock import RoundTrips
from boebot.link.counters import HostCounters
from boebot.link.errors import TakenOverError
from boebot.link.frame import SEED, Decoder
from boebot.link.line import NEVER, Line
from boebot.link.session import Session


class Alone:
    """A session without a link."""

    def __init__(self) -> None:
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
    for now in (0.01, due):
        alone.session.service(now)
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


def test_board_of_another_host_is_left_alone() -> None:
    alone = Alone()
    session = alone.session

    def wait(until: float) -> None:
        alone.wire.time = until
        session.service(until)
        opening = next(iter(alone.sent()), None)
        alone.hello(until, session=77 ^ opening.host_nonce if isinstance(opening, messages.Open) else 99)

    alone.wait = wait  # type: ignore[method-assign]
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
