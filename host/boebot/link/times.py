"""The link's time-outs."""

from __future__ import annotations

from dataclasses import dataclass

_PATIENCE = 1.5  # of the longest round trip


@dataclass(frozen=True, kw_only=True)
class LinkTimes:
    """The link's time-outs (s). All that is None follows from tick and baud rate."""

    retry_s: float | None = None
    """an unanswered request is sent again after this; None: see `retry_after`"""
    request_limit_s: float = 2.0
    """an unanswered request is given up after this"""
    save_limit_s: float = 5.0
    """the same for saving parameters, which the board answers when the EEPROM is written"""
    stop_limit_s: float = 2.0
    """how long `stop_and_confirm` waits"""
    open_limit_s: float | None = None
    """no board, or no session, after this; None: 2 s, or 4 s where opening the port resets the board"""
    probe_s: float | None = None
    """greatest time between two clock probes; None: as the clock needs it. The session may need them more often"""

    def retry_after(self, tick_s: float, byte_s: float, longest_s: float) -> float:
        """When to send a request again: one tick and 100 bytes, or 1.5 times the longest round trip lately, at most 10
        ticks and 400 bytes."""
        if self.retry_s is not None:
            return self.retry_s
        return min(max(tick_s + 100 * byte_s, _PATIENCE * longest_s), 10 * tick_s + 400 * byte_s)
