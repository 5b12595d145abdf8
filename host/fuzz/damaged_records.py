"""Records of runs with damage at random places, as a disk, a card or a cable makes it: `make fuzz`.

    python host/fuzz/damaged_records.py [--cases N] [--seed N]

A case is silent where the run that is read back has other rows, figures or files than the undamaged one and does not
say so: its error is none of a damaged or cut record, and `boebot report` ends with exit code 0. There must be none.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import boebot
from boebot.record.reading import CutError, attachments_of
from boebot.record.run_folder import RECORD
from boebot.result import read_run, robots_of

STEPS = 10  # of a brain in a group: a record of a few seconds has many
RUNS: dict[str, Callable[[Path], object]] = {
    "board": lambda out: boebot.run("demo", "shieldbot-charging", arena="station", seconds=5, out=out),
    "vehicle": lambda out: boebot.run("wander", "arsim", seconds=10, out=out),
    "two": lambda out: boebot.run_together([boebot.Member(), boebot.Member(robot="arsim")], seconds=3, out=out),
}


def record(name: str, folder: Path) -> Path:
    """The record of one of `RUNS`, in many groups."""
    with mock.patch("boebot.record.record.STEPS_AT_MOST", STEPS):
        RUNS[name](folder)
    return folder / RECORD


def content(path: Path) -> list[Any]:
    """All that is read back of a run: attachments, figures and rows of its robots."""
    found: list[Any] = [attachments_of(path)]
    for robot in robots_of(read_run(path)).values():
        streams = sorted(robot.record.streams())
        found += [robot.table(), {stream: robot.record.rows(stream) for stream in streams}]
    return found


def damaged(data: bytes, chance: random.Random) -> tuple[str, bytes]:
    """One damage, in words, and the record that has it: mostly a bit; else zeros or foreign bytes in place of some of
    its own, bytes that are gone or there twice."""
    begin = chance.randrange(len(data))
    end = min(begin + chance.choice((1, 16, 512, 4096)), len(data))
    part = data[begin:end]
    kind = chance.choices(("bit", "zeros", "noise", "gone", "twice"), (80, 5, 5, 5, 5))[0]
    if kind == "bit":
        bit = chance.randrange(8)
        return f"bit {bit} of byte {begin}", data[:begin] + bytes([data[begin] ^ 1 << bit]) + data[begin + 1 :]
    other = {"zeros": bytes(len(part)), "noise": chance.randbytes(len(part)), "gone": b"", "twice": part * 2}[kind]
    return f"{kind}, bytes {begin} to {end}", data[:begin] + other + data[end:]


def silent(path: Path, cases: int, chance: random.Random) -> list[str]:
    """Damages of a record that were not said, in words."""
    data, expected = path.read_bytes(), content(path)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        changed = Path(folder) / RECORD
        for _ in range(cases):
            what, other = damaged(data, chance)
            changed.write_bytes(other)
            try:
                said = any(isinstance(one.error, CutError) for one in robots_of(read_run(changed)).values())
            except boebot.BoebotError:
                said = True
            if not said and content(changed) != expected:
                found.append(what)
    return found


def main() -> int:
    """Damages the records of all runs."""
    parser = argparse.ArgumentParser("damaged_records.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=1000, help="in all; default: 1000")
    parser.add_argument("--seed", type=int, default=None, help="default: another one each time")
    options = parser.parse_args()
    seed = random.randrange(1 << 32) if options.seed is None else options.seed
    chance = random.Random(seed)
    failed = 0
    for number, name in enumerate(RUNS):
        count = (options.cases + number) // len(RUNS)
        with tempfile.TemporaryDirectory() as folder:
            unsaid = silent(record(name, Path(folder) / "run"), count, chance)
        print(f"damaged record, {name}: {len(unsaid)} of {count} silent (seed {seed})", *unsaid, sep="\n  ", flush=True)
        failed += len(unsaid)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
