"""The firmware as other options of the compiler make it: each image is proved, and no task or interrupt takes longer in
the emulator than its bound.

Run `python -m tools.compilers [--compiler avr-gcc]`; `make soak` does. The exit code is 1 where an image is refused or
a bound does not hold. Budgets are those of the image as it is flashed, and not looked at.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from boebot.errors import BoebotError
from boebot.timing import budget, loads
from boebot.timing.measured import merged
from sim_bridge.timing.measure import SCENARIOS, measure, robot_of
from tools.bench.avr_program import SOURCES, flags

SECONDS = 0.7  # of the board's time, in each scenario
WHOLE = ("-flto", "-flto-partition=none", "-Os")
UNROLLED = ("-funroll-loops", "-funswitch-loops", "-fpeel-loops")
# By name: what is taken out of the firmware's options, and what comes to them.
OPTIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **{f"{level} whole": (("-Os",), (level,)) for level in ("-Os", "-O1", "-O2", "-O3", "-Og")},
    **{f"{level} by source": (WHOLE, (level,)) for level in ("-Os", "-O1", "-O2", "-O3", "-Og")},
    **{f"{level} jump tables": ((*WHOLE, "-fno-jump-tables"), (level,)) for level in ("-Os", "-O2")},
    **{f"{level} own prologues": ((*WHOLE, "-mcall-prologues"), (level,)) for level in ("-Os", "-O2")},
    **{f"{level} unrolled": (WHOLE, (level, *UNROLLED)) for level in ("-O1", "-O2", "-O3")},
    "-O2 not relaxed": ((*WHOLE, "-Wl,--relax"), ("-O2",)),
    "-O2 -mrelax": (WHOLE, ("-O2", "-mrelax")),
    "-O2 no lines": ((*WHOLE, "-gdwarf-2"), ("-O2",)),
}


@dataclass(frozen=True, slots=True)
class Row:
    """Of a task or interrupt: cycles by bound, and the most that were seen."""

    name: str
    bound: int
    seen: int


def build(image: Path, options: tuple[tuple[str, ...], tuple[str, ...]], compiler: str = "avr-gcc") -> Path:
    """The firmware by these options. Raises CalledProcessError."""
    without, more = options
    kept = [flag for flag in flags() if flag not in without]
    sources = [str(path) for path in sorted(SOURCES.rglob("*.c")) if "native" not in path.parts]
    command = [compiler, *kept, *more, f"-I{SOURCES}", "-o", str(image), *sources]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return image


def rows_of(image: Path) -> list[Row]:
    """Bounds beside what the emulator shows. Raises BoebotError: it is refused, or does not run."""
    report = budget.prove(image, loads.LOADS["saturated"])
    robot = robot_of(image)
    seen = merged([measure(image, robot, scenario, SECONDS) for scenario in SCENARIOS])
    return [Row(row.name, row.bound, seen.row(row.name).largest) for row in report.rows]


def judged(name: str, compiler: str, folder: Path) -> tuple[str, str]:
    """Bytes of flash, and what is wrong with an image; nothing where all is well."""
    try:
        image = build(folder / "firmware.elf", OPTIONS[name], compiler)
    except subprocess.CalledProcessError as error:
        return "", error.stderr.strip().splitlines()[-1]
    try:
        broken = [f"{row.name}: {row.seen} of {row.bound} cycles" for row in rows_of(image) if row.seen > row.bound]
        return str(budget.prove(image, loads.LOADS["figures"]).memory.flash), ", ".join(broken)
    except BoebotError as error:
        return "", str(error)


def main(arguments: Sequence[str] | None = None) -> int:
    """Builds, proves, measures, prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--compiler", default="avr-gcc", help="an avr-gcc")
    wanted = parser.parse_args(arguments)
    table = Table("options", "flash", "verdict", title=wanted.compiler)
    errors = Console(stderr=True)
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        for name in track(OPTIONS, "firmware by other options", console=errors, disable=not errors.is_terminal):
            size, fault = judged(name, wanted.compiler, Path(folder))
            table.add_row(name, size, fault or "proved", style="bold red" if fault else None)
            wrong += bool(fault)
    Console().print(table)
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
