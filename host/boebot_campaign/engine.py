"""Spreads a sweep's rows over Dask's workers: those of this computer, or of any scheduler.

Tasks of about a second write parts and return nothing; what is done is in the folder. A few tasks for each worker wait
at a time, so that memory does not grow with the sweep. A task whose worker has died, or whose scheduler has gone, is
submitted again.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import os
import re
import subprocess
import sys
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

from boebot import missing
from boebot.errors import BoebotError, CallError
from boebot.system import NEW_GROUP, end_group
from boebot_campaign.kept import Folder, version
from boebot_campaign.tasks import do_part

PART_S = 1.0  # that a task should take
MOST_ROWS = 10_000  # of a task
AHEAD = 3  # tasks a worker that are submitted
POLL_S = 0.05
LOOK_S = 1.0  # from look to look at how many workers there are
BACK_S = 60.0  # wait for a scheduler that has gone
DEATHS = 5  # more of a task than its rows can account for
LOG = ".workers.log"
LOST = "the scheduler has gone; the same command goes on where it was"

_GONE = (OSError, TimeoutError, asyncio.CancelledError, concurrent.futures.CancelledError)
Told = Callable[[int], object]
"""Is called with how many rows are done."""


class Workers(contextlib.ExitStack):
    """Those of this computer, or of a scheduler. They begin with the first rows, and stay until the block ends."""

    def __init__(self, scheduler: str | None, count: int | None, log: Path) -> None:
        """`count`: of this computer, or one for each processor; `log`: file of what they print. Raises CallError."""
        super().__init__()
        if count is not None and (scheduler is not None or not isinstance(count, int) or count < 1):
            raise CallError(f"workers is {count!r}; expected a whole number from 1 on, and none with a scheduler")
        self.is_local, self.log = scheduler is None, log
        self._address, self._count = scheduler or "", count or os.cpu_count() or 1
        self._client: Any = None

    def run(self, folder: Folder, told: Told) -> None:
        """Runs all rows of a sweep that are not done.

        Raises:
            BoebotError: in one sentence; what is done stays, and the next sweep goes on there.
        """
        if not folder.undone():
            return
        if self._client is None:
            if self.is_local:
                self._address = self.enter_context(_local(self.log, self._count))
            try:
                _check(self.client(), folder, _distributed())
            except _GONE as error:
                raise BoebotError(f"{LOST} ({error})") from None
        _Work(self, folder, told).all()

    def client(self) -> Any:
        """Of the scheduler; another one when the last has closed, as it does 10 s after its scheduler has gone.

        Raises:
            CallError: there is no scheduler.
        """
        if self._client is None or self._client.status == "closed":
            self._client = self.enter_context(_client(_distributed(), self._address))
        return self._client


class _Work:
    """The rows on their way."""

    def __init__(self, ours: Workers, folder: Folder, told: Told) -> None:
        self._ours, self._folder, self._told = ours, folder, told
        self._gaps = deque(folder.undone())
        self._done = folder.plan.count - sum(end - first for first, end in self._gaps)
        self._workers, self._looks_s, self._seen_s = 1, 0.0, time.perf_counter()
        self._lately_rows, self._lately_s, self._settled_s = 0.0, 0.0, self._seen_s  # done, and workers' time for it
        self._pending: dict[Any, tuple[int, int]] = {}
        self._deaths: dict[tuple[int, int], int] = {}

    def all(self) -> None:
        self._told(self._done)
        while self._gaps or self._pending:
            self._look()
            self._submit()
            for future in [one for one in self._pending if one.status != "pending"]:
                self._settle(future, *self._pending.pop(future))
            time.sleep(POLL_S)

    def _look(self) -> None:
        """At the workers, now and then. Raises BoebotError where those of this computer have gone and none comes."""
        now = time.perf_counter()
        if now < self._looks_s:
            return
        self._looks_s = now + LOOK_S
        try:
            self._workers = len(self._ours.client().nthreads())
        except _GONE:
            self._wait_for_scheduler()
        self._seen_s = now if self._workers else self._seen_s
        if self._ours.is_local and now - self._seen_s > BACK_S:
            raise BoebotError(f"the workers of this computer have ended; {self._ours.log} may say why")

    def _submit(self) -> None:
        most = AHEAD * max(self._workers, 1)
        while self._gaps and len(self._pending) < most:
            first, end = self._gaps.popleft()
            rows = int(min(max(PART_S * self._lately_rows / max(self._lately_s, 1e-6), 1), MOST_ROWS))
            middle = min(end, first + min(rows, max((end - first) // 8, rows // 8, 1)))  # all workers end together
            if middle < end:
                self._gaps.appendleft((middle, end))
            self._send(first, middle)

    def _send(self, first: int, end: int) -> None:
        work = do_part, str(self._folder.path), self._folder.stamp, first, end
        future = self._ours.client().submit(*work, key=f"boebot-{first}-{end}-{uuid.uuid4().hex}", pure=False)
        self._pending[future] = first, end

    def _settle(self, future: Any, first: int, end: int) -> None:
        if future.status == "finished":
            now = time.perf_counter()
            self._lately_rows = 0.8 * self._lately_rows + end - first
            self._lately_s = 0.8 * self._lately_s + self._workers * (now - self._settled_s)
            self._settled_s = now
            self._done += end - first
            self._deaths.clear()
            self._told(self._done)
            return
        error: BaseException | None = None
        with contextlib.suppress(*_GONE):
            error = future.exception(timeout=BACK_S) if future.status == "error" else None
        if isinstance(error, BoebotError):
            raise error
        if error is not None and type(error).__name__ != "KilledWorker":
            raise BoebotError(f"a worker of the sweep has failed: {type(error).__name__}: {error}")
        deaths = self._deaths[first, end] = self._deaths.get((first, end), 0) + 1
        if deaths > DEATHS + 2 * (end - first):
            raise BoebotError(f"workers die before they begin; {self._ours.log} may say why")
        if error is None:
            self._wait_for_scheduler()
        self._send(first, end)

    def _wait_for_scheduler(self) -> None:
        """After its end; of this computer there is no other."""
        until = time.perf_counter() + (0.0 if self._ours.is_local else BACK_S)
        while True:
            with contextlib.suppress(*_GONE, CallError):
                if (client := self._ours.client()).status == "running":
                    client.wait_for_workers(1, timeout=1.0)
                    return
            if time.perf_counter() > until:
                raise BoebotError(LOST)
            time.sleep(POLL_S)


def _distributed() -> Any:
    missing.imported("pyarrow", "a sweep", "pyarrow", "sweep")
    return missing.imported("distributed", "a sweep", "dask.distributed", "sweep")


@contextlib.contextmanager
def _local(log: Path, workers: int) -> Iterator[str]:
    """The address of a cluster of this computer, in a process that ends with the block, or with this process."""
    command = [sys.executable, "-m", "boebot_campaign.local", str(workers)]
    with log.open("wb") as file:
        helper = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=file, **NEW_GROUP)
    assert helper.stdin is not None and helper.stdout is not None
    try:
        _distributed()  # while that begins
        if not (address := helper.stdout.readline().decode().strip()):
            raise BoebotError(f"the workers of this computer do not begin; {log} says why")
        yield address
    finally:
        helper.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            helper.wait(10.0)
        with contextlib.suppress(ProcessLookupError):
            end_group(helper, by_force=True)
        helper.wait()


@contextlib.contextmanager
def _client(distributed: Any, address: str) -> Iterator[Any]:
    if not re.fullmatch(r"(tcp|tls|ucx|wss?)://.+:\d+", address):
        raise CallError(f"there is no scheduler at {address!r}; expected one as tcp://HOST:PORT")
    try:
        client = distributed.Client(address, timeout=10.0, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise CallError(f"there is no scheduler at {address}: {error}; expected one as tcp://HOST:PORT") from None
    logger = logging.getLogger("distributed.client")
    logger.disabled = True  # that the scheduler has gone is said here, in one sentence
    try:
        yield client
    finally:
        with contextlib.suppress(Exception):  # it may have gone, and then all is said
            client.close(timeout=2.0)
        logger.disabled = False


def seen(probe: str) -> tuple[bool, str]:
    """At a worker: whether it sees that file, and its versions."""
    return Path(probe).is_file(), versions()


def versions() -> str:
    """What has to be the same everywhere."""
    python = ".".join(map(str, sys.version_info[:2]))
    packages = ", ".join(f"{name} {metadata.version(name)}" for name in ("distributed", "pyarrow"))
    return f"boebot {version()}, Python {python}, {packages}"


def _check(client: Any, folder: Folder, distributed: Any) -> None:
    """Raises BoebotError, before the first run, where scheduler or workers do not fit."""
    theirs = client.get_versions(check=False)["scheduler"]["packages"]["distributed"]
    if theirs != distributed.__version__:
        raise BoebotError(f"the scheduler has distributed {theirs}; expected {distributed.__version__}, as here")
    with contextlib.suppress(TimeoutError):
        client.wait_for_workers(1, timeout=30.0)
    probe = folder.path / f".probe-{uuid.uuid4().hex}"
    probe.touch()
    try:
        answers = client.run(seen, str(probe), on_error="return")
    finally:
        probe.unlink()
    if not answers:
        raise BoebotError("the scheduler has no workers; expected at least one")
    for worker, answer in answers.items():
        if isinstance(answer, BaseException):
            raise BoebotError(f"worker {worker} cannot run boebot: {answer}; expected {versions()}, as here")
        is_there, has = answer
        if has != versions():
            raise BoebotError(f"worker {worker} has {has}; expected {versions()}, as here")
        if not is_there:
            raise BoebotError(f"worker {worker} does not see {folder.path}; expected a folder that all workers share")
