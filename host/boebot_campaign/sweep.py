"""`boebot.sweep(...)`: all runs of a plan, and what came of them. How a campaign of any kind is called from Python."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import numpy as np

from boebot.errors import CallError
from boebot.running.tasks import Request
from boebot_campaign import engine, kept, plan
from boebot_campaign.engine import Told, Workers
from boebot_campaign.kept import Folder
from boebot_campaign.plan import Plan
from boebot_campaign.rows import request_of

_P = TypeVar("_P", bound=Plan)
_T = TypeVar("_T")
Work = Callable[[_P, Path, Workers, Told], _T]
"""Carries out a plan into a folder, with those workers, and says how many of its runs are done."""


def run_plan(asked: Plan, path: Path, workers: Workers, told: Told, points: np.ndarray | None = None) -> Folder:
    """All rows of a plan that are not in the folder yet; `points`: in place of those of its design."""
    with kept.locked(path, asked, points) as folder:
        workers.run(folder, told)
        folder.merge()
    told(asked.count)
    return folder


def carried_out(
    work: Work[_P, _T], asked: _P, path: Path, scheduler: str | None, workers: int | None, told: Told
) -> _T:
    """A campaign, with workers that it begins."""
    with Workers(scheduler, workers, path / engine.LOG) as ours:
        return work(asked, path, ours, told)


def function(name: str, kind: type[_P], work: Work[_P, _T]) -> Callable[..., _T]:
    """A kind of campaign, to be called from Python as `boebot.NAME`."""

    def called(
        file: str | Path | None = None,
        *,
        out: str | Path | None = None,
        scheduler: str | None = None,
        workers: int | None = None,
        progress: Told | None = None,
        **keys: Any,
    ) -> _T:
        """Runs all of a campaign that is not in its folder yet, and gives what came of it.

        Args:
            file: sweep.toml or its like; or its keys by name, as in boebot.sweep(out="mine", brains=["demo"],
                seconds=5, seeds=[1]).
            out: the folder that it makes. None: beside where you are, called as the file.
            scheduler: of Dask, as "tcp://HOST:PORT". None: workers of this computer.
            workers: how many of this computer. None: one for each processor.
            progress: is called with the number of runs that are done.

        Raises:
            BoebotError: in one sentence, before the first run where plan or cluster is wrong. What is done stays.
            KeyboardInterrupt: Ctrl-C; what is done stays, and the same call goes on.
        """
        if (file is None) == (not keys):
            raise CallError(f"{name}() takes a file or keys by name; expected one of them")
        if file is None and out is None:
            raise CallError(f"{name}() by keys has no name; expected out, its folder")
        asked = plan.made(keys, kind, name) if file is None else plan.read(Path(file), kind)
        path = Path(out if out is not None else Path(str(file)).stem)
        return carried_out(work, asked, path, scheduler, workers, progress or (lambda _: None))

    called.__name__ = called.__qualname__ = name
    called.__annotations__["return"] = get_type_hints(work)["return"]
    return called


sweep = function("sweep", Plan, run_plan)


def kept_request(path: Path, row: int) -> Request:
    """The run of a row, as the folder keeps it: for `boebot run --sweep`."""
    folder = Folder(path)
    folder.check()
    if not 0 <= row < folder.plan.count:
        raise CallError(f"the sweep has no row {row}; expected 0 to {folder.plan.count - 1}")
    return request_of(folder, folder.plan.case(row, folder.points))


def no_rows(path: Path, *_: object) -> None:
    """`boebot report` and `boebot run --sweep` of a folder of several sweeps. Raises CallError."""
    sweeps = sorted(str(one.parent) for one in path.glob(f"*/{kept.NAME}"))
    raise CallError(
        f"{path} holds sweeps, and no rows itself; expected one of them: {', '.join(sweeps[-2:]) or 'none'}"
    )
