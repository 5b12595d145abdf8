"""`boebot sweep FILE`, and what its relatives have in common with it: options, the bar with the newest rows."""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
import time
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from boebot import missing
from boebot.cli import options, output
from boebot.errors import InterruptedRunError
from boebot.record import figures
from boebot.running.loop import Progress, execute
from boebot_campaign import kept, plan
from boebot_campaign.kept import PARTS
from boebot_campaign.report import MEANS, words
from boebot_campaign.rows import request_of
from boebot_campaign.sweep import Sweep, run_plan

if TYPE_CHECKING:
    from rich.console import RenderableType

NEWEST = ("row", "brain", "arena", "seed", *MEANS, "status")
NEWEST_ROWS = 6

Out = Annotated[Path | None, typer.Option(metavar="DIR", help="The folder that it makes. Else called as the file.")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="URL", help="Of a Dask cluster, tcp://HOST:PORT. Else workers of this computer.")
]
Workers = Annotated[int | None, typer.Option(metavar="N", min=1, help="Of this computer; else one a processor.")]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Check all, say how many runs it is and, by a trial, how long they take."),
]


def sweep(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What to run: docs/how-to/sweeps.md has its keys.")],
    out: Out = None,
    scheduler: Scheduler = None,
    workers: Workers = None,
    dry_run: DryRun = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Run brains in all the ways that a file says, and keep a row of each run.

    Stopped anywhere, the same command goes on where it was. The rows are a Parquet file, rows.parquet."""
    asked = plan.read(file)
    if dry_run:
        counts = dict(
            zip(("arenas", "brains", "robots", "points", "faults", "starts", "seeds"), asked.sizes, strict=True)
        )
        took_s = _took_s(asked)
        if json:
            output.print_json({"runs": asked.count, **counts, "one_worker_s": round(took_s, 3)})
            return
        output.line(f"{asked.count:,} runs: {', '.join(f'{name} {count:,}' for name, count in counts.items())}")
        count = workers or os.cpu_count() or 1
        output.line(f"about {_time(took_s)} of one processor, {_time(took_s / count)} with {count} workers")
        return
    folder = out or Path(file.stem)
    with shown("sweep", folder, asked.count, quiet or json) as told:
        done = run_plan(asked, folder, scheduler, workers, told)
    statuses = done.statuses()
    if json:
        output.print_json({"runs": asked.count, "statuses": statuses, "folder": str(folder), "rows": str(done.path)})
    elif not quiet:
        output.line(f"{asked.count:,} runs: {', '.join(f'{count:,} {status}' for status, count in statuses.items())}")
        output.line(f"rows in {done.path}")
        _say_errors(done)


def _took_s(asked: plan.Plan) -> float:
    """Of one worker, for all runs: by the second of two runs of each brain in the first arena."""
    each, took_s = math.prod(asked.sizes[2:]), 0.0
    with tempfile.TemporaryDirectory() as name, kept.locked(Path(name) / "sweep", asked) as folder:
        for number in range(len(asked.brains)):
            for _ in range(2):
                begun_s = time.perf_counter()
                error = execute(request_of(folder, asked.case(number * each, folder.points))).error
                if isinstance(error, KeyboardInterrupt):
                    raise error
            took_s += time.perf_counter() - begun_s
    return asked.count * took_s / len(asked.brains)


def _time(seconds: float) -> str:
    """In the largest unit of which there is one."""
    large = next((one for one in (("h", 3600), ("min", 60)) if seconds >= one[1]), ("s", 1))
    return f"{seconds / large[1]:,.1f} {large[0]}"


def _say_errors(done: Sweep) -> None:
    """The errors that came most often, with a row to look at."""
    table = done.table(["row", "error"])
    errors = table.filter(table["error"].is_valid()).group_by("error").aggregate([("row", "count"), ("row", "min")])
    for one in errors.sort_by([("row_count", "descending")]).slice(0, 3).to_pylist():
        output.line(f"{one['row_count']:,} times, first in row {one['row_min']}: {one['error']}")


@contextlib.contextmanager
def shown(what: str, folder: Path, total: int, quiet: bool) -> Iterator[Progress]:
    """Gives a function to call with how many rows of a sweep's folder are done; shows a bar with the time left, and the
    newest rows.

    Raises:
        InterruptedRunError: Ctrl-C in the block.
    """
    try:
        below = lambda: newest_rows(folder, int(time.perf_counter()))  # noqa: E731
        with output.progress_bar(what, total, quiet, unit=" runs", left=True, below=below) as progress:
            yield progress
    except KeyboardInterrupt:
        raise InterruptedRunError(f"interrupted; what is done is in {folder}, and the same command goes on") from None


@lru_cache(maxsize=1)
def newest_rows(folder: Path, _second: int = 0) -> RenderableType:
    """Of a sweep's folder, as a table: those of its newest part, read once in a second."""
    parquet = missing.imported("pyarrow.parquet", "a sweep", "pyarrow", "sweep")
    with contextlib.suppress(OSError, ValueError):  # there is no part yet, or it has just been merged
        newest = max((folder / PARTS).glob("[0-9]*.parquet"), key=lambda part: part.stat().st_mtime)
        with parquet.ParquetFile(newest) as file:
            rows = file.read(list(NEWEST)).to_pylist()[-NEWEST_ROWS:]
        table = output.empty_table()
        for name in NEWEST:
            table.add_column(words(name))
        for row in rows:
            table.add_row(*("" if value is None else figures.text(value) for value in row.values()))
        return table
    return ""
