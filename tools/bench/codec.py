"""How many frames Python makes and takes apart in a second, beside MAVLink 2 and COBS with a CRC-16."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import cycle, islice
from types import ModuleType

from boebot.link import messages
from boebot.link.frame import Decoder, encode
from tools.bench.figures import Peer, figure

COUNT = 10_240
ROUNDS = 30  # the best counts: others may have needed the processor in between
SEED = 0x12345

TELEMETRY = messages.Telemetry.unpack(bytes(range(1, 1 + messages.Telemetry.LENGTH)))
SETPOINT = messages.SetpointSignal(-1234, 5678, 250, 4321)


def per_second(work: Callable[[], int]) -> float:
    """What `work` says it did, for each second that it took."""
    best = 0.0
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        done = work()
        best = max(best, done / (time.perf_counter() - begun))
    return best


def sequences() -> Iterator[int]:
    return islice(cycle(range(256)), COUNT)


def encoding(message: messages.Message, *, fields: bool = False) -> float:
    """Payloads to frames (1/s); with `fields`, from fields to frames."""
    payload = message.pack()

    def payloads_work() -> int:
        for sequence in sequences():
            encode(message.ID, sequence, payload, SEED)
        return COUNT

    def fields_work() -> int:
        for sequence in sequences():
            encode(message.ID, sequence, message.pack(), SEED)
        return COUNT

    return per_second(fields_work if fields else payloads_work)


def decoding(message: messages.Message, *, chunk: int, fields: bool = False) -> float:
    """Frames to payloads (1/s), `chunk` frames at a time; with `fields`, to fields."""
    frames = [encode(message.ID, sequence, message.pack(), SEED) for sequence in range(256)]
    chunks = [b"".join(frames[start : start + chunk]) for start in range(0, 256, chunk)]
    unpack = type(message).unpack

    def work() -> int:
        decoder = Decoder(SEED, to_board=message.ID < 0x80)
        done = 0
        while done < COUNT:
            for data in chunks:
                found = decoder.feed(data)
                done += len(found)
                if fields:
                    for _, _, payload in found:
                        unpack(payload)
        assert decoder.good == done and decoder.bad == decoder.lost == 0
        return done

    return per_second(work)


def _peers() -> ModuleType:
    """Looked for when a peer is measured: its packages are only installed for `make bench`."""
    return import_module("tools.bench.frame_peers")


# ---- figures ----------------------------------------------------------------------------------------------------

COBS = "cobs + CRC-16 of fastcrc"
MAVLINK = "pymavlink, 37 B"


@figure(
    "Python encodes telemetry of 37 B: payload to frame",
    "frames/s",
    at_least=300_000,
    peers=[Peer(COBS, lambda: _peers().cobs_encoding(TELEMETRY))],
)
def encode_telemetry() -> float:
    return encoding(TELEMETRY)


@figure(
    "Python encodes set-points of 8 B: payload to frame",
    "frames/s",
    at_least=300_000,
    peers=[Peer(COBS, lambda: _peers().cobs_encoding(SETPOINT))],
)
def encode_setpoints() -> float:
    return encoding(SETPOINT)


@figure(
    "Python decodes telemetry of 37 B: 16 frames at a time to payloads",
    "frames/s",
    at_least=500_000,
    peers=[Peer(COBS, lambda: _peers().cobs_decoding(TELEMETRY, chunk=16))],
)
def decode_telemetry() -> float:
    return decoding(TELEMETRY, chunk=16)


@figure(
    "Python decodes telemetry of 37 B: one frame at a time to its payload",
    "frames/s",
    at_least=500_000,
    peers=[Peer(COBS, lambda: _peers().cobs_decoding(TELEMETRY, chunk=1))],
)
def decode_single_telemetry() -> float:
    return decoding(TELEMETRY, chunk=1)


@figure(
    "Python encodes telemetry of 37 B: fields to frame",
    "frames/s",
    at_least=200_000,
    peers=[Peer(MAVLINK, lambda: _peers().mavlink_encoding())],
)
def encode_fields() -> float:
    return encoding(TELEMETRY, fields=True)


@figure(
    "Python decodes telemetry of 37 B: 16 frames at a time to fields",
    "frames/s",
    at_least=200_000,
    peers=[Peer(MAVLINK, lambda: _peers().mavlink_decoding())],
)
def decode_fields() -> float:
    return decoding(TELEMETRY, chunk=16, fields=True)
