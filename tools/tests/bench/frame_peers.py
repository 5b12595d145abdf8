"""What frames cost others: MAVLink 2 of pymavlink, and COBS with a CRC-16 of cobs and fastcrc.

Only `make bench` installs them.
"""

from __future__ import annotations

from collections.abc import Callable

from cobs import cobs
from fastcrc import crc16
from pymavlink.dialects.v20 import common as mavlink

from boebot.link import messages
from tools.tests.bench.codec import decoding, encoding


def mavlink_frame() -> Callable[[int], bytes]:
    """From fields: SERVO_OUTPUT_RAW has 37 bytes, as our telemetry."""
    link = mavlink.MAVLink(None)
    message = mavlink.MAVLink_servo_output_raw_message(0x01020304, 1, *range(1001, 1017))

    def frame(sequence: int) -> bytes:
        link.seq = sequence
        return message.pack(link)  # type: ignore[no-any-return]

    assert len(frame(0)) == 37 + 12
    return frame


def mavlink_encoding() -> float:
    """Fields to frame."""
    return encoding(mavlink_frame())


def mavlink_decoding() -> float:
    """Frames to fields, 16 at a time."""
    return decoding(mavlink_frame(), 16, lambda: mavlink.MAVLink(None).parse_buffer)


def cobs_frame(message: messages.Message) -> Callable[[int], bytes]:
    """From a payload, with a CRC-16 inside; both are in C."""
    payload, number = message.pack(), message.ID

    def frame(sequence: int) -> bytes:
        body = bytes((number, sequence)) + payload
        return bytes(cobs.encode(body + crc16.ibm_3740(body).to_bytes(2, "big"))) + b"\0"

    return frame


def cobs_messages(stream: bytes) -> list[tuple[int, int, bytes]]:
    """Those whose checksum is right."""
    found = []
    for block in filter(None, stream.split(b"\0")):
        body = cobs.decode(block)
        if crc16.ibm_3740(body[:-2]) == int.from_bytes(body[-2:], "big"):
            found.append((body[0], body[1], body[2:-2]))
    return found


def cobs_encoding(message: messages.Message) -> float:
    """Payloads to frames."""
    return encoding(cobs_frame(message))


def cobs_decoding(message: messages.Message, chunk: int) -> float:
    """Frames to payloads, `chunk` frames at a time."""
    return decoding(cobs_frame(message), chunk, lambda: cobs_messages)
