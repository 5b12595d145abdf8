"""`boebot.sweep(...)`: all runs of a plan, and what came of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boebot.errors import CallError
from boebot.running.tasks import Request
from boebot_campaign import engine, kept, plan
from boebot_campaign.rows import request_of

if TYPE_CHECKING:
    import pandas
    import pyarrow


@dataclass(frozen=True)
class Sweep:
    """A sweep's folder, and what is in it so far."""

    folder: Path

    @property
    def path(self) -> Path:
        """All rows, in order: a Parquet file, which pandas and polars read."""
        return self.folder / kept.ROWS

    def table(self, columns: Sequence[str] | None = None) -> pyarrow.Table:
        """The rows so far, of those columns or of all."""
        return kept.Folder(self.folder).table(columns)

    def to_pandas(self) -> pandas.DataFrame:
        """The rows so far, by their number."""
        return self.table().to_pandas().set_index("row")

    def statuses(self) -> dict[str, int]:
        """How many rows there are of each status."""
        counts = self.table(["status"])["status"].value_counts().to_pylist()
        return {one["values"]: one["counts"] for one in counts}


def sweep(
    file: str | Path | None = None,
    *,
    out: str | Path | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
    **keys: Any,
) -> Sweep:
    """Runs all rows of a plan that are not in the folder yet.

    Args:
        file: sweep.toml; or its keys by name: boebot.sweep(out="mine", brains=["demo"], seconds=5, seeds=[1]).
        out: the sweep's folder. None: beside where you are, called as the file.
        scheduler: of Dask, as "tcp://HOST:PORT". None: workers of this computer.
        workers: how many of this computer. None: one for each processor.
        progress: is called with the number of rows that are done.

    Raises:
        BoebotError: in one sentence, before the first run where the plan or the cluster is wrong. What is done stays.
        KeyboardInterrupt: Ctrl-C; what is done stays, and the same call goes on.
    """
    check_call("a sweep", file, keys, out)
    asked = plan.made(keys) if file is None else plan.read(Path(file))
    path = Path(out if out is not None else Path(str(file)).stem)
    return run_plan(asked, path, scheduler, workers, progress)


def run_plan(
    asked: plan.Plan,
    path: Path,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Sweep:
    """The same of a plan, into the folder `path`."""
    with kept.locked(path, asked) as folder:
        with engine.Workers(scheduler, workers, folder.path / engine.LOG) as ours:
            ours.run(folder, progress or (lambda _: None))
        folder.merge()
    return Sweep(path)


def check_call(what: str, file: object, keys: object, out: object) -> None:
    """Raises CallError where they do not go together."""
    if (file is None) == (not keys):
        raise CallError(f"{what} is a file or keys by name; expected one of them")
    if file is None and out is None:
        raise CallError(f"{what} by keys has no name; expected out, its folder")


def kept_request(path: Path, row: int) -> Request:
    """The run of a row, as the folder keeps it: for `boebot run --sweep`."""
    folder = kept.Folder(path)
    folder.check()
    if not 0 <= row < folder.plan.count:
        raise CallError(f"the sweep has no row {row}; expected 0 to {folder.plan.count - 1}")
    return request_of(folder, folder.plan.case(row, folder.points))
