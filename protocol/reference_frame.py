"""The frame, written as plainly as PROTOCOL.md says it: bit by bit, slow, and independent of the kit's two codecs.

Only the golden vectors are made with it, so that the C and the Python codec are checked against a third opinion.
"""

from __future__ import annotations

from collections.abc import Mapping

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


def pieces(stream: bytes, sizes: Mapping[int, int]) -> list[tuple[bytes, bool]]:
    """What stands between the delimiters of a stream from its start on, without the empty ones, and whether each may be
    a frame: it is not the rest of one that was joined late, or that a wrong bit has cut.

    Args:
        stream: whole pieces; what follows the last delimiter is left out.
        sizes: id -> bytes between the delimiters of its frame, for each message to the side that receives.
    """
    found: list[tuple[bytes, bool]] = []
    begins = False  # an empty piece came before
    missing: int | None = None  # bytes between this piece and the end of the frame that the piece before it began
    for number, piece in enumerate(stream.split(b"\0")[:-1]):
        if not piece:
            begins = True
            continue
        is_rest = not begins and (number == 0 or len(piece) == missing)
        found.append((piece, not is_rest))
        whole = sizes.get(piece[1]) if begins and len(piece) > 1 else None
        missing = None if whole is None else whole - len(piece) - 1
        begins = False
    return found
