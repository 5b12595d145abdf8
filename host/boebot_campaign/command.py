"""`boebot sweep FILE`."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from boebot.cli import options, output
from boebot.errors import InterruptedRunError
from boebot.running.loop import Progress
from boebot_campaign import kept, plan
from boebot_campaign.rows import OK
from boebot_campaign.sweep import Sweep
from boebot_campaign.sweep import sweep as run_sweep


def sweep(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What to run: docs/how-to/sweeps.md has its keys.")],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The sweep's folder. Else called as the file.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="URL", help="Of a Dask cluster, tcp://HOST:PORT. Else workers of this computer."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Of this computer; else one a processor.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check all, say how many runs it is, and run none.")
    ] = False,
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
        output.print_json({"runs": asked.count, **counts}) if json else output.line(
            f"{asked.count:,} runs: {', '.join(f'{name} {count:,}' for name, count in counts.items())}"
        )
        return
    folder = out or Path(file.stem)
    try:
        with _shown(asked.count, quiet or json) as told:
            done = run_sweep(file, out=folder, scheduler=scheduler, workers=workers, progress=told)
    except KeyboardInterrupt:
        raise InterruptedRunError(f"interrupted; what is done is in {folder}, and the same command goes on") from None
    statuses = done.statuses()
    if json:
        output.print_json({"runs": asked.count, "statuses": statuses, "folder": str(folder), "rows": str(done.path)})
    elif not quiet:
        output.line(f"{asked.count:,} runs: {', '.join(f'{count:,} {status}' for status, count in statuses.items())}")
        output.line(f"rows in {done.path}")
        _say_errors(done)


def _say_errors(done: Sweep) -> None:
    """The errors that came most often, with a row to look at."""
    first: dict[str, int] = {}
    counts: Counter[str] = Counter()
    for batch in kept.Folder(done.folder).table(["row", "status", "error"]).to_batches():
        for one in batch.to_pylist():
            if one["status"] != OK:
                counts[one["error"]] += 1
                first.setdefault(one["error"], one["row"])
    for error, count in counts.most_common(3):
        output.line(f"{count:,} times, first in row {first[error]}: {error}")


@contextlib.contextmanager
def _shown(total: int, quiet: bool) -> Iterator[Progress]:
    """Gives a function to call with how many rows are done; shows a bar with the time left."""
    with output.progress_bar("sweep", total, quiet, unit=" runs", left=True) as progress:
        yield progress
