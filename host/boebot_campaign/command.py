"""`boebot sweep FILE`, and what the commands of all campaigns have in common: options, the dry run, the bar with the
newest rows."""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
import time
from collections.abc import Callable
from datetime import timedelta
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from boebot import missing
from boebot.cli import options, output, streams
from boebot.cli.ending import Detail
from boebot.errors import InterruptedRunError
from boebot.record.figures import counted, text
from boebot.running.loop import execute
from boebot_campaign import kept, plan
from boebot_campaign.kept import PARTS, Folder
from boebot_campaign.plan import Plan
from boebot_campaign.report import MEANS, words
from boebot_campaign.rows import request_of
from boebot_campaign.sweep import Work, carried_out, run_plan

if TYPE_CHECKING:
    from rich.console import RenderableType

NEWEST = ("row", "brain", "arena", "seed", *MEANS, "status")
NEWEST_ROWS = 6

_P = TypeVar("_P", bound=Plan)
_T = TypeVar("_T")
File = Annotated[Path, typer.Argument(metavar="FILE", help="What to run.")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="The folder that it makes. Else called as the file.")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="URL", help="Of a Dask cluster, tcp://HOST:PORT. Else workers of this computer.")
]
Count = Annotated[int | None, typer.Option(metavar="N", min=1, help="Of this computer; else one a processor.")]
DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Check all, say how many runs it is and, by a trial, how long they take.")
]


def command(kind: type[_P], work: Work[_P, _T]) -> Callable[[Callable[[_T, Detail], None]], Callable[..., None]]:
    """Makes the command of a kind of campaign out of a function that prints what came of it, and whose text is the
    command's help."""

    def made(prints: Callable[[_T, Detail], None]) -> Callable[..., None]:
        def run(
            file: File,
            out: Out = None,
            scheduler: Scheduler = None,
            workers: Count = None,
            dry_run: DryRun = False,
            json: options.Json = False,
            quiet: options.Quiet = False,
        ) -> None:
            check = output.progress_bar(f"{file.name} is checked", math.inf, quiet or json, "")
            with check, streams.kept(for_the_answer=json):  # here brains are loaded, too
                asked, path = plan.read(file, kind), out or Path(file.stem)
                took_s = _one_worker_s(asked) if dry_run else 0.0
            if dry_run:
                _say_size(asked, took_s, json)
                return
            below = lambda: newest_rows(path, int(time.perf_counter()))  # noqa: E731
            bar = output.progress_bar(path.name, asked.most_runs, quiet or json, " runs", left=True, below=below)
            try:
                with bar as told, streams.kept(for_the_answer=json):
                    done = carried_out(work, asked, path, scheduler, workers, told)
            except KeyboardInterrupt:
                said = f"interrupted; what is done is in {path}, and the same command goes on"
                raise InterruptedRunError(said) from None
            prints(done, Detail.JSON if json else Detail.NOTHING if quiet else Detail.FEW)

        run.__doc__ = prints.__doc__
        return run

    return made


@command(Plan, run_plan)
def sweep(done: Folder, wanted: Detail) -> None:
    """Run brains in all the ways that a file says, and keep a row of each run.

    Stopped anywhere, the same command goes on where it was. The rows are a Parquet file, rows.parquet; the file is as
    docs/how-to/sweeps.md says."""
    count, statuses = done.plan.count, done.statuses()
    if wanted is Detail.JSON:
        output.print_json({"runs": count, "statuses": statuses, "folder": str(done.path), "rows": str(done.rows)})
    elif wanted is not Detail.NOTHING:
        output.line(f"{counted(count, 'run', 'runs')}: {', '.join(f'{one:,} {how}' for how, one in statuses.items())}")
        output.line(f"rows in {done.rows}")
        _say_errors(done)


def _one_worker_s(asked: Plan) -> float:
    """How long all runs take, by the second of two."""
    with tempfile.TemporaryDirectory() as name, kept.locked(Path(name) / "sweep", asked.as_sweep()) as folder:
        for row in (0, folder.plan.count - 1):  # the first one imports, too
            begun_s = time.perf_counter()
            error = execute(request_of(folder, folder.plan.case(row, folder.points))).error
            if isinstance(error, KeyboardInterrupt):
                raise error
            took_s = time.perf_counter() - begun_s
    return asked.most_runs * took_s


def _say_size(asked: Plan, took_s: float, json: bool) -> None:
    """How many runs it is, and how long they take."""
    runs = asked.most_runs
    if json:
        output.print_json({"runs": runs, "one_worker_s": round(took_s, 3)})
    else:
        most, took = "" if runs == asked.count else "at most ", timedelta(seconds=math.ceil(took_s))
        output.line(f"{most}{counted(runs, 'run', 'runs')}: about {took} (hours:minutes:seconds) of one processor")


def _say_errors(done: Folder) -> None:
    """The errors that came most often, with a row to look at."""
    table = done.table(["row", "error"])
    errors = table.filter(table["error"].is_valid()).group_by("error").aggregate([("row", "count"), ("row", "min")])
    for one in errors.sort_by([("row_count", "descending")]).slice(0, 3).to_pylist():
        output.line(f"{counted(one['row_count'], 'time', 'times')}, first in row {one['row_min']}: {one['error']}")


@lru_cache(maxsize=1)
def newest_rows(folder: Path, _second: int = 0) -> RenderableType:
    """Of the last part in a campaign's folder, as a table; read once in a second. Of many parts their names are read,
    and no more."""
    parquet = missing.imported("pyarrow.parquet", "a sweep", "pyarrow", "sweep")
    with contextlib.suppress(OSError, ValueError):  # there is no part yet, or it has just been merged
        parts = max([*folder.glob(PARTS), *folder.glob(f"*/{PARTS}")])
        newest = max(one.name for one in os.scandir(parts) if one.name[0].isdigit() and one.name.endswith(".parquet"))
        table = output.empty_table()
        for name in NEWEST:
            table.add_column(words(name))
        with parquet.ParquetFile(parts / newest) as file:
            for row in file.read(list(NEWEST)).to_pylist()[-NEWEST_ROWS:]:
                table.add_row(*("" if value is None else text(value) for value in row.values()))
        return table
    return ""
