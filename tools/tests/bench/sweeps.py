"""What a sweep costs beside its runs: against plain loops, in one process and in two, and joblib; and its memory.

What is written to disk, rows and markers of what was begun, is part of it; a plain loop keeps its rows in a list.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from boebot.running.tasks import Request
from tools.tests.bench.figures import Peer, figure, ran

RUNS = int(os.environ.get("BOEBOT_BENCH_RUNS", "10000"))
BEFORE = 100  # runs, before the overhead of one is looked at
BLOCK, BLOCKS = 20, 25  # runs in turns
PLAN: dict[str, Any] = {"brains": ["wander"], "robots": ["shieldbot"], "arenas": ["room"], "seconds": 1.0}


def row(seed: int) -> dict[str, Any]:
    """A run as a plain loop makes it."""
    request = Request.single("wander", "shieldbot", arena="room", on="native", seconds=1.0, seed=seed)
    return ran(request).robots[0].table()


def plain(first: int, end: int) -> None:
    """A plain loop."""
    rows = [row(seed) for seed in range(first, end)]
    assert len({one["hash"] for one in rows}) > 0.9 * len(rows)


def python(code: str) -> subprocess.Popen[bytes]:
    """A process with what is in this file."""
    return subprocess.Popen([sys.executable, "-c", f"from tools.tests.bench.sweeps import *; {code}"])


def took_s(*codes: str) -> float:
    """Of processes that begin together, until the last has ended."""
    started = time.perf_counter()
    for process in [python(code) for code in codes]:
        if process.wait() != 0:
            raise RuntimeError("a process of the bench has failed")
    return time.perf_counter() - started


@lru_cache(maxsize=1)
def rates() -> dict[str, float]:
    """Runs/s of the sweep, before and after it of two plain processes, and of joblib. A machine's speed may change
    within these minutes."""
    half = RUNS // 2
    two = f"plain(1, {half + 1})", f"plain({half + 1}, {RUNS + 1})"
    before_s, sweep_s = took_s(*two), took_s(f"swept(seeds={{'from': 1, 'to': {RUNS}}}, workers=2)")
    mean_s = (before_s + took_s(*two)) / 2
    times_s = {"sweep": sweep_s, "plain": mean_s, "joblib": took_s("joblib_rows()")}
    return {name: RUNS / seconds for name, seconds in times_s.items()}


def joblib_rows() -> None:
    """Two of joblib's workers, with its own idea of how many runs go into a batch."""
    from joblib import Parallel, delayed

    assert len(Parallel(n_jobs=2)(delayed(row)(seed) for seed in range(1, RUNS + 1))) == RUNS


def swept(**keys: Any) -> None:
    """A sweep in a folder that goes."""
    import boebot

    with tempfile.TemporaryDirectory() as folder:
        done = boebot.sweep(out=Path(folder) / "out", **PLAN | keys)
        assert set(done.statuses()) == {"ok"}


@figure(
    f"sweep: {RUNS:,} native runs of 1 s with two workers, all from the command's begin to its end",
    "runs/s",
    times_at_least=0.93,
    peers=[
        Peer("two plain processes, before and after", lambda: rates()["plain"]),
        Peer("joblib", lambda: rates()["joblib"]),
    ],
)
def two_workers() -> float:
    return rates()["sweep"]


@figure("sweep: processor time of a row at a worker, against a run in a plain loop", "×", at_most=1.05)
def overhead() -> float:
    """Blocks of both in turns, in this process."""
    from boebot_campaign import kept, plan, tasks

    with tempfile.TemporaryDirectory() as name:
        asked = plan.made(PLAN | {"seeds": {"from": 1, "to": BEFORE + BLOCK * BLOCKS}}, plan.Plan, "sweep")
        with kept.locked(Path(name) / "out", asked) as folder:

            def part(first: int, end: int) -> None:
                tasks.do_part(str(folder.path), folder.stamp, first, end)

            def took(work: Callable[[int, int], None], block: int) -> float:
                started = time.process_time()
                work(BEFORE + BLOCK * block, BEFORE + BLOCK * (block + 1))
                return time.process_time() - started

            part(0, BEFORE)
            plain(1, BEFORE)
            both = [(took(part, block), took(plain, block)) for block in range(BLOCKS)]
    return sum(ours for ours, _ in both) / sum(theirs for _, theirs in both)


# ---- memory ----------------------------------------------------------------------------------------------------------


def empty_cluster() -> None:
    """Prints the address of a scheduler whose worker makes rows without runs; serves until standard input closes."""
    from distributed import LocalCluster

    from boebot_campaign import rows, tasks

    def empty(_: object, case: Any) -> dict[str, Any]:
        return rows.begun(case) | {
            "status": rows.OK,
            "hash": f"{case.row:032x}",
            "true_distance_m": 1.0 / (case.row + 1),
        }

    setattr(tasks, "run_case", empty)  # noqa: B010
    made: Any = LocalCluster
    with made(n_workers=1, threads_per_worker=1, processes=False, host="127.0.0.1", dashboard_address=None,
              protocol="tcp://") as cluster:  # fmt: skip
        print(cluster.scheduler_address, flush=True)
        sys.stdin.buffer.read()


def peak_mb(rows: int) -> float:
    """Of the process that sweeps, and merges the parts."""
    code = "from tools.tests.bench.sweeps import *; empty_cluster()"
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as cluster:
        assert cluster.stdin is not None and cluster.stdout is not None
        address = cluster.stdout.readline().decode().strip()
        client = python(f"swept(seeds={{'from': 1, 'to': {rows}}}, scheduler={address!r})")
        _, status, used = os.wait4(client.pid, 0)
        cluster.stdin.close()
    if status != 0:
        raise RuntimeError("the sweep of the bench has failed")
    return used.ru_maxrss / 1024


@figure("sweep: memory of the sweep's process, 1,000,000 rows without runs against 100,000", "×", at_most=1.1)
def memory() -> float:
    return peak_mb(1_000_000) / peak_mb(100_000)
