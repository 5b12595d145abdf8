"""What a worker does: the rows of a part, one by one, and the part's file. How a row that kills its worker is found.

Before a row is run, a line is added to the part's file of markers, which goes when the part is there. Markers of
another worker say that it has died: all rows but the last one begun are then run in parts of their own, and the suspect
last, alone. Where two workers have died by a row, the row says so, and is not run again. So whatever Dask does with a
task whose worker has died, each row is there once.
"""

from __future__ import annotations

import contextlib
import os
import uuid
from functools import lru_cache
from pathlib import Path
from typing import Any

from boebot_campaign.kept import Folder, opened, write_part, writing
from boebot_campaign.rows import columns, hangs_ended, killed, run_case, table_of


def _me() -> str:
    """A name of this process. One that is forked has another."""
    return _name(os.getpid())


@lru_cache(maxsize=1)
def _name(_process: int) -> str:
    return uuid.uuid4().hex


def do_part(path: str, stamp: str, first: int, end: int) -> None:
    """Sees to it that the rows from `first` to before `end` are in parts."""
    _do(opened(Path(path), stamp), first, end)


def _do(folder: Folder, first: int, end: int) -> None:
    part = folder.part(first, end)
    if part.is_file():  # Dask repeats tasks whose worker has gone after they were done
        return
    markers = part.with_suffix(".begun")
    lines = _others(markers)
    try:
        if not lines or (end - first == 1 and len({who for _, who in lines}) == 1):
            write_part(part, table_of(_rows(folder, first, end, markers), _columns(folder)))
        elif end - first == 1:
            case = folder.plan.case(first, folder.points)
            write_part(part, table_of([killed(case)], _columns(folder)))
        else:
            suspect, who = lines[-1]
            alone = folder.part(suspect, suspect + 1)
            if not alone.is_file():
                _mark(alone.with_suffix(".begun"), suspect, who)
            for low, high in ((first, suspect), (suspect + 1, end), (suspect, suspect + 1)):
                if folder.undone(low, high):
                    _do(folder, low, high)
    finally:  # also after an error, such as of a full disk: this process has not died
        markers.unlink(missing_ok=True)


def _rows(folder: Folder, first: int, end: int, markers: Path) -> list[dict[str, Any]]:
    rows = []
    with hangs_ended(folder.plan.limit_s) as begin:
        for row in range(first, end):
            _mark(markers, row, _me())
            begin()
            rows.append(run_case(folder, folder.plan.case(row, folder.points)))
    return rows


def _mark(markers: Path, row: int, who: str) -> None:
    with writing(markers.parent), markers.open("a") as file:
        file.write(f"{row} {who}\n")


def _others(markers: Path) -> list[tuple[int, str]]:
    """Row and process of each whole line of another process, in order."""
    with contextlib.suppress(FileNotFoundError):  # also where another worker has just removed it
        parts = map(str.split, markers.read_text().splitlines())
        return [(int(part[0]), part[1]) for part in parts if len(part) == 2 and part[1] != _me()]
    return []


@lru_cache(maxsize=2)
def _columns(folder: Folder) -> dict[str, type]:
    return columns(folder.plan, [folder.place(name) or name for name in folder.plan.brains])
