"""Measures what the frame's protections let through, prints tables and writes build/error_rates.json.

    python -m tools.error_rates [--receiver c|python|image|bits ...] [--damaged N] [--json] [--page FILE]

Each receiver gets streams with each fault until it has seen --damaged damaged frames of it; so many without a wrong one
accepted show the allowed rate at 95 % confidence. The image's rate is shown for all faults together: it runs in
the emulator. The random numbers are the same each time. The exit code is 1 when something is not met.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from tools.error_rates import library, wrong_bits
from tools.error_rates.statistics import LOST_ALLOWED, LOST_ALLOWED_CUT, RATE_ALLOWED, trials_needed
from tools.error_rates.streams import FAULTS, Tally, pooled, through_c, through_python

RESULT = Path("build/error_rates.json")
RECEIVERS = ("bits", "c", "python", "image")
SAMPLES = 2_000_000  # random sets of 4 and of 5 wrong bits for each payload
PART = 100_000  # rounds in one go


def until_enough(run: Callable[[int, int], Tally], damaged: int, rounds: int = PART) -> Tally:
    """Runs parts (rounds, number) until so many frames were damaged."""
    total = run(rounds, 0)
    part = 1
    while total.damaged < damaged:
        total.add(run(rounds, part))
        part += 1
    return total


def c_job(end: str, fault: int, damaged: int) -> Tally:
    """One fault at one end of the decoder in C."""
    return until_enough(lambda rounds, part: through_c(end, fault, rounds, part), damaged)


def python_job(fault: int, damaged: int) -> Tally:
    """One fault at the Python decoder."""
    return until_enough(lambda rounds, part: through_python(fault, rounds, part), damaged)


def image_job(fault: int, damaged: int) -> Tally:
    """One fault at the image in the emulated board."""
    from tools.error_rates.image import Image

    with Image() as image:
        return until_enough(lambda rounds, part: image.run(fault, rounds, part), damaged, rounds=20_000)


def jobs(receivers: list[str], damaged: int) -> Iterator[tuple[Callable[..., Any], tuple[Any, ...]]]:
    """What has to be measured, the longest first."""
    if "image" in receivers:
        yield from ((image_job, (fault, -(-damaged // len(FAULTS)))) for fault in range(len(FAULTS)))
    if "bits" in receivers:
        for end in library.ENDS:
            for size in reversed(wrong_bits.lengths(end)):
                for bits in wrong_bits.BITS:
                    samples = 0 if bits <= wrong_bits.EXHAUSTIVE else SAMPLES
                    yield wrong_bits.measure, (end, size, bits, samples)
    if "python" in receivers:
        yield from ((python_job, (fault, damaged)) for fault in range(len(FAULTS)))
    if "c" in receivers:
        yield from ((c_job, (end, fault, damaged)) for end in library.ENDS for fault in range(len(FAULTS)))


def sorted_tallies(tallies: list[Tally]) -> list[Tally]:
    """By receiver, each followed by all of its faults together."""
    rows = []
    for receiver in sorted({tally.receiver for tally in tallies}):
        mine = [tally for tally in tallies if tally.receiver == receiver]
        rows += [*sorted(mine, key=lambda tally: FAULTS.index(tally.fault)), pooled(mine)]
    return rows


def stream_rows(tallies: list[Tally]) -> list[list[str]]:
    """The cells of the table of streams."""
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
    ]


def bit_rows(tallies: list[wrong_bits.BitTally]) -> list[list[str]]:
    """The cells of the table of wrong bits: a row for each length."""
    rows = []
    for end, size in sorted({(tally.end, tally.wire_bytes) for tally in tallies}):
        mine = [tally for tally in tallies if (tally.end, tally.wire_bytes) == (end, size)]
        patterns = [f"{sum(t.patterns for t in mine if t.bits == bits):,}" for bits in wrong_bits.BITS]
        rows.append([end, str(size), *patterns, str(sum(t.accepted for t in mine)), str(sum(t.lost for t in mine))])
    return rows


STREAM_HEAD = ["receiver", "fault", "sent", "damaged", "wrong", "wrong rate, 95 %", "lost", "lost per damaged"]
BIT_HEAD = ["to", "wire bytes", *(f"{n} wrong" for n in wrong_bits.BITS), "accepted", "lost"]


def markdown(head: list[str], rows: list[list[str]]) -> str:
    """A table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def page(bits: list[wrong_bits.BitTally], streams: list[Tally]) -> str:
    """The page of the documentation."""
    template = (library.HERE / "page.md").read_text(encoding="utf-8")
    return template.format(
        bits=markdown(BIT_HEAD, bit_rows(bits)),
        streams=markdown(STREAM_HEAD, stream_rows(streams)),
        needed=f"{trials_needed():,}",
        lost_allowed=LOST_ALLOWED,
        lost_allowed_cut=LOST_ALLOWED_CUT,
    )


def shown(title: str, head: list[str], rows: list[list[str]]) -> Table:
    """A table for the terminal."""
    table = Table(*head, title=title)
    for row in rows:
        table.add_row(*row)
    return table


def all_met(bits: list[wrong_bits.BitTally], streams: list[Tally]) -> bool:
    """No wrong bits accepted; each receiver's rate shown over all faults, and for each fault where enough frames were
    damaged; no receiver loses too many neighbours.
    """
    judged = [tally for tally in streams if tally.fault == "all" or tally.damaged >= trials_needed()]
    fine = all(tally.excess == 0 and tally.lost_rate <= tally.lost_allowed for tally in streams)
    return fine and all(tally.met for tally in judged) and all(tally.met for tally in bits)


def main() -> int:
    """Measures, prints, writes."""
    parser = argparse.ArgumentParser(prog="python -m tools.error_rates", description=__doc__.splitlines()[0])
    parser.add_argument("--receiver", action="append", choices=RECEIVERS, help="only this; may be repeated")
    parser.add_argument("--damaged", type=int, default=trials_needed(), help="damaged frames for each fault")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    parser.add_argument("--page", type=Path, help="also write the documentation's page to this file")
    options = parser.parse_args()
    for end in library.ENDS:
        library.library(end)  # compiled before several processes want it
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        waiting = [
            pool.submit(job, *given) for job, given in jobs(options.receiver or list(RECEIVERS), options.damaged)
        ]
        results = [future.result() for future in waiting]
    bits = [result for result in results if isinstance(result, wrong_bits.BitTally)]
    streams = sorted_tallies([result for result in results if isinstance(result, Tally)])
    met = all_met(bits, streams)
    text = {"wrong_bits": [t.row() for t in bits], "streams": [t.row() for t in streams], "met": met}
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps(text, indent=2) + "\n", encoding="utf-8")
    if options.json:
        print(json.dumps(text))
    else:
        console = Console(width=None if sys.stdout.isatty() else 150)
        if bits:
            console.print(shown("Wrong bits: sets tried", BIT_HEAD, bit_rows(bits)))
        if streams:
            console.print(shown("Spoilt streams", STREAM_HEAD, stream_rows(streams)))
        console.print("all met" if met else "NOT MET")
    if options.page:
        options.page.write_text(page(bits, streams), encoding="utf-8")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
