"""PROTOCOL.md, Frame: what a board sends, what it takes for a frame, and what it drops whole and counts."""

from __future__ import annotations

import itertools

import pytest

from boebot.link import frame, messages
from boebot_hil.rig import HOST_NONCE, Rig

pytestmark = pytest.mark.uno(robot="shieldbot", motors=False)

PROBE = bytes([messages.ClockProbe.ID, 0x55, 0x11, 0x22])  # id, sequence, token


def counters(rig: Rig) -> messages.Counters:
    """The board's next ones."""
    rig.answers.clear()
    return rig.next(messages.Counters, 1.0)


def on_the_wire(rig: Rig, stuffed: bytes, seed: int | None = None) -> bytes:
    """A frame of bytes that are stuffed already, right or wrong."""
    check = frame.checksum(stuffed, rig.seed if seed is None else seed)
    return b"\0" + stuffed + check.to_bytes(3, "big") + b"\0"


def stuffed(content: bytes) -> bytes:
    """COBS of bytes without a zero."""
    return bytes([len(content) + 1]) + content


def is_answered(rig: Rig, wire: bytes) -> bool:
    """The board answers the probe in those bytes."""
    rig.answers.clear()
    rig.transport.write(wire)
    rig.listen(0.03)
    token = int.from_bytes(PROBE[2:], "little")
    return any(isinstance(answer, messages.ClockAnswer) and answer.token == token for answer in rig.answers)


@pytest.mark.promise("a delimiter before and after each frame, so that two stand between neighbours")
def test_two_delimiters_stand_between_neighbours(rig: Rig) -> None:
    rig.listen(0.1)
    begun = len(rig.uno.serial.heard)
    rig.listen(0.3)
    pieces = bytes(rig.uno.serial.heard[begun:]).split(b"\0")[1:-1]
    frames = [place for place, piece in enumerate(pieces) if piece]
    assert len(frames) > 25
    assert {after - before for before, after in itertools.pairwise(frames)} == {2}
    assert rig.decoder.bad == rig.decoder.lost == 0


@pytest.mark.promise("takes an empty piece (two delimiters in a row) as nothing")
def test_empty_pieces_are_nothing(rig: Rig) -> None:
    before = counters(rig).bad
    assert is_answered(rig, bytes(100) + on_the_wire(rig, stuffed(PROBE)) + bytes(100))
    assert counters(rig).bad == before


@pytest.mark.promise("drops what is longer than the longest message to its side up to the next delimiter")
@pytest.mark.parametrize("length", [24, 60, 253, 254, 255, 256, 300, 511, 512, 700])
def test_what_is_too_long_is_dropped_up_to_the_next_delimiter(rig: Rig, length: int) -> None:
    before = counters(rig).bad
    assert is_answered(rig, b"\0" + b"\x7f" * length + b"\0" + on_the_wire(rig, stuffed(PROBE)))
    assert counters(rig).bad == before + 1


WRONG = {
    "a check byte without its top bit": lambda rig: _cleared(on_the_wire(rig, stuffed(PROBE))),
    "the checksum": lambda rig: _flipped(on_the_wire(rig, stuffed(PROBE))),
    "a session's that is not": lambda rig: on_the_wire(rig, stuffed(PROBE), rig.seed ^ 1),
    "the handshake's seed": lambda rig: on_the_wire(rig, stuffed(PROBE), frame.SEED),
    "a code byte that points outside": lambda rig: on_the_wire(rig, b"\x06" + PROBE),
    "a last block that does not end at the end": lambda rig: on_the_wire(rig, b"\x04" + PROBE),
    "a message of the other side": lambda rig: on_the_wire(rig, stuffed(b"\xb0\x55" + b"\x11" * 6)),
    "a length that is not the message's": lambda rig: on_the_wire(rig, stuffed(PROBE + b"\x33")),
}


def _cleared(wire: bytes) -> bytes:
    """One of the check bytes that is more than its top bit loses that."""
    place = next(place for place in (-4, -3, -2) if wire[place] & 0x7F)
    return wire[:place] + bytes([wire[place] & 0x7F]) + wire[len(wire) + place + 1 :]


def _flipped(wire: bytes) -> bytes:
    return wire[:-2] + bytes([wire[-2] ^ 1]) + wire[-1:]


@pytest.mark.promise(
    "otherwise it is dropped whole and counted",
    "its three check bytes have their top bits set, and the CRC matches",
    "the stuffed bytes decode: every code byte points inside, and the last block ends exactly at the end",
    "`id` is a message to this side, and the payload has exactly the length of that message",
    "a frame of another session never has a matching checksum",
)
@pytest.mark.parametrize("what", WRONG)
def test_frame_that_is_not_valid_is_dropped_and_counted(rig: Rig, what: str) -> None:
    before = counters(rig).bad
    assert not is_answered(rig, WRONG[what](rig))
    assert is_answered(rig, on_the_wire(rig, stuffed(PROBE)))
    assert counters(rig).bad == before + 1


@pytest.mark.promise("one wrong bit in a frame of a message that the receiver knows never passes")
def test_no_frame_with_one_wrong_bit_moves_the_robot(rig: Rig) -> None:
    """Each bit of a set-point's frame, delimiters included."""
    rig.drive(0.0, 0.0, 2000)
    rig.latest()
    before, count = counters(rig).bad, 8 * len(rig.encode(rig.signal(0.9, 0.9)))
    for bit in range(count):
        damaged = bytearray(rig.encode(rig.signal(0.9, 0.9, 2000)))
        damaged[bit // 8] ^= 1 << bit % 8
        rig.transport.write(bytes(damaged))
        rig.listen(0.01)
    assert all(now.pulse_left in (0, 24_000) for now in rig.telemetry), "a damaged set-point moved the robot"
    assert counters(rig).bad >= before + count - 16, "all but those whose delimiter was hit, perhaps"
    sequence = rig.drive(0.0, 0.0)
    assert rig.latest().setpoint_sequence == sequence, "the board no longer listens"


@pytest.mark.promise(
    "it is not the rest of a frame, as below",
    "that has no empty piece before it, if the piece before it has one and began a frame",
)
def test_the_rest_of_a_frame_that_was_cut_is_refused(rig: Rig) -> None:
    """A wrong bit makes a delimiter of a byte; what follows it has a right checksum, which happens once in 2^21."""
    rest = on_the_wire(rig, stuffed(PROBE))[1:]  # without its delimiter
    whole = messages.SetpointSignal.LENGTH + frame.FRAME_OVERHEAD - 2  # between the delimiters of a set-point's frame
    begun = bytes([0x02, messages.SetpointSignal.ID]) + b"\x11" * (whole - len(rest) - 2)
    assert len(begun) + 1 + len(rest) - 1 == whole
    before = counters(rig).bad
    assert not is_answered(rig, b"\0\0" + begun + b"\0" + rest)
    assert counters(rig).bad == before + 2
    assert is_answered(rig, b"\0\0" + begun[:-1] + b"\0" + rest), "of another length it is a frame by itself"


@pytest.mark.emulated
@pytest.mark.promise("that came before the first delimiter that it has seen: it has joined in the midst of a frame")
def test_what_comes_before_the_first_delimiter_is_refused(rig: Rig) -> None:
    rig.uno.reset("external")
    rig.alive, rig.seed, rig.decoder.seed = False, 0, frame.NO_SESSION
    opening = messages.Open(messages.PROTOCOL_VERSION, rig.next_hello().board_nonce, HOST_NONCE)
    for is_heard in (False, True):
        rig.transport.write(rig.encode(opening)[1:])
        rig.listen(0.25)
        assert rig.hello is not None and (rig.hello.session != 0) == is_heard


@pytest.mark.promise("A receiver counts the whole frames of messages that it does not know")
def test_messages_of_a_later_minor_version_are_counted_and_ignored(rig: Rig) -> None:
    before = counters(rig)
    rig.transport.write(on_the_wire(rig, stuffed(b"\x7e\x55" + b"\x11" * 6)))
    after = counters(rig)
    assert (after.unknown, after.bad) == (before.unknown + 1, before.bad)
