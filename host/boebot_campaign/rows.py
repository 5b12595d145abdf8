"""One row of a sweep is one run: columns and their types, fixed by the plan, and how a run becomes a row.

A row that is RAISED has its figures up to the error. Whether a run is TIMED_OUT or KILLED depends on the computer: it
has no figures. Rows that are OK or RAISED are the same wherever they ran, but for the columns of APART.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import math
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from boebot import missing
from boebot.brains import explain, load_brain
from boebot.errors import BoebotError
from boebot.record.brain_record import BrainNames
from boebot.record.run import FIGURES, SHARE
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot_campaign.kept import Folder
from boebot_campaign.plan import Case, Plan

OK, RAISED, TIMED_OUT, KILLED = "ok", "raised", "timed out", "killed"
APART = ("status", "error", "wall_time_s", "worker")
GRACE_S, LEAST_GRACE_S = 5.0, 3.0  # after the limit, until a run that cannot be ended takes its process with it
# Of the figures of a run: what the plan says already, what is the same for all rows, and what `status` and `error` say.
_LEFT_OUT = {"without", "imperfections", "parameters", "compiler", "program_hash", "ended"}
_POSE = ("start_x_m", "start_y_m", "start_heading_rad")
_PLANNED = {
    "row": int,
    **dict.fromkeys(("set", "arena", "brain", "robot", "faults"), str),
    "start": int,
    **dict.fromkeys(_POSE, float),
    "seed": int,
}
_one_part = threading.Lock()  # at a time: the process has one timer, and one handler of a signal


class _TimeIsUpError(Exception):
    """The run has lasted longer than its limit. No BoebotError: those are errors of the run."""


def columns(plan: Plan, brains: Sequence[str]) -> dict[str, type]:
    """Name -> type of each column, in order; `brains`: the files or bundled names of those of the plan."""
    loaded = [load_brain(name) for name in brains]
    made_of = [names for one in loaded if (names := BrainNames.of(one.brain)) is not None]
    shares = dict.fromkeys(f"{name}{SHARE}" for names in made_of for name in names.behaviors)
    axes = {f"parameter.{name}": _kind(axis) for name, axis in plan.parameters.items()}
    axes |= {f"imperfection.{name}": float for name in plan.imperfections}
    figures = {name: kind for name, kind in FIGURES.items() if name not in _PLANNED.keys() | axes.keys() | _LEFT_OUT}
    went = {"status": str, "error": str, "wall_time_s": float, "worker": str}
    return {**_PLANNED, **axes, **figures, **dict.fromkeys(shares, float), **went}


def numbers(plan: Plan) -> list[str]:
    """Figures that a run has, and the plan does not say: those that something can be made of."""
    kinds = columns(plan, plan.brains)
    found = [name for name in kinds if kinds[name] in (int, float) and (name in FIGURES or name.endswith(SHARE))]
    return [name for name in found if name not in ("seed", "period_s")]


def _kind(axis: Any) -> type:
    """The type of an axis's values; of mixed ones text."""
    kinds = {type(value) for value in axis} if isinstance(axis, list) else {float}
    return kinds.pop() if len(kinds) == 1 else float if kinds == {int, float} else str


def table_of(rows: list[dict[str, Any]], kinds: Mapping[str, type]) -> Any:
    """As a pyarrow.Table, of the same schema for each part."""
    arrow = missing.imported("pyarrow", "a sweep", "pyarrow", "sweep")
    arrow_of = {int: arrow.int64(), float: arrow.float64(), str: arrow.string(), bool: arrow.bool_()}
    schema = arrow.schema([(name, arrow_of[kind]) for name, kind in kinds.items()])
    fitting = [
        {name: None if row.get(name) is None else kind(row[name]) for name, kind in kinds.items()} for row in rows
    ]
    return arrow.Table.from_pylist(fitting, schema=schema)


def request_of(folder: Folder, case: Case) -> Request:
    """The run of a row, from the files that the folder keeps."""
    brain, robot, arena = (folder.place(name) for name in (case.brain, case.robot, case.arena))
    return folder.plan.request(case._replace(brain=brain or "", robot=robot, arena=arena), folder.stamp)


def begun(case: Case) -> dict[str, Any]:
    """The columns that are known before the run."""
    files, faults = map(_short, (case.arena, case.brain, case.robot)), ", ".join(case.faults) or None
    planned = (case.row, case.set, *files, faults, case.start, *(case.pose or (None, None, None)), case.seed)
    return {
        **dict(zip(_PLANNED, planned, strict=True)),
        **{f"parameter.{name}": value for name, value in case.parameters.items()},
        **{f"imperfection.{name}": value for name, value in case.imperfections.items()},
    }


def _short(name: str | None) -> str | None:
    """A file by its name alone: its folder differs from computer to computer."""
    return name and Path(name).name


def killed(case: Case) -> dict[str, Any]:
    """The row of a run that ended its process twice."""
    return begun(case) | {"status": KILLED, "error": "the run has ended its worker's process, twice"}


@contextlib.contextmanager
def hangs_ended(limit_s: float) -> Iterator[Callable[[], None]]:
    """The rows of a part run in the block, and those of no other part. It gives what is called before each of them,
    so that a run which hangs ends this process; where it hung is printed."""
    after_s, set_s = limit_s + GRACE_S, -math.inf

    def begin() -> None:
        nonlocal set_s
        if (now := time.perf_counter()) - set_s > GRACE_S - LEAST_GRACE_S:  # seldom: each time begins a thread
            faulthandler.dump_traceback_later(after_s, exit=True, file=2)
            set_s = now

    with _one_part:
        try:
            yield begin
        finally:
            faulthandler.cancel_dump_traceback_later()


def run_case(folder: Folder, case: Case) -> dict[str, Any]:
    """Runs a case. Only what the run raises becomes a row, also a KeyboardInterrupt: Ctrl-C reaches the process
    that waits for the workers, and no run of theirs."""
    limit_s, since = folder.plan.limit_s, time.perf_counter()

    def in_time(_: float) -> None:
        if time.perf_counter() - since > limit_s:
            raise _TimeIsUpError

    row, error, result = begun(case), None, None
    try:
        request = request_of(folder, case)
        if (pose := request.members[0].pose) is not None:
            row |= dict(zip(_POSE, pose, strict=True))
        result = execute(request, in_time)
        error = result.error
    except (BoebotError, KeyboardInterrupt, _TimeIsUpError) as raised:
        error = raised
    wall_s = time.perf_counter() - since
    status = OK if error is None else TIMED_OUT if wall_s > limit_s else RAISED
    row |= {"status": status, "wall_time_s": round(wall_s, 3), "worker": f"{socket.gethostname()}:{os.getpid()}"}
    if status == TIMED_OUT:
        row["error"] = f"the run has lasted longer than {limit_s:g} s"
    elif error is not None:
        said = explain(error, None) if isinstance(error, KeyboardInterrupt) else str(error)
        row["error"] = said.replace(f"{folder.path}{os.sep}", "")
    if result is not None and status in (OK, RAISED):
        row |= {name: value for name, value in result.robots[0].table().items() if row.get(name) is None}
    _freeze()
    return row


@lru_cache(maxsize=1)
def _freeze() -> None:
    """Once, after the first run: what it has imported and loaded stays, and need not be looked through again."""
    gc.freeze()
