"""What both ends of the link count. The board's counters are 16 bits wide and start anew with it; here they go on."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from boebot.link import messages

_MODULUS = 65536


@dataclass
class HostCounters:
    """What the host's end has counted since the link was made; each part of the link counts into the same object.

    Nine of them have the board's names, so that both ends stand side by side: good, bad, unknown, resynchronised,
    retransmitted, duplicate, overrun, dropped, late. Where they are about other things at the other end they say so.
    The decoder counts good, bad, unknown, resynchronised and lost frames, the transport overrun.
    """

    good: int = 0
    """frames accepted"""
    bad: int = 0
    """frames refused: length, checksum, stuffing or seed"""
    unknown: int = 0
    """whole frames of messages that a later minor version of the protocol has added, and that were ignored"""
    resynchronised: int = 0
    """times that a good frame followed bad ones"""
    lost: int = 0
    """frames that the board sent and that never came, by the gaps in their numbers"""
    retransmitted: int = 0
    """requests and stops sent again"""
    duplicate: int = 0
    """answers and events that came again and were only acknowledged"""
    stray: int = 0
    """answers and events that nobody waited for: out of order, or of no session"""
    overrun: int = 0
    """bytes lost in this computer, by a full buffer of the serial port or of its driver, where the operating system
    counts them (Linux), else 0; the thread that reads a port drops none. The board counts ticks, not bytes"""
    dropped: int = 0
    """telemetry messages that nobody fetched. At the board: messages not sent for want of room on the line"""
    late: int = 0
    """telemetry messages received more than three telemetry periods after their tick, by the clock's estimate, since
    that is bounded: what a brain makes of them is too old. At the board: set-points refused for the same reason"""
    held: int = 0
    """events left unacknowledged because nobody fetched those before"""
    sessions: int = 0
    """sessions opened; another one means that the board is latched and may have forgotten everything"""
    board_resets: int = 0
    """times that a new session's count of ticks had not gone on from that of the session before"""
    sessions_lost: int = 0
    """times that the board had ended the session, or another host had replaced it"""

    def as_dict(self) -> dict[str, int]:
        """By name."""
        return asdict(self)


class BoardCounters:
    """The board's counters, unwrapped: they grow over the board's modulo 65536 and over its resets."""

    def __init__(self) -> None:
        self.values: dict[str, int] = dict.fromkeys(messages.Counters._fields, 0)
        self.received = 0
        self._last: messages.Counters | None = None

    def add(self, counters: messages.Counters) -> None:
        """Adds what was counted since the message before."""
        before = self._last or messages.Counters(*(0,) * len(counters))
        for name, now, then in zip(counters._fields, counters, before, strict=True):
            self.values[name] += (now - then) % _MODULUS
        self._last = counters
        self.received += 1

    def restarted(self) -> None:
        """The board was reset: it counts from 0 again."""
        self._last = None
