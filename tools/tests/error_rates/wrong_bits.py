"""One to five wrong bits in every message (wrong_bits.h): all sets of one to three, random ones of four and five."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

from boebot.link import messages
from boebot.link.frame import FRAME_OVERHEAD
from tools.tests.error_rates.library import ROOT, ffi, library, new
from tools.tests.error_rates.statistics import LOST_ALLOWED

BITS = (1, 2, 3, 4, 5)
EXHAUSTIVE = 3  # up to three bits every set is tried
SAMPLES = 2_000_000  # random sets for each payload beyond


@dataclass
class BitTally:
    """How often a frame with wrong bits was accepted, and a neighbour was not."""

    end: str  # which end receives: "board" or "host"
    wire_bytes: int
    bits: int
    patterns: int = 0
    accepted: int = 0
    lost: int = 0

    @property
    def met(self) -> bool:
        """Whether nothing wrong was accepted and few neighbours were lost, none of them by a single bit."""
        return self.accepted == 0 and self.lost <= (self.bits > 1) * LOST_ALLOWED * self.patterns


@cache
def golden_payloads() -> dict[int, bytes]:
    """The last golden payload of each message, drawn at random when the vectors were made."""
    rows = json.loads((ROOT / "protocol" / "vectors" / "frames.json").read_text(encoding="utf-8"))
    return {row["id"]: bytes.fromhex(row["payload"]) for row in rows}


def payloads(kind: type[messages.Message]) -> Iterator[bytes]:
    """All zero, all ones, golden, and one drawn for this purpose."""
    draw = random.Random(kind.ID)
    yield bytes(kind.LENGTH)
    if kind.LENGTH:
        yield b"\xff" * kind.LENGTH
        yield golden_payloads()[kind.ID]
        yield draw.randbytes(kind.LENGTH)


def kinds(end: str) -> list[type[messages.Message]]:
    """The messages to one end."""
    return [kind for kind in messages.MESSAGES.values() if (kind.ID >= 0x80) == (end == "host")]


def lengths(end: str) -> list[int]:
    """Wire bytes of the frames to one end, both delimiters counted, each length once."""
    return sorted({kind.LENGTH + FRAME_OVERHEAD for kind in kinds(end)})


def measure(end: str, wire_bytes: int, bits: int, exhaustive: int = EXHAUSTIVE, samples: int = SAMPLES) -> BitTally:
    """Wrong bits in every message of that length.

    Args:
        end: which end receives.
        wire_bytes: length of the frames.
        bits: how many are wrong.
        exhaustive: up to this number of bits, at most three, every set is tried.
        samples: random sets for each payload beyond.
    """
    tally = BitTally(end, wire_bytes, bits)
    lib, counts, frame = library(end), new("wrong_bits_tally *"), new("wrong_bits_frame *")
    for kind in (kind for kind in kinds(end) if wire_bytes == kind.LENGTH + FRAME_OVERHEAD):
        for number, payload in enumerate(payloads(kind)):
            draw = random.Random(f"{kind.NAME} {number} {bits}")
            frame.id, frame.length, frame.sequence = kind.ID, kind.LENGTH, draw.randrange(256)
            frame.seed = draw.randrange(1, 1 << 21)
            ffi().memmove(frame.payload, payload, len(payload))
            if bits <= exhaustive:
                lib.wrong_bits_all(frame, bits, counts)
            else:
                lib.wrong_bits_some(frame, bits, samples, draw.randrange(1 << 64), counts)
    tally.patterns, tally.accepted, tally.lost = int(counts.patterns), int(counts.accepted), int(counts.lost)
    return tally
