"""What frames cost others: MAVLink 2 of pymavlink, and COBS with a CRC-16 of cobs and fastcrc.

Only `make bench` installs them.
"""

from __future__ import annotations

from cobs import cobs
from fastcrc import crc16
from pymavlink.dialects.v20 import common as mavlink

from boebot.link import messages
from tools.bench.codec import COUNT, per_second, sequences

# ---- MAVLink 2: SERVO_OUTPUT_RAW has 37 bytes, as our telemetry -----------------------------------------------------


def servo_outputs() -> mavlink.MAVLink_servo_output_raw_message:
    return mavlink.MAVLink_servo_output_raw_message(0x01020304, 1, *range(1001, 1017))


def mavlink_encoding() -> float:
    """pymavlink: fields to frame."""
    link, message = mavlink.MAVLink(None), servo_outputs()

    def work() -> int:
        for sequence in sequences():
            link.seq = sequence
            message.pack(link)
        return COUNT

    assert len(message.pack(link)) == 37 + 12
    return per_second(work)


def mavlink_decoding() -> float:
    """pymavlink: frames to fields, 16 at a time."""
    link, message = mavlink.MAVLink(None), servo_outputs()
    frames = []
    for sequence in range(256):
        link.seq = sequence
        frames.append(bytes(message.pack(link)))
    chunks = [b"".join(frames[start : start + 16]) for start in range(0, 256, 16)]

    def work() -> int:
        receiver = mavlink.MAVLink(None)
        done = 0
        while done < COUNT:
            for data in chunks:
                done += len(receiver.parse_buffer(data))
        return done

    return per_second(work)


# ---- COBS with a CRC-16 inside, both in C -------------------------------------------------------------------------


def cobs_frame(number: int, sequence: int, payload: bytes) -> bytes:
    body = bytes((number, sequence)) + payload
    return bytes(cobs.encode(body + crc16.ibm_3740(body).to_bytes(2, "big"))) + b"\0"


def cobs_messages(stream: bytes) -> list[tuple[int, int, bytes]]:
    found = []
    for block in stream.split(b"\0"):
        if block:
            body = cobs.decode(block)
            if crc16.ibm_3740(body[:-2]) == int.from_bytes(body[-2:], "big"):
                found.append((body[0], body[1], body[2:-2]))
    return found


def cobs_encoding(message: messages.Message) -> float:
    """cobs and fastcrc: payloads to frames."""
    payload = message.pack()

    def work() -> int:
        for sequence in sequences():
            cobs_frame(message.ID, sequence, payload)
        return COUNT

    return per_second(work)


def cobs_decoding(message: messages.Message, *, chunk: int) -> float:
    """cobs and fastcrc: frames to payloads, `chunk` frames at a time."""
    frames = [cobs_frame(message.ID, sequence, message.pack()) for sequence in range(256)]
    chunks = [b"".join(frames[start : start + chunk]) for start in range(0, 256, chunk)]

    def work() -> int:
        done = 0
        while done < COUNT:
            for data in chunks:
                done += len(cobs_messages(data))
        return done

    return per_second(work)
