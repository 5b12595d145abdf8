"""Frames: the golden vectors, properties of codec and decoder, and streams with damage in them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.link import frame, messages

GOLDEN = json.loads((Path(__file__).resolve().parents[2] / "protocol" / "vectors" / "frames.json").read_text())
TELEMETRY = messages.Telemetry.ID
LENGTH = messages.Telemetry.LENGTH

payloads = st.binary(min_size=LENGTH, max_size=LENGTH)
sequences = st.integers(0, 255)


def decoder() -> frame.Decoder:
    return frame.Decoder(messages.LENGTHS)


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: f"{golden['message']}-{golden['sequence']}")
def test_golden_frame_both_ways(golden: dict[str, object]) -> None:
    payload, wire = bytes.fromhex(str(golden["payload"])), bytes.fromhex(str(golden["frame"]))
    message_id, sequence = int(str(golden["id"])), int(str(golden["sequence"]))
    assert frame.encode(message_id, sequence, payload) == wire
    assert decoder().feed(wire) == [(message_id, sequence, payload)]
    message = messages.MESSAGES[message_id].unpack(payload)
    fields = {k: v.decode().rstrip("\0") if isinstance(v, bytes) else v for k, v in message._asdict().items()}
    assert fields == golden["fields"]
    assert message.pack() == payload


@given(payloads, sequences)
def test_what_is_encoded_is_decoded_and_costs_eight_bytes(payload: bytes, sequence: int) -> None:
    wire = frame.encode(TELEMETRY, sequence, payload)
    assert len(wire) == LENGTH + frame.FRAME_OVERHEAD
    assert wire.count(0) == 2, "zero is the delimiter and nothing else"
    assert decoder().feed(wire) == [(TELEMETRY, sequence, payload)]


@given(st.lists(payloads, min_size=1, max_size=8), st.data())
def test_stream_may_be_cut_anywhere_and_share_delimiters(rows: list[bytes], data: st.DataObject) -> None:
    frames = [frame.encode(TELEMETRY, index, row) for index, row in enumerate(rows)]
    shared = b"\0" + b"".join(wire[1:] for wire in frames)
    for stream in (b"".join(frames), shared):
        receiver, found, rest = decoder(), [], stream
        while rest:
            size = data.draw(st.integers(1, len(rest)))
            found += receiver.feed(rest[:size])
            rest = rest[size:]
        assert [payload for _, _, payload in found] == rows
        assert (receiver.good, receiver.bad, receiver.lost) == (len(rows), 0, 0)


@given(payloads, sequences, st.sets(st.integers(0, 8 * (LENGTH + 6) - 1), min_size=1, max_size=5))
def test_up_to_five_wrong_bits_are_refused(payload: bytes, sequence: int, bits: set[int]) -> None:
    """The checksum's Hamming distance is 6 at this length; a bit error that makes a zero only cuts the frame."""
    wire = bytearray(frame.encode(TELEMETRY, sequence, payload))
    for bit in bits:
        wire[1 + bit // 8] ^= 1 << bit % 8
    receiver = decoder()
    assert receiver.feed(bytes(wire)) == []
    assert receiver.good == 0


def test_every_single_wrong_bit_is_refused_and_counted() -> None:
    wire = frame.encode(TELEMETRY, 7, bytes(range(LENGTH)))
    for bit in range(8, 8 * (len(wire) - 1)):
        damaged = bytearray(wire)
        damaged[bit // 8] ^= 1 << bit % 8
        receiver = decoder()
        assert receiver.feed(bytes(damaged)) == []
        assert receiver.bad >= 1


@given(st.binary(max_size=400), payloads)
def test_frame_after_garbage_is_found(garbage: bytes, payload: bytes) -> None:
    wire = frame.encode(TELEMETRY, 3, payload)
    receiver = decoder()
    found = receiver.feed(garbage) + receiver.feed(wire)
    assert (TELEMETRY, 3, payload) in found
    assert receiver.good == 1


@given(payloads, payloads)
def test_damage_costs_one_frame_and_no_neighbour(first: bytes, last: bytes) -> None:
    stream = bytearray(b"".join(frame.encode(TELEMETRY, n, row) for n, row in enumerate((first, first, last))))
    size = LENGTH + frame.FRAME_OVERHEAD
    stream[size + 10 : size + 14] = b"\xff"  # bytes lost inside the second frame
    receiver = decoder()
    assert [payload for _, _, payload in receiver.feed(bytes(stream))] == [first, last]
    assert (receiver.good, receiver.bad, receiver.lost) == (2, 1, 1)


@given(st.integers(0, 255), st.integers(0, 200))
def test_lost_frames_are_counted_by_their_gap(start: int, gap: int) -> None:
    receiver = decoder()
    receiver.feed(frame.encode(TELEMETRY, start, bytes(LENGTH)))
    receiver.feed(frame.encode(TELEMETRY, (start + 1 + gap) & 0xFF, bytes(LENGTH)))
    assert receiver.lost == gap


def test_hello_starts_a_new_count() -> None:
    """After a reset the board counts from 0 again: nothing was lost."""
    receiver = decoder()
    receiver.feed(frame.encode(TELEMETRY, 100, bytes(LENGTH)))
    receiver.feed(frame.encode(messages.Hello.ID, 0, bytes(messages.Hello.LENGTH)))
    receiver.feed(frame.encode(TELEMETRY, 1, bytes(LENGTH)))
    assert receiver.lost == 0


def test_tail_of_a_frame_that_was_joined_late_is_not_damage() -> None:
    wire = frame.encode(TELEMETRY, 1, bytes(range(LENGTH)))
    receiver = decoder()
    receiver.feed(wire[9:])
    assert receiver.bad == 0
    receiver.feed(wire[9:])
    assert receiver.bad == 1


@pytest.mark.parametrize("length", [LENGTH - 1, LENGTH + 1, 0])
def test_length_must_be_that_of_the_message(length: int) -> None:
    assert decoder().feed(frame.encode(TELEMETRY, 0, bytes(length))) == []


def test_unknown_message_and_wrong_direction_are_refused() -> None:
    assert decoder().feed(frame.encode(0x7F, 0, b"")) == []
    to_host = frame.Decoder(frame.TO_HOST)
    assert to_host.feed(frame.encode(messages.Stop.ID, 0, b"")) == [], "the echo of what the host sent"


def test_stuffing_must_end_exactly_at_the_end() -> None:
    """Code bytes that point beyond the end, under a right checksum."""
    stuffed = bytearray(frame.encode(TELEMETRY, 0, bytes(range(1, LENGTH + 1)))[1:-4])
    assert 0 not in stuffed
    stuffed[0] += 1
    wire = b"\0" + bytes(stuffed) + frame.checksum(bytes(stuffed)).to_bytes(3, "big") + b"\0"
    receiver = decoder()
    assert receiver.feed(wire) == []
    assert receiver.bad == 1


def test_seed_separates_sessions_but_not_the_handshake() -> None:
    payload = bytes(LENGTH)
    mine, other = frame.Decoder(messages.LENGTHS, seed=0x12345), frame.Decoder(messages.LENGTHS, seed=0x54321)
    wire = frame.encode(TELEMETRY, 0, payload, seed=0x12345)
    assert mine.feed(wire) and not other.feed(wire)
    hello = frame.encode(messages.Hello.ID, 1, bytes(messages.Hello.LENGTH), seed=0x12345)
    assert mine.feed(hello) and other.feed(hello)


def test_endless_noise_needs_no_memory() -> None:
    receiver = decoder()
    for _ in range(1000):
        receiver.feed(b"\xff" * 1000)
    assert len(receiver._rest) < 100
    wire = frame.encode(TELEMETRY, 0, bytes(LENGTH))
    assert receiver.feed(wire) == [(TELEMETRY, 0, bytes(LENGTH))]
