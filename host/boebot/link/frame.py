"""Frames: messages in, bytes for the wire out, and back (protocol/PROTOCOL.md, "Frame").

    wire = 00 · COBS(id, sequence, payload) · c2 c1 c0 · 00

The work is done by the firmware's own C (codec.h), so that both ends of the link agree by construction; the tests
compare it with protocol/reference_frame.py. Damaged frames are counted and dropped; the next delimiter starts afresh.
No single wrong bit passes.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from typing import Any

from boebot import missing
from boebot.link import messages

ffi, lib = missing.compiled("boebot.link._codec")
SEED = 0x155555  # of the handshake's messages
NO_SESSION = 0xFFFFFFFF  # seed of a decoder that accepts the handshake's messages only
FRAME_OVERHEAD = 8  # bytes that a frame adds to its payload, both delimiters counted
LONGEST_PAYLOAD = max(message.LENGTH for message in messages.MESSAGES.values())

_encode, _unpack = lib.codec_encode, ffi.unpack
_SLICE = lib.CODEC_SLICE  # bytes for one call into C

_Message = tuple[int, int, bytes]


def encode(message_id: int, sequence: int, payload: bytes, seed: int = SEED) -> bytes:
    """The frame of one message, with both delimiters.

    Args:
        message_id: 1..255.
        sequence: 0..255, one more than that of the frame before.
        payload: at most LONGEST_PAYLOAD bytes.
        seed: the session's checksum seed; handshake messages keep the constant one.

    Raises:
        ValueError: the payload is too long.
        OverflowError: a number does not fit.
    """
    length = len(payload)
    if length > LONGEST_PAYLOAD:
        raise ValueError(f"a payload of {length} bytes; expected at most {LONGEST_PAYLOAD}")
    wire: bytes = _unpack(_encode(message_id, sequence, payload, length, seed), length + FRAME_OVERHEAD)
    return wire


def checksum(stuffed: bytes, seed: int = SEED) -> int:
    """CRC-21 of stuffed bytes, spread over the low 24 bits as on the wire."""
    check = bytearray(3)
    lib.codec_check(ffi.from_buffer(check), stuffed, len(stuffed), seed)
    return int.from_bytes(check, "big")


class _Count:
    """A counter of the C decoder as an attribute that may be set, too: to start it anew."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, decoder: Decoder, owner: type) -> int:
        value: int = getattr(decoder.counts, self._name)
        return value

    def __set__(self, decoder: Decoder, value: int) -> None:
        setattr(decoder.counts, self._name, value)


class Decoder:
    """Finds the frames in a stream of bytes, however it is cut into pieces. One thread at a time.

    Attributes:
        good: frames accepted.
        bad: frames refused: length, checksum, stuffing, seed, or a message of the other direction.
        unknown: whole frames of messages that a later minor version has added; they are ignored.
        resynchronised: times that a good frame followed bad ones.
        lost: frames that never came, by the gaps in the sequence numbers. A hello of another start or session begins a
            new count, and so does another seed.
    """

    good = _Count()
    bad = _Count()
    unknown = _Count()
    resynchronised = _Count()
    lost = _Count()

    def __init__(self, seed: int = SEED, *, to_board: bool = False) -> None:
        """Accepts the messages to the host, or those to the board, with the session's `seed` (NO_SESSION: only those
        of the handshake)."""
        new, self._feed, self._set_seed = (
            (lib.to_board_new, lib.to_board_feed, lib.to_board_seed)
            if to_board
            else (lib.to_host_new, lib.to_host_feed, lib.to_host_seed)
        )
        self._decoder = ffi.gc(new(seed), lib.codec_free)
        if not self._decoder:
            raise MemoryError("no memory for a decoder")
        self.counts = lib.codec_counts_of(self._decoder)
        self._seed = seed
        self._found = found = ffi.new("codec_found *")
        self._ids, self._sequences, self._ends, self._payloads = found.ids, found.sequences, found.ends, found.payloads

    @property
    def seed(self) -> int:
        """The session's checksum seed."""
        return self._seed

    @seed.setter
    def seed(self, seed: int) -> None:
        self._set_seed(self._decoder, seed)
        self._seed = seed

    def feed(self, data: bytes) -> list[_Message]:
        """Takes bytes as they come; returns the messages that they complete as (id, sequence, payload)."""
        if len(data) > _SLICE:
            slices = (data[start : start + _SLICE] for start in range(0, len(data), _SLICE))
            return [message for piece in slices for message in self.feed(piece)]
        count = self._feed(self._decoder, data, len(data), self._found)
        if count == 0:
            return []
        if count == 1:
            return [(self._ids[0], self._sequences[0], _unpack(self._payloads, self._ends[0]))]
        ends = _unpack(self._ends, count)
        payloads = _unpack(self._payloads, ends[-1])
        messages, start = [], 0
        for message_id, sequence, end in zip(_unpack(self._ids, count), _unpack(self._sequences, count), ends):  # noqa: B905
            messages.append((message_id, sequence, payloads[start:end]))
            start = end
        return messages


def reader(message: type[messages.Message], *names: str) -> Callable[[bytes], tuple[Any, ...]]:
    """A function that unpacks only these fields of a payload; it returns them in the message's order.

    Raises:
        ValueError: the message has no such field.
    """
    if missing := set(names) - set(message._fields):
        raise ValueError(f"message {message.NAME} has no field {', '.join(sorted(missing))}")
    codes = re.findall(r"\d*[a-zA-Z]", message.STRUCT.format)
    wanted = (
        code if name in names else f"{struct.calcsize('<' + code)}x"
        for name, code in zip(message._fields, codes, strict=True)
    )
    return struct.Struct("<" + "".join(wanted)).unpack


def text(field: bytes) -> str:
    """A text field without its padding."""
    return field.split(b"\0", 1)[0].decode("utf-8", errors="replace")
