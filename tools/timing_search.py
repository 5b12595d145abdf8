"""Looks for the longest span of every task and interrupt, in each image under each scenario, and sets the maxima beside
bounds and budgets.

Run `python -m tools.timing_search [--seconds 60] [--seed 1] [--image shieldbot ...]`; `make soak` does. Writes
build/soak/timing-search.json. The exit code is 1 where a maximum is above its bound, its budget or its latency's limit,
130 after Ctrl-C, which prints what was found so far.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from boebot import resources
from boebot.errors import BoebotError
from boebot_timing import budget, loads
from boebot_timing.emulated.measure import CLOCK_HZ, SCENARIOS, robot_of, search
from boebot_timing.emulated.scenarios import SILENCE
from boebot_timing.measured import Measurement, Worst, merged
from tools.avr_program import IMAGES

RESULT = Path("build/soak/timing-search.json")
RUN_S = 0.4  # of the board's time, after the preparations


@dataclass(frozen=True)
class Found:
    """The longest that was seen of a task or interrupt, beside what it may take; cycles, None: not known."""

    image: str
    name: str
    kind: str
    largest: int
    worst: Worst
    bound: int
    budget: int
    latency: int | None = None
    latency_limit: int | None = None

    @property
    def is_broken(self) -> bool:
        """Whether it took longer than it may, or waited longer."""
        late = self.latency is not None and self.latency_limit is not None and self.latency > self.latency_limit
        return self.largest > min(self.bound, self.budget) or late

    @property
    def ratio(self) -> float | None:
        """Of the bound to the largest; None where nothing ran."""
        return self.bound / self.largest if self.largest else None


def beside_bounds(image: str, elf: Path, measured: Measurement) -> list[Found]:
    """The maxima of one image, in the order of its table."""
    rows = budget.prove(elf, loads.load_named("overload")).rows
    found = []
    for row in rows:
        spans = measured.row(row.name)
        waited = int(spans.latency.max()) if len(spans.latency) else None
        found.append(
            Found(
                image, row.name, row.kind, spans.largest, spans.worst, row.bound, row.budget, waited, row.latency_limit
            )
        )
    return found


def searched(elf: Path, seconds: float, seed: int, bars: Progress) -> tuple[Measurement | None, bool]:
    """All scenarios, `seconds` of the board's time each, and whether it came to its end; Ctrl-C ends it before."""
    robot = robot_of(elf)
    parts: list[Measurement] = []
    for scenario in SCENARIOS:
        length = RUN_S + (SILENCE / CLOCK_HZ if scenario == "everything" else 0.0)
        bar = bars.add_task(f"{elf.stem}, {scenario}", total=1.0)

        def show(share: float, bar: int = bar) -> None:
            bars.update(bar, completed=share)  # type: ignore[arg-type]

        try:
            runs = max(1, round(seconds / length))
            parts.append(search(elf, robot, scenario, seconds=length, runs=runs, seed=seed, progress=show))
        except KeyboardInterrupt:
            return (merged(parts) if parts else None), False
    return merged(parts), True


def shown(rows: list[Found]) -> Table:
    """For people."""
    table = Table("image", "what")
    for title in ("largest", "bound", "ratio", "budget", "latency", "limit", "scenario", "seed", "cycle"):
        table.add_column(title, justify="right")
    for row in rows:
        ratio = "" if row.ratio is None else f"{row.ratio:.2f}"
        waits = ["" if one is None else str(one) for one in (row.latency, row.latency_limit)]
        cells = [row.largest, row.bound, ratio, row.budget, *waits, row.worst.scenario, row.worst.seed, row.worst.cycle]
        table.add_row(row.image, row.name, *map(str, cells), style="bold red" if row.is_broken else None)
    return table


def main() -> int:
    """Searches, prints, writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=60.0, help="of the board's time, for each image and scenario")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--image", action="append", choices=IMAGES, help="one of the images; else all")
    wanted = parser.parse_args()
    if wanted.seconds <= 0:
        parser.error(f"--seconds is {wanted.seconds:g}; expected more than 0")
    rows: list[Found] = []
    console = Console(stderr=True)
    whole = True
    with Progress(console=console, disable=not console.is_terminal) as bars:
        for image in wanted.image or IMAGES:
            elf = resources.folder("images") / f"{image}.elf"
            try:
                measured, whole = searched(elf, wanted.seconds, wanted.seed, bars)
                rows += beside_bounds(image, elf, measured) if measured is not None else []
            except BoebotError as error:
                print(f"timing search: {error}", file=sys.stderr)
                return 2
            if not whole:
                break
    Console(width=None if sys.stdout.isatty() else 160).print(shown(rows))
    RESULT.parent.mkdir(parents=True, exist_ok=True)
    RESULT.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    return 130 if not whole else int(any(row.is_broken for row in rows))


if __name__ == "__main__":
    sys.exit(main())
