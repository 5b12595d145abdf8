"""A stop of the motors, sent again with the same token until it is confirmed (protocol/PROTOCOL.md, "Delivery")."""

from __future__ import annotations

from boebot.link import messages
from boebot.link.counters import HostCounters
from boebot.link.line import NEVER, Send

_TOKENS = 256


class MotorStop:
    """The stop command of one link.

    Attributes:
        pending: a stop is not yet confirmed.
    """

    def __init__(self, send: Send, counts: HostCounters) -> None:
        self.pending = False
        self._send = send
        self._counts = counts
        self._token = 0
        self._sent_s: float | None = None  # when the stop of this token was last sent

    def begin(self) -> None:
        """A new stop; it replaces one that is not yet confirmed."""
        self._token = (self._token + 1) % _TOKENS
        self.pending = True
        self._sent_s = None

    def service(self, now_s: float, retry_s: float) -> float:
        """Sends the stop if it is time; returns when it is the next time (s)."""
        if not self.pending:
            return NEVER
        if self._sent_s is None or now_s >= self._sent_s + retry_s:
            self._counts.retransmitted += self._sent_s is not None
            self._sent_s = now_s
            self._send(messages.Stop(self._token))
        return self._sent_s + retry_s

    def receive(self, payload: bytes, _: float) -> None:
        """Takes a `stopped`."""
        if messages.Stopped.unpack(payload).token == self._token:
            self.pending = False

    def session_opened(self) -> None:
        """The motors are latched off at the beginning of a session."""
        self.pending = False
