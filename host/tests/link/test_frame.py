"""Frames: the golden vectors, and the codec against the page's plain words (reference_frame.py, the cobs library)."""

from __future__ import annotations

import json
import random
import struct
import sys
from pathlib import Path

import pytest
from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from boebot.link import frame, messages
from boebot.link.frame import reader, text

PROTOCOL = Path(__file__).resolve().parents[3] / "protocol"
sys.path.insert(0, str(PROTOCOL))

import reference_frame  # noqa: E402

GOLDEN = json.loads((PROTOCOL / "vectors" / "frames.json").read_text())
TELEMETRY, HELLO = messages.Telemetry.ID, messages.Hello.ID
LENGTH = messages.Telemetry.LENGTH
LENGTHS = {number: message.LENGTH for number, message in messages.MESSAGES.items()}
TO_HOST = [number for number in LENGTHS if number >= 0x80]
TO_BOARD = [number for number in LENGTHS if number < 0x80]
HANDSHAKE = [number for number, message in messages.MESSAGES.items() if message.DELIVERY == "handshake"]
SEED = 0x12345

payloads = st.binary(min_size=LENGTH, max_size=LENGTH)
sequences = st.integers(0, 255)
seeds = st.integers(0, 0x1FFFFF)
Message = tuple[int, int, bytes]


def seed_of(number: int, session: int) -> int:
    return reference_frame.SEED if number in HANDSHAKE else session


# ---- one frame ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: f"{golden['message']}-{golden['sequence']}")
def test_golden_frame_both_ways(golden: dict[str, object]) -> None:
    payload, wire = bytes.fromhex(str(golden["payload"])), bytes.fromhex(str(golden["frame"]))
    number, sequence, seed = (int(str(golden[key])) for key in ("id", "sequence", "seed"))
    assert frame.encode(number, sequence, payload, seed) == wire
    assert frame.Decoder(seed, to_board=number < 0x80).feed(wire) == [(number, sequence, payload)]
    message = messages.MESSAGES[number].unpack(payload)
    fields = {k: v.decode().rstrip("\0") if isinstance(v, bytes) else v for k, v in message._asdict().items()}
    assert fields == golden["fields"]
    assert message.pack() == payload


@given(st.sampled_from(sorted(LENGTHS)), sequences, st.data(), seeds)
def test_every_message_is_framed_as_the_page_says(number: int, sequence: int, data: st.DataObject, seed: int) -> None:
    # Zeros are what COBS is about: half of all bytes.
    byte = st.one_of(st.just(0), st.integers(0, 255))
    payload = bytes(data.draw(st.lists(byte, min_size=LENGTHS[number], max_size=LENGTHS[number])))
    wire = frame.encode(number, sequence, payload, seed)
    assert wire == reference_frame.frame(number, sequence, payload, seed_of(number, seed))
    assert len(wire) == len(payload) + frame.FRAME_OVERHEAD
    assert cobs.decode(wire[1:-4]) == bytes([number, sequence]) + payload
    assert frame.Decoder(seed, to_board=number < 0x80).feed(wire) == [(number, sequence, payload)]


@given(st.binary(max_size=600), seeds)
def test_checksum_is_the_pages(data: bytes, seed: int) -> None:
    check = reference_frame.crc21(data, seed)
    spread = bytes(0x80 | check >> shift & 0x7F for shift in (14, 7, 0))
    assert frame.checksum(data, seed).to_bytes(3, "big") == spread


def test_too_long_and_out_of_range_are_errors_not_frames() -> None:
    with pytest.raises(ValueError, match="61 bytes; expected at most 60"):
        frame.encode(TELEMETRY, 0, bytes(61))
    with pytest.raises(OverflowError):
        frame.encode(TELEMETRY, 256, bytes(LENGTH))


@given(payloads, sequences, st.sets(st.integers(0, 8 * (LENGTH + 6) - 1), min_size=1, max_size=5))
def test_up_to_five_wrong_bits_are_refused(payload: bytes, sequence: int, bits: set[int]) -> None:
    """The checksum's Hamming distance is 6 at this length; a bit error that makes a zero only cuts the frame."""
    wire = bytearray(frame.encode(TELEMETRY, sequence, payload, SEED))
    for bit in bits:
        wire[1 + bit // 8] ^= 1 << bit % 8
    receiver = frame.Decoder(SEED)
    assert receiver.feed(bytes(wire)) == []
    assert receiver.good == 0


def test_every_single_wrong_bit_is_refused_and_counted() -> None:
    wire = frame.encode(TELEMETRY, 7, bytes(range(LENGTH)))
    for bit in range(8, 8 * (len(wire) - 1)):
        damaged = bytearray(wire)
        damaged[bit // 8] ^= 1 << bit % 8
        receiver = frame.Decoder()
        assert receiver.feed(bytes(damaged)) == []
        assert receiver.bad >= 1


def test_stuffing_must_end_exactly_at_the_end() -> None:
    """A code byte that points beyond the end, under a right checksum."""
    stuffed = bytearray(frame.encode(TELEMETRY, 1, bytes(range(1, LENGTH + 1)))[1:-4])
    for wrong in (stuffed[0] + 1, stuffed[0] - 1, 255):
        stuffed[0] = wrong
        wire = b"\0" + bytes(stuffed) + frame.checksum(bytes(stuffed)).to_bytes(3, "big") + b"\0"
        receiver = frame.Decoder()
        assert receiver.feed(wire) == []
        assert receiver.bad == 1


@pytest.mark.parametrize("length", [LENGTH - 1, LENGTH + 1, 0])
def test_length_must_be_that_of_the_message(length: int) -> None:
    assert frame.Decoder().feed(frame.encode(TELEMETRY, 0, bytes(length))) == []


@pytest.mark.parametrize("to_board", [False, True])
def test_only_messages_of_ones_own_direction_are_accepted(to_board: bool) -> None:
    for number in range(1, 256):
        receiver = frame.Decoder(SEED, to_board=to_board)
        wire = frame.encode(number, 0, bytes(LENGTHS.get(number, 1)), SEED)
        accepted = number in (TO_BOARD if to_board else TO_HOST)
        echo = (number < 0x80) != to_board
        assert len(receiver.feed(wire)) == accepted, "an unknown message, or the echo of what was sent"
        assert (receiver.good, receiver.bad, receiver.unknown) == (accepted, echo, not accepted and not echo)


def test_messages_of_a_later_minor_version_are_counted_and_nothing_else() -> None:
    """Of whatever length, up to the longest that is known; where one is damaged it is damaged."""
    receiver = frame.Decoder(SEED)
    sent = [
        (TELEMETRY, bytes(LENGTH)),
        (0xFE, b""),
        (0x95, bytes(range(frame.LONGEST_PAYLOAD))),
        (TELEMETRY, bytes(LENGTH)),
    ]
    wires = [frame.encode(number, n, payload, SEED) for n, (number, payload) in enumerate(sent)]
    assert [number for number, _, _ in receiver.feed(b"".join(wires))] == [TELEMETRY, TELEMETRY]
    assert (receiver.good, receiver.unknown, receiver.bad, receiver.lost, receiver.resynchronised) == (2, 2, 0, 0, 0)
    receiver.feed(wires[1].replace(b"\xfe", b"\xfc"))
    assert (receiver.unknown, receiver.bad) == (2, 1)


# ---- one wrong bit that makes or unmakes a delimiter ----------------------------------------------------------------


def seed_that_fits(first: bytes, second: bytes) -> int | None:
    """The seed from which both have the same checksum: a checksum is linear in its seed."""

    def differs(seed: int) -> int:
        return reference_frame.crc21(first, seed) ^ reference_frame.crc21(second, seed)

    rest, seed = differs(0), 0
    basis: list[tuple[int, int]] = []
    for bit in range(21):
        row, of = differs(1 << bit) ^ differs(0), 1 << bit
        for known, known_of in basis:
            row, of = min((row, of), (row ^ known, of ^ known_of))
        if row:
            basis.append((row, of))
    for known, of in sorted(basis, reverse=True):
        rest, seed = min((rest, seed), (rest ^ known, seed ^ of))
    return seed if rest == 0 else None


def spoilt(wire: bytes) -> list[bytes]:
    """The frame with each bit wrong that makes or unmakes a delimiter."""
    bits = [(at, bit) for at, byte in enumerate(wire) for bit in range(8) if byte in (0, 1 << bit)]
    return [wire[:at] + bytes([wire[at] ^ 1 << bit]) + wire[at + 1 :] for at, bit in bits]


def test_rest_of_a_frame_that_one_wrong_bit_has_cut_is_refused() -> None:
    """Telemetry in which a zero byte is followed by another: bit 0 of the code byte 01 between them is cleared. What
    follows is a clock_answer, and with this seed its checksum is right."""
    tail = bytes([0, 0, messages.ClockAnswer.ID, *range(1, messages.ClockAnswer.LENGTH + 2)])
    payload = bytes(range(1, LENGTH - len(tail) + 1)) + tail
    stuffed = reference_frame.cobs(bytes([TELEMETRY, 7]) + payload)
    at = len(stuffed) - messages.ClockAnswer.LENGTH - 4
    seed = seed_that_fits(stuffed, stuffed[at + 1 :])
    assert seed is not None and stuffed[at] == 1
    wire = bytearray(frame.encode(TELEMETRY, 7, payload, seed))
    wire[1 + at] ^= 1
    rest = bytes(wire[1 + at :])
    assert [number for number, _, _ in frame.Decoder(seed).feed(b"\0" + rest)] == [messages.ClockAnswer.ID]
    neighbour = frame.encode(TELEMETRY, 8, payload, seed)
    assert frame.Decoder(seed).feed(neighbour + bytes(wire) + neighbour) == [(TELEMETRY, 8, payload)] * 2


@st.composite
def messages_to(draw: st.DrawFn, to_board: bool) -> tuple[int, bytes]:
    number = draw(st.sampled_from(TO_BOARD if to_board else TO_HOST))
    byte = st.one_of(st.just(0), st.sampled_from(sorted(LENGTHS)), st.integers(0, 255))
    payload = bytearray(draw(st.lists(byte, min_size=LENGTHS[number], max_size=LENGTHS[number])))
    if number == messages.Open.ID:
        payload[0] = messages.PROTOCOL_VERSION
    return number, bytes(payload)


@given(st.data(), st.booleans(), sequences)
def test_no_wrong_bit_shows_a_piece_that_only_the_checksum_would_refuse(
    data: st.DataObject, to_board: bool, sequence: int
) -> None:
    """Whatever its checksum: of all bits that make or unmake a delimiter. All but the two that PROTOCOL.md names."""
    number, payload = data.draw(messages_to(to_board))
    wire = frame.encode(number, sequence, payload, SEED)
    sizes = {number: LENGTHS[number] + 6 for number in (TO_BOARD if to_board else TO_HOST)}
    for stream in spoilt(wire):
        for piece, may_be in reference_frame.pieces(b"\0" + stream + b"\0", sizes):
            try:
                shown = cobs.decode(piece[:-3])[0] if may_be and all(byte & 0x80 for byte in piece[-3:]) else 0
            except (cobs.DecodeError, IndexError):
                continue
            if sizes.get(shown) == len(piece):
                pair = {messages.MESSAGES[number].NAME, messages.MESSAGES[shown].NAME}
                assert "describe" in pair and pair & {"close", "setpoint_coast", "buzzer"}


# ---- sessions -------------------------------------------------------------------------------------------------------


@given(seeds, seeds)
def test_seed_separates_sessions_but_not_the_handshake(mine: int, other: int) -> None:
    for number in TO_HOST:
        wire = frame.encode(number, 0, bytes(LENGTHS[number]), mine)
        heard = frame.Decoder(other).feed(wire)
        assert bool(heard) is (number in HANDSHAKE or mine == other)


def test_without_a_session_only_the_handshake_is_heard() -> None:
    """Nothing of class telemetry either, whatever its seed."""
    receiver = frame.Decoder(frame.NO_SESSION)
    for seed in (0, frame.SEED, SEED, 0x1FFFFF):
        assert receiver.feed(frame.encode(TELEMETRY, 0, bytes(LENGTH), seed)) == []
        assert len(receiver.feed(frame.encode(HELLO, 0, bytes(LENGTHS[HELLO]), seed))) == 1


def test_seed_may_change_in_mid_stream_and_starts_a_new_count() -> None:
    receiver = frame.Decoder(SEED)
    receiver.feed(frame.encode(TELEMETRY, 5, bytes(LENGTH), SEED))
    receiver.seed = 0x54321
    assert receiver.seed == 0x54321
    assert receiver.feed(frame.encode(TELEMETRY, 6, bytes(LENGTH), SEED)) == []
    assert len(receiver.feed(frame.encode(TELEMETRY, 200, bytes(LENGTH), 0x54321))) == 1
    assert (receiver.good, receiver.bad, receiver.resynchronised, receiver.lost) == (2, 1, 1, 0)


# ---- streams --------------------------------------------------------------------------------------------------------


class PlainDecoder:
    """PROTOCOL.md, "Frame", once more, as plainly as can be: the whole stream at once."""

    def __init__(self, seed: int, numbers: list[int]) -> None:
        self.seed, self.numbers = seed, numbers
        self.good = self.bad = self.resynchronised = self.lost = 0

    def decode(self, stream: bytes) -> list[Message]:
        found: list[Message] = []
        damaged = False
        sizes = {number: LENGTHS[number] + 6 for number in self.numbers}
        for place, (block, may_be) in enumerate(reference_frame.pieces(stream, sizes)):
            message = self.open(block) if may_be else None
            if message is not None:
                if found and message[1] != found[-1][1]:  # else it is a copy
                    self.lost += (message[1] - found[-1][1] - 1) % 256
                found.append(message)
                self.good += 1
                self.resynchronised += damaged
                damaged = False
            elif place > 0 or stream[0] == 0:  # what precedes the first delimiter may be the tail of a frame
                self.bad += 1
                damaged = True
        return found

    def open(self, block: bytes) -> Message | None:
        stuffed, check = block[:-3], block[-3:]
        try:
            inside = cobs.decode(stuffed)
        except cobs.DecodeError:
            return None
        if len(inside) < 2 or inside[0] not in self.numbers or len(inside) - 2 != LENGTHS[inside[0]]:
            return None
        wanted = reference_frame.frame(inside[0], inside[1], inside[2:], seed_of(inside[0], self.seed))
        return (inside[0], inside[1], inside[2:]) if wanted[-4:-1] == check else None


@st.composite
def damaged_streams(draw: st.DrawFn, numbers: list[int]) -> bytes:
    """Frames of this and another session with bytes changed, lost, doubled and put between."""
    stream = bytearray()
    for _ in range(draw(st.integers(1, 8))):
        number = draw(st.sampled_from(numbers))
        seed = draw(st.sampled_from([SEED, SEED, SEED, SEED + 1]))
        stream += frame.encode(number, draw(sequences), draw(st.binary(min_size=LENGTHS[number], max_size=60)), seed)
        if draw(st.booleans()):
            del stream[-1]  # neighbours share a delimiter
    for _ in range(draw(st.integers(0, 6))):
        at = draw(st.integers(0, len(stream) - 1))
        match draw(st.integers(0, 3)):
            case 0:
                stream[at] ^= 1 << draw(st.integers(0, 7))
            case 1:
                del stream[at : at + draw(st.integers(1, 3))]
            case 2:
                stream[at:at] = stream[at : at + draw(st.integers(1, 80))]
            case 3:
                stream[at:at] = draw(st.binary(min_size=1, max_size=100))
        stream = stream or bytearray(1)
    return bytes(stream)


def cut(stream: bytes, data: st.DataObject) -> list[bytes]:
    ends = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    return [stream[start:end] for start, end in zip([0, *ends], [*ends, len(stream)], strict=True)]


@given(st.data(), st.booleans())
def test_any_stream_cut_anywhere_is_decoded_as_the_page_says(data: st.DataObject, to_board: bool) -> None:
    # The counts that a hello or an open begins anew have their own tests.
    numbers = [number for number in (TO_BOARD if to_board else TO_HOST) if number not in (HELLO, messages.Open.ID)]
    stream = data.draw(damaged_streams(numbers))
    plain, receiver = PlainDecoder(SEED, numbers), frame.Decoder(SEED, to_board=to_board)
    found = [message for piece in cut(stream, data) for message in receiver.feed(piece)]
    assert found == plain.decode(stream)
    assert (receiver.good, receiver.bad) == (plain.good, plain.bad)
    assert (receiver.resynchronised, receiver.lost) == (plain.resynchronised, plain.lost)


def test_large_buffers_are_decoded_whole() -> None:
    """Shortest frames with shared delimiters, more than one call into C takes: as many messages as can be."""
    count = 10_000
    one = [frame.encode(messages.Identify.ID, n & 0xFF, b"")[1:] for n in range(256)]
    stream = b"\0" + b"".join(one[n & 0xFF] for n in range(count))
    receiver = frame.Decoder(SEED, to_board=True)
    assert receiver.feed(stream) == [(messages.Identify.ID, n & 0xFF, b"") for n in range(count)]
    assert (receiver.good, receiver.bad, receiver.lost) == (count, 0, 0)


def test_counters_outlive_the_firmwares_sixteen_bits() -> None:
    receiver = frame.Decoder()
    good, bad = frame.encode(TELEMETRY, 0, bytes(LENGTH)), b"\0bad\0"
    for _ in range(700):
        receiver.feed((bad + good) * 100)
    assert (receiver.good, receiver.bad, receiver.resynchronised) == (70_000, 70_000, 70_000)
    receiver.good = receiver.bad = 0
    receiver.feed(good)
    assert (receiver.good, receiver.bad) == (1, 0)


@given(payloads, payloads)
def test_damage_costs_one_frame_and_no_neighbour(first: bytes, last: bytes) -> None:
    stream = bytearray(b"".join(frame.encode(TELEMETRY, n, row) for n, row in enumerate((first, first, last))))
    size = LENGTH + frame.FRAME_OVERHEAD
    stream[size + 10 : size + 14] = b"\xff"  # bytes lost inside the second frame
    receiver = frame.Decoder()
    assert [payload for _, _, payload in receiver.feed(bytes(stream))] == [first, last]
    assert (receiver.good, receiver.bad, receiver.resynchronised, receiver.lost) == (2, 1, 1, 1)


def test_noise_without_a_delimiter_is_one_bad_frame() -> None:
    receiver = frame.Decoder()
    receiver.feed(b"\0")
    for _ in range(100):
        receiver.feed(b"\xff" * 1000)
    wire = frame.encode(TELEMETRY, 0, bytes(LENGTH))
    assert receiver.feed(wire) == [(TELEMETRY, 0, bytes(LENGTH))]
    assert receiver.bad == 1


def test_tail_of_a_frame_that_was_joined_late_is_not_damage() -> None:
    wire = frame.encode(TELEMETRY, 1, bytes(range(LENGTH)))
    receiver = frame.Decoder()
    receiver.feed(wire[9:])
    assert receiver.bad == 0
    receiver.feed(wire[9:])
    assert receiver.bad == 1


# ---- sequence numbers -----------------------------------------------------------------------------------------------


@given(sequences, st.integers(0, 200))
def test_lost_frames_are_counted_by_their_gap(start: int, gap: int) -> None:
    receiver = frame.Decoder()
    receiver.feed(frame.encode(TELEMETRY, start, bytes(LENGTH)))
    receiver.feed(frame.encode(TELEMETRY, (start + 1 + gap) & 0xFF, bytes(LENGTH)))
    assert receiver.lost == gap


def hello(nonce: int, session: int) -> bytes:
    head = struct.pack("<BIII", messages.PROTOCOL_VERSION, messages.SCHEMA_HASH, nonce, session)
    return head + bytes(LENGTHS[HELLO] - len(head))


def test_hello_of_another_start_begins_a_new_count() -> None:
    """After a reset the board's numbers start anywhere: nothing was lost."""
    receiver = frame.Decoder()
    receiver.feed(frame.encode(HELLO, 99, hello(1, 0)))
    receiver.feed(frame.encode(TELEMETRY, 100, bytes(LENGTH)))
    receiver.feed(frame.encode(HELLO, 0, hello(2, 0)))
    receiver.feed(frame.encode(TELEMETRY, 1, bytes(LENGTH)))
    assert receiver.lost == 0


def test_hello_of_the_same_session_counts_like_any_other_frame() -> None:
    receiver = frame.Decoder()
    receiver.feed(frame.encode(HELLO, 10, hello(1, 7)))
    receiver.feed(frame.encode(HELLO, 14, hello(1, 7)))
    assert receiver.lost == 3


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
