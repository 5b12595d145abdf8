"""How many frames Python makes and takes apart in a second, beside MAVLink 2 and COBS with a CRC-16."""

from __future__ import annotations

import time
from collections.abc import Callable, Sized
from functools import partial
from importlib import import_module

from boebot.link import messages
from boebot.link.frame import Decoder, encode
from tools.tests.bench.figures import Peer, figure

COUNT = 10_240
ROUNDS = 30  # the best counts: others may have needed the processor in between
SEQUENCES = [number % 256 for number in range(COUNT)]
SEED = 0x12345

TELEMETRY = messages.Telemetry.unpack(bytes(range(1, 1 + messages.Telemetry.LENGTH)))


def per_second(work: Callable[[], int]) -> float:
    """What `work` says it did, for each second that it took."""
    best = 0.0
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        done = work()
        best = max(best, done / (time.perf_counter() - begun))
    return best


def encoding(frame_of: Callable[[int], object]) -> float:
    """Frames made (1/s); `frame_of` makes the one of a sequence number."""

    def work() -> int:
        for sequence in SEQUENCES:
            frame_of(sequence)
        return COUNT

    return per_second(work)


def decoding(frame_of: Callable[[int], bytes], chunk: int, receiver: Callable[[], Callable[[bytes], Sized]]) -> float:
    """Frames taken apart (1/s), `chunk` of them at a time; `receiver` makes a function from bytes to their messages."""
    frames = [frame_of(sequence) for sequence in range(256)]
    chunks = [b"".join(frames[start : start + chunk]) for start in range(0, 256, chunk)]

    def work() -> int:
        receive, done = receiver(), 0
        while done < COUNT:
            for data in chunks:
                done += len(receive(data))
        return done

    assert work() == COUNT
    return per_second(work)


# ---- ours -----------------------------------------------------------------------------------------------------------


def payload_frame(message: messages.Message) -> Callable[[int], bytes]:
    """From its payload."""
    payload = message.pack()
    return lambda sequence: encode(message.ID, sequence, payload, SEED)


def fields_frame(sequence: int) -> bytes:
    """Of telemetry, from its fields."""
    return encode(TELEMETRY.ID, sequence, TELEMETRY.pack(), SEED)


def payloads() -> Callable[[bytes], Sized]:
    """From bytes to payloads."""
    return Decoder(SEED).feed


def fields() -> Callable[[bytes], Sized]:
    """From bytes to telemetry."""
    feed, unpack = Decoder(SEED).feed, messages.Telemetry.unpack
    return lambda data: [unpack(payload) for _, _, payload in feed(data)]


# ---- figures --------------------------------------------------------------------------------------------------------


def peer(name: str, measure: str, *arguments: object) -> list[Peer]:
    """A function of frame_peers.py, whose packages are only installed for `make bench`."""
    return [Peer(name, lambda: getattr(import_module("tools.tests.bench.frame_peers"), measure)(*arguments))]


COBS = "cobs + CRC-16 of fastcrc"
MAVLINK = "pymavlink, 37 B"
OF_TELEMETRY = payload_frame(TELEMETRY)
for _name, _least, _measure, _peers in (
    (
        "encodes telemetry of 37 B: payload to frame",
        0.5,
        partial(encoding, OF_TELEMETRY),
        peer(COBS, "cobs_encoding", TELEMETRY),
    ),
    (
        "decodes telemetry of 37 B: one frame at a time to its payload",
        0.5,
        partial(decoding, OF_TELEMETRY, 1, payloads),
        peer(COBS, "cobs_decoding", TELEMETRY, 1),
    ),
    (
        "encodes telemetry of 37 B: fields to frame",
        1.5,
        partial(encoding, fields_frame),
        peer(MAVLINK, "mavlink_encoding"),
    ),
    (
        "decodes telemetry of 37 B: 16 frames at a time to fields",
        2.5,
        partial(decoding, OF_TELEMETRY, 16, fields),
        peer(MAVLINK, "mavlink_decoding"),
    ),
):
    figure(f"Python {_name}", "frames/s", times_at_least=_least, peers=_peers)(_measure)
