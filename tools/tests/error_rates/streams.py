"""Spoilt streams of frames (channel.h) through the decoders in C."""

from __future__ import annotations

from dataclasses import dataclass, fields
from hashlib import sha256
from typing import Any

from tools.tests.error_rates.library import library, new
from tools.tests.error_rates.statistics import LOST_ALLOWED, LOST_ALLOWED_CUT, RATE_ALLOWED, upper_bound

# The faults in the order of channel_fault, as people call them.
FAULTS = (
    "bit errors, 1e-4",
    "bit errors, 3e-3",
    "bytes dropped",
    "bytes inserted",
    "bytes doubled",
    "bursts",
    "truncation",
    "concatenation",
    "noise",
    "earlier session",
    "foreign frames",
)


@dataclass
class Tally:
    """What a receiver made of some rounds; the counts are those of channel_tally."""

    receiver: str
    fault: str
    rounds: int = 0
    sent: int = 0
    damaged: int = 0
    accepted: int = 0
    wrong: int = 0
    lost: int = 0
    excess: int = 0

    def add(self, counts: Any) -> None:
        """Adds the counts of a channel_tally or another Tally."""
        for field in fields(self)[2:]:
            setattr(self, field.name, getattr(self, field.name) + int(getattr(counts, field.name)))

    @property
    def wrong_bound(self) -> float:
        """Rate of wrong frames per damaged frame that is not exceeded, at 95 % confidence."""
        return upper_bound(self.wrong, self.damaged) if self.damaged else 1.0

    @property
    def lost_rate(self) -> float:
        """Untouched frames lost per damaged frame."""
        return self.lost / self.damaged if self.damaged else 0.0

    @property
    def lost_allowed(self) -> float:
        """Untouched frames that may be lost per damaged frame."""
        return LOST_ALLOWED_CUT if self.fault == "truncation" else LOST_ALLOWED

    @property
    def met(self) -> bool:
        """Whether everything asked for is shown."""
        return self.wrong_bound <= RATE_ALLOWED and self.lost_rate <= self.lost_allowed and self.excess == 0


def pooled(tallies: list[Tally]) -> Tally:
    """All faults of one receiver together."""
    total = Tally(tallies[0].receiver, "all")
    for tally in tallies:
        total.add(tally)
    return total


def seed_of(receiver: str, fault: int, part: int) -> int:
    """Start of the random numbers: fixed, and another one for each receiver, fault and part of the run."""
    return int.from_bytes(sha256(f"{receiver}/{fault}/{part}".encode()).digest()[:8], "little")


def through_c(end: str, fault: int, rounds: int, part: int = 0, without: str = "") -> Tally:
    """Rounds through the decoder in C at that end ("board" or "host"), without one of its protections if wanted."""
    tally = Tally(f"C, {end}'s end", FAULTS[fault])
    counts = new("channel_tally *")
    library(end, without).channel_run(fault, rounds, seed_of(tally.receiver, fault, part), counts)
    tally.add(counts)
    return tally
