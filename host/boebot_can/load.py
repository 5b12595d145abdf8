"""How long CAN frames keep a bus busy: all bits, stuffed ones counted (ISO 11898-1).

    start, 11 identifier, RTR, IDE, r0, 4 length, data, 15 CRC | delimiter, ACK, delimiter, 7 end, 3 pause

In the bits before the bar a bit of the other value is stuffed behind five of one value; the stuffed bit counts to the
next five.
"""

from __future__ import annotations

from collections import deque

from boebot_can.frames import CanFrame

DEFAULT_BITRATE = 500_000  # bit/s
_CRC15 = 0x4599
_AFTER_CRC = 13
_WINDOW_S = 1.0
_LEAST_S = 0.1


def frame_bits(frame: CanFrame) -> int:
    """Bits that a frame with an identifier of 11 bits occupies the bus for, the pause behind it included."""
    length = len(frame.data)
    stuffable = 19 + 8 * length
    bits = (frame.identifier << 7 | length) << 8 * length | int.from_bytes(frame.data, "big")  # start, RTR, IDE, r0: 0
    crc = 0
    for place in range(stuffable - 1, -1, -1):
        feedback = (bits >> place & 1) ^ (crc >> 14)
        crc = (crc << 1 & 0x7FFF) ^ (_CRC15 if feedback else 0)
    bits = bits << 15 | crc
    stuffable += 15
    stuffed, run, last = 0, 0, -1
    for place in range(stuffable - 1, -1, -1):
        bit = bits >> place & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            last, run = 1 - bit, 1
    return stuffable + stuffed + _AFTER_CRC


class BusLoad:
    """Share of the time for which a bus is busy, over the last second. Bits are counted when somebody asks."""

    def __init__(self, bitrate: int = DEFAULT_BITRATE) -> None:
        """`bitrate` in bit/s."""
        self.bitrate = bitrate
        self._new: deque[tuple[float, CanFrame]] = deque()
        self._counted: deque[tuple[float, int]] = deque()
        self._bits = 0  # of the counted
        self._begun: float | None = None

    def add(self, now_s: float, frame: CanFrame) -> None:
        """A frame was on the bus."""
        if self._begun is None:
            self._begun = now_s
        self._new.append((now_s, frame))
        while self._new[0][0] < now_s - _WINDOW_S:
            self._new.popleft()

    def share(self, now_s: float) -> float | None:
        """0 to 1; None until a tenth of a second after the first frame."""
        for time_s, frame in self._new:
            bits = frame_bits(frame)
            self._counted.append((time_s, bits))
            self._bits += bits
        self._new.clear()
        while self._counted and self._counted[0][0] < now_s - _WINDOW_S:
            self._bits -= self._counted.popleft()[1]
        passed = 0.0 if self._begun is None else min(now_s - self._begun, _WINDOW_S)
        return self._bits / (self.bitrate * passed) if passed >= _LEAST_S else None
