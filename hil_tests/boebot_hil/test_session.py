"""PROTOCOL.md, Session: how one begins, what belongs to it, and how it ends."""

from __future__ import annotations

import itertools

import pytest

from boebot.link import frame, messages
from boebot_hil.rig import HOST_NONCE, TICK_S, Rig

pytestmark = pytest.mark.uno(robot="shieldbot", motors=False)

OTHER_NONCE = 0x012345


def closed(rig: Rig) -> messages.Hello:
    """The board's hello after the end of its session, of which nothing keeps it."""
    rig.alive = rig.acknowledges = False
    rig.answers.clear()
    rig.send(messages.Close(rig.seed))
    return rig.next(messages.Hello, 0.1)


def unstuff(piece: bytes) -> bytes:
    """What a piece between two delimiters holds, its check bytes left out."""
    content, at = b"", 0
    stuffed = piece[:-3]
    while at < len(stuffed):
        end = at + stuffed[at]
        content += stuffed[at + 1 : end] + (b"\0" if end < len(stuffed) else b"")
        at = end
    return content


@pytest.mark.promise("Without a session it sends `hello` at once", "drops every frame that is not of the handshake")
def test_without_a_session_the_board_says_hello_and_hears_the_handshake_alone(rig: Rig) -> None:
    hello = closed(rig)
    assert hello.session == 0
    begun = len(rig.heard)
    for _ in range(10):
        rig.send(messages.Stop(1))
        rig.send(messages.ClockProbe(1))
        rig.send(messages.GetParameter(1, 1))
        rig.listen(0.1)
    heard = rig.heard[begun:]
    assert {type(message) for message in heard} == {messages.Hello}
    assert 9 <= len(heard) <= 11 and {message.board_nonce for message in heard} == {hello.board_nonce}


@pytest.mark.promise("It draws another one at each start, at each opening and at each end of a session")
def test_the_nonce_is_another_one_at_each_opening_and_at_each_end(rig: Rig) -> None:
    nonces = []
    for _ in range(10):
        nonces.append(rig.next_hello().board_nonce)
        nonces.append(closed(rig).board_nonce)
        rig.start(arm=False)
    assert len(set(nonces)) == len(nonces) and all(0 <= nonce < 1 << 21 for nonce in nonces)


@pytest.mark.promise("if board nonce XOR host nonce is the open session, it answers with `hello`")
def test_the_same_open_again_is_only_answered(rig: Rig) -> None:
    rig.latest()
    before = rig.telemetry[-1]
    open_again = messages.Open(messages.PROTOCOL_VERSION, rig.seed ^ HOST_NONCE, HOST_NONCE)
    for _ in range(5):
        assert rig.ask(open_again, messages.Hello, 2.5 * TICK_S).session == rig.seed
    after = rig.latest()
    assert (after.latch, after.latches) == (before.latch, before.latches)
    assert rig.request(messages.GetParameter, 1).number == rig._number, "numbers go on"


@pytest.mark.promise(
    "if the version is its own, the board nonce is the one in force and the seed is neither 0 nor the handshake's",
    "Any other `open` is dropped",
)
@pytest.mark.parametrize("what", ["another version", "an old nonce", "seed 0", "the handshake's seed"])
def test_an_open_that_is_not_valid_is_dropped(rig: Rig, what: str) -> None:
    used = rig.seed ^ HOST_NONCE
    nonce = rig.next_hello().board_nonce
    version, board, host = {
        "another version": (messages.PROTOCOL_VERSION + 16, nonce, OTHER_NONCE),
        "an old nonce": (messages.PROTOCOL_VERSION, used, OTHER_NONCE),
        "seed 0": (messages.PROTOCOL_VERSION, nonce, nonce),
        "the handshake's seed": (messages.PROTOCOL_VERSION, nonce, nonce ^ frame.SEED),
    }[what]
    before = rig.latest()
    rig.answers.clear()
    for _ in range(3):
        rig.send(messages.Open(version, board, host))
        rig.listen(0.1)
    hellos = [answer for answer in rig.answers if isinstance(answer, messages.Hello)]
    assert hellos and {hello.session for hello in hellos} == {rig.seed}
    assert {hello.board_nonce for hello in hellos} == {nonce}
    assert rig.latest().latches == before.latches


@pytest.mark.promise("Host and board talk, and may ignore whose minor version is the later one")
@pytest.mark.promise(
    "it begins anew and answers with `hello`: the motors are latched off (`session_ended`, unless they are already), "
    "request and event numbers begin at 1 again",
)
def test_another_open_begins_anew_also_of_a_later_minor_version(rig: Rig) -> None:
    rig.request(messages.GetParameter, 1)
    expected = rig.latest().latch or messages.Latch.SESSION_ENDED
    hello = rig.next_hello()
    old = rig.encode(messages.Stop(1))
    rig.send(messages.Open(messages.PROTOCOL_VERSION | 15, hello.board_nonce, OTHER_NONCE))
    rig.seed = rig.decoder.seed = hello.board_nonce ^ OTHER_NONCE
    rig._number = 0
    rig.events.clear()
    assert rig.request(messages.GetParameter, 1).number == 1
    now = rig.latest()
    assert rig.hello is not None and rig.hello.session == rig.seed
    assert now.latch == expected and now.status & messages.Status.LATCHED
    assert not rig.events or rig.events[0].number == 1
    rig.answers.clear()
    rig.transport.write(old)
    rig.listen(0.05)
    assert not any(isinstance(answer, messages.Stopped) for answer in rig.answers)


@pytest.mark.promise("In a session the board sends `hello` every 20 ticks")
def test_in_a_session_hello_comes_every_20_ticks(rig: Rig) -> None:
    rig.listen(0.3)
    begun = len(rig.heard)
    rig.listen(2.0)
    tick, ticks = 0, []
    for message in rig.heard[begun:]:
        if isinstance(message, messages.Telemetry):
            tick = message.tick
        elif isinstance(message, messages.Hello):
            ticks.append(tick)
    periods = {after - before for before, after in itertools.pairwise(ticks)}
    assert len(ticks) >= 9 and periods <= {19, 20, 21}


@pytest.mark.promise("when the board has accepted no frame with its seed for `session_time_out`, or at `close`")
def test_silence_and_a_close_of_its_session_end_it(rig: Rig) -> None:
    rig.send(messages.Close(rig.seed ^ 1))
    rig.listen(0.05)
    assert rig.request(messages.GetParameter, 1).status == messages.AnswerStatus.OK, "another session's close"
    time_out = messages.PARAMETERS["session_time_out"].id
    assert rig.request(messages.SetParameter, time_out, 300).status == messages.AnswerStatus.OK
    silent_from = rig.transport.now()
    rig.alive = rig.acknowledges = False
    rig.wait_for(lambda: rig.hello is not None and rig.hello.session == 0, 0.8, "the end of the session")
    assert 0.28 <= rig.transport.now() - silent_from <= 0.45
    rig.start(arm=False)
    assert closed(rig).session == 0


@pytest.mark.promise("it may, while `session` is 0, ask with `describe` for each message")
def test_a_description_is_for_who_knows_the_nonce(rig: Rig) -> None:
    nonce = rig.next_hello().board_nonce
    rig.answers.clear()
    rig.send(messages.Describe(0, nonce ^ 1))
    rig.listen(0.1)
    assert not any(isinstance(answer, messages.Description) for answer in rig.answers)
    assert rig.ask(messages.Describe(0, nonce), messages.Description).index == 0
    assert rig.ask(messages.Describe(len(messages.MESSAGES), nonce), messages.Description).id == 0, "one too many"


@pytest.mark.promise("`sequence` starts anywhere and goes on over sessions")
def test_sequence_numbers_go_on_over_sessions(rig: Rig) -> None:
    begun = len(rig.uno.serial.heard)
    rig.listen(0.1)
    closed(rig)
    rig.start(arm=False)
    rig.listen(0.1)
    contents = [unstuff(piece) for piece in bytes(rig.uno.serial.heard[begun:]).split(b"\0")[1:-1] if piece]
    numbers = [content[1] for content in contents]
    assert len(numbers) > 20
    assert {(after - before) & 0xFF for before, after in itertools.pairwise(numbers)} == {1}
