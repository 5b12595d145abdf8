"""How long a newcomer waits: `make run` in a fresh clone, where the system's packages are installed."""

from __future__ import annotations

import subprocess
import tempfile
import time
from functools import cache
from pathlib import Path

from tools.tests.bench.figures import figure

PROJECT = Path(__file__).resolve().parents[3]


LONGEST = 240.0  # s; what takes longer has failed


def seconds_of(command: list[str], folder: str) -> float:
    started = time.perf_counter()
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL, timeout=LONGEST)
    return time.perf_counter() - started


@cache
def make_run() -> tuple[float, float]:
    """Seconds of the first and the second `make run`."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        subprocess.run(["git", "clone", "--quiet", str(PROJECT), folder], check=True)
        return seconds_of(["make", "run"], folder), seconds_of(["make", "run"], folder)


@figure("make run, the first time in a fresh clone", "s")
def first() -> float:
    return make_run()[0]


@figure("make run, after that", "s")
def second() -> float:
    return make_run()[1]
