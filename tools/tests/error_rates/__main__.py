"""Measures what the frame's protections let through and prints it as tables.

    python -m tools.tests.error_rates [--page FILE]

Each receiver gets streams with each fault until enough of its frames were damaged to show the allowed rate at 95 %
confidence. The image's rate is shown for all faults together, as it runs in the emulator. The random numbers are the
same each time. The exit code is 1 when a limit is missed.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from tools.tests.error_rates import library, wrong_bits
from tools.tests.error_rates.image import Image
from tools.tests.error_rates.statistics import RATE_ALLOWED, trials_needed
from tools.tests.error_rates.streams import FAULTS, Tally, pooled, through_c
from tools.tests.printed import markdown, reprint

PART = 100_000  # rounds in one go; of the image IMAGE_PART
IMAGE_PART = 20_000
# Wrong frames to be expected by chance. Only the checksum refuses a frame with a long burst, and of ten million frames
# with a burst it passes one. The number of damaged frames is fixed beforehand, so that the bound keeps its confidence:
# as many as show the allowed rate with four wrong frames.
WRONG_EXPECTED = {"bursts": 4}
Result = Tally | wrong_bits.BitTally
STREAM_HEAD = ["receiver", "fault", "sent", "damaged", "wrong", "wrong rate, 95 %", "lost", "lost per damaged"]
BIT_HEAD = ["to", *(f"{n} wrong" for n in wrong_bits.BITS), "accepted", "lost"]


def damaged_needed(fault: int) -> int:
    """Damaged frames with that fault, to show the allowed rate."""
    return trials_needed(WRONG_EXPECTED.get(FAULTS[fault], 0))


def until_damaged(run: Callable[[int, int, int], Tally], fault: int, damaged: int, rounds: int = PART) -> Tally:
    """Runs parts (fault, rounds, number) until as many frames were damaged."""
    total, part = run(fault, rounds, 0), 1
    while total.damaged < damaged:
        total.add(run(fault, rounds, part))
        part += 1
    return total


def through_image(fault: int, damaged: int) -> Tally:
    """One fault at the image in the emulated board."""
    with Image() as image:
        return until_damaged(image.run, fault, damaged, IMAGE_PART)


def jobs() -> Iterator[Callable[[], Result]]:
    """What has to be measured, the longest first."""
    faults = range(len(FAULTS))
    yield from (partial(through_image, fault, -(-trials_needed() // len(FAULTS))) for fault in faults)
    for end in library.ENDS:
        for size in reversed(wrong_bits.lengths(end)):
            yield from (partial(wrong_bits.measure, end, size, bits) for bits in wrong_bits.BITS)
    for end in library.ENDS:
        yield from (partial(until_damaged, partial(through_c, end), fault, damaged_needed(fault)) for fault in faults)


def by_receiver(tallies: list[Tally]) -> list[Tally]:
    """Sorted, each receiver's followed by all of its faults together."""
    rows = []
    for receiver in sorted({tally.receiver for tally in tallies}):
        mine = [tally for tally in tallies if tally.receiver == receiver]
        rows += [*sorted(mine, key=lambda tally: FAULTS.index(tally.fault)), pooled(mine)]
    return rows


def stream_rows(tallies: list[Tally]) -> list[list[str]]:
    """The cells of the table of streams: all faults together, and those by which a frame was wrong or lost."""
    return [
        [
            tally.receiver,
            tally.fault,
            f"{tally.sent:,}",
            f"{tally.damaged:,}",
            str(tally.wrong),
            f"{tally.wrong_bound / RATE_ALLOWED:.2f} · 2⁻²⁰",
            str(tally.lost),
            f"{tally.lost_rate:.4f}",
        ]
        for tally in tallies
        if tally.fault == "all" or tally.wrong or tally.lost
    ]


def bit_rows(tallies: list[wrong_bits.BitTally]) -> list[list[str]]:
    """The cells of the table of wrong bits: a row for each end."""
    rows = []
    for end in sorted({tally.end for tally in tallies}):
        mine = [tally for tally in tallies if tally.end == end]
        patterns = [f"{sum(t.patterns for t in mine if t.bits == bits):,}" for bits in wrong_bits.BITS]
        rows.append([end, *patterns, str(sum(t.accepted for t in mine)), str(sum(t.lost for t in mine))])
    return rows


def missed(bits: list[wrong_bits.BitTally], streams: list[Tally]) -> list[Result]:
    """Where a limit is missed. The rate of wrong frames has to be shown for all faults together, and for each fault
    where enough frames were damaged."""

    def is_fine(tally: Tally) -> bool:
        kept = tally.excess == 0 and tally.lost_rate <= tally.lost_allowed
        return tally.met if tally.fault == "all" or tally.damaged >= trials_needed() else kept

    return [*(tally for tally in bits if not tally.met), *(tally for tally in streams if not is_fine(tally))]


def main() -> int:
    """Measures, prints, writes."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.tests.error_rates", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--page", type=Path, help="also print the tables onto this page")
    options = parser.parse_args()
    for end in library.ENDS:
        library.library(end)  # compiled before several processes want it
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        results = [done.result() for done in [pool.submit(job) for job in jobs()]]
    bits = [result for result in results if isinstance(result, wrong_bits.BitTally)]
    streams = by_receiver([result for result in results if isinstance(result, Tally)])
    tables = "\n\n".join([markdown(BIT_HEAD, bit_rows(bits)), markdown(STREAM_HEAD, stream_rows(streams))])
    print(tables)
    if options.page:
        reprint(options.page, tables)
    failures = missed(bits, streams)
    print(*(f"missed: {tally}" for tally in failures), "" if failures else "all limits are kept", sep="\n")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
