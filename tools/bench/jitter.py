"""A long sweep of jitter and latency, with the Arduino core's Servo library beside ours.

Run `python -m tools.bench.jitter [--seconds 10] [--seeds 6] [--out build/jitter]`. Each seed begins at other phases.
Writes jitter.json, jitter.svg and jitter.png; the exit code is 1 if a limit is broken or anything was lost.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from boebot import resources
from boebot.timing.distributions import Distribution, JitterReport, Losses, rows
from boebot.timing.histograms import draw
from sim_bridge.timing.jitter import measure_jitter
from sim_bridge.timing.loads import OVERLOAD
from tools.bench import arduino_servo


def sweep(elf: Path, seconds: float, seeds: int) -> JitterReport:
    """All seeds together, `seconds` of the board's time for each under each load."""
    console = Console(stderr=True)
    reports = []
    with Progress(console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("jitter", total=float(seeds))
        for seed in range(1, seeds + 1):

            def share(done: float, seed: int = seed) -> None:
                progress.update(task, completed=seed - 1 + done)

            reports.append(measure_jitter(elf, seconds=seconds, seed=seed, progress=share))
    found: list[Distribution] = []
    for same in zip(*(report.distributions for report in reports), strict=True):
        found.append(replace(same[0], values=np.concatenate([one.values for one in same])))
    losses = [added(same) for same in zip(*(report.losses for report in reports), strict=True)]
    notes: tuple[str, ...] = ()
    try:
        found += arduino_servo.measure_all(seconds)
    except arduino_servo.UnavailableError as error:
        notes = (f"{arduino_servo.SUBJECT}: {error}",)
    return JitterReport(tuple(found), tuple(losses), notes)


def added(losses: tuple[Losses, ...]) -> Losses:
    """Of several runs under the same load."""
    names = [name for name in asdict(losses[0]) if name != "load"]
    return replace(losses[0], **{name: sum(getattr(one, name) for one in losses) for name in names})


def ours_is_broken(report: JitterReport) -> bool:
    """Whether our firmware broke a limit or lost anything but in an overload, or a tick there; another's may."""
    broken = any(one.subject != arduino_servo.SUBJECT for one in report.broken)
    return broken or any(
        one.ticks + one.late_ticks + one.resets if one.load == OVERLOAD.name else one.anything for one in report.losses
    )


def main() -> int:
    """Measures, prints, writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--elf", type=Path, default=resources.folder("images") / "shieldbot-quad.elf")
    parser.add_argument("--seconds", type=float, default=10.0, help="of the board's time, for each seed and load")
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--out", type=Path, default=Path("build/jitter"))
    wanted = parser.parse_args()
    report = sweep(wanted.elf, wanted.seconds, wanted.seeds)
    head, *body = rows(report.distributions)
    table = Table(*head)
    for row in body:
        table.add_row(*row)
    Console(width=180 if not sys.stdout.isatty() else None).print(table)
    for losses in report.losses:
        print(losses)
    for note in report.notes:
        print(note)
    wanted.out.mkdir(parents=True, exist_ok=True)
    (wanted.out / "jitter.json").write_text(json.dumps(report.as_json(), indent=1) + "\n", encoding="utf-8")
    for ending in ("svg", "png"):
        draw(report.distributions, wanted.out / f"jitter.{ending}")
    return int(ours_is_broken(report))


if __name__ == "__main__":
    sys.exit(main())
