"""The frame, written as plainly as PROTOCOL.md says it: bit by bit, slow, and independent of the kit's two codecs.

Only the golden vectors are made with it, so that the C and the Python codec are checked against a third opinion.
"""

from __future__ import annotations

POLYNOMIAL = 0x1DBF6F  # CRC-21, 0x1edfb7 in Koopman's notation: Hamming distance 6 up to 1004 bits
WIDTH = 21
SEED = 0x155555


def crc21(data: bytes, seed: int = SEED) -> int:
    """CRC of `data`, most significant bit first, no reflection, no final XOR."""
    register = seed
    for byte in data:
        for bit in range(7, -1, -1):
            top = (register >> (WIDTH - 1)) & 1
            register = (register << 1) & ((1 << WIDTH) - 1)
            if top != (byte >> bit) & 1:
                register ^= POLYNOMIAL
    return register


def cobs(data: bytes) -> bytes:
    """Consistent overhead byte stuffing (Cheshire and Baker, 1999) of fewer than 254 bytes."""
    encoded = bytearray()
    for block in data.split(b"\0"):
        encoded.append(len(block) + 1)
        encoded += block
    return bytes(encoded)


def frame(message_id: int, sequence: int, payload: bytes, seed: int = SEED) -> bytes:
    """A whole frame with both delimiters."""
    stuffed = cobs(bytes([message_id, sequence]) + payload)
    check = crc21(stuffed, seed)
    tail = bytes(0x80 | (check >> shift) & 0x7F for shift in (14, 7, 0))
    return b"\0" + stuffed + tail + b"\0"
