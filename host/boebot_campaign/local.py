"""Dask's workers on this computer, in a process apart: `python -m boebot_campaign.local WORKERS` prints the scheduler's
address. It ends, with its workers, when its standard input closes: when the sweep ends or is killed. Workers that begin
here do not import the user's script, which so needs no `if __name__ == "__main__"`."""

from __future__ import annotations

import multiprocessing
import os
import sys
from multiprocessing import forkserver
from typing import Any

FORKS = sys.platform == "linux"  # elsewhere what numpy calls may not outlive a fork
IMPORTED = ["distributed", "pyarrow.parquet", "pandas", "sim_bridge.sim", "boebot_campaign.tasks"]
"""Once for all workers, also those that begin after a death. pyarrow imports pandas, where it is, for the first row."""

QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.scheduler.allowed-failures": 0,  # boebot_campaign.tasks finds out which row it was
    "distributed.scheduler.worker-saturation": 2.0,  # tasks at a worker: one that runs, one that waits
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.worker.multiprocessing-method": "forkserver" if FORKS else "spawn",
    "distributed.deploy.lost-worker-timeout": "3650 days",  # 15 s after a death it closes a worker that just restarts
}
"""What Dask does beside the work costs a tenth of it by default."""


def main(workers: int) -> None:
    """Serves until standard input closes."""
    answer = os.fdopen(os.dup(1), "w")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # brains print there, and who began this process reads one line only
    if FORKS:
        multiprocessing.set_forkserver_preload(IMPORTED)
        forkserver.ensure_running()  # while this process imports, too
        sys.modules["pandas"] = None  # type: ignore[assignment]  # Dask would import it here, for nothing
    import dask
    from distributed import LocalCluster

    dask.config.set(QUIET)
    made: Any = LocalCluster
    with made(
        n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        print(cluster.scheduler_address, file=answer, flush=True)
        sys.stdin.buffer.read()


if __name__ == "__main__":
    main(int(sys.argv[1]))
