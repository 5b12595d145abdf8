"""What the record of a run costs: time while it goes on, and memory."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from boebot.running.tasks import Request
from tools.tests import resident
from tools.tests.bench.figures import figure, ran

SECONDS = 300.0


def wall_s(record: bool) -> float:
    """Of a run with a brain at every tick."""
    request = Request.single("wander", arena="room", on="native", seconds=SECONDS, period=0.01, record=record)
    return ran(request).wall_time or 0.0


@figure(
    "record: native board, wander at every 10 ms tick, with it against record=False", "×", at_least=0.8, rounds=5,
    of="median",
)  # fmt: skip
def speed_with_a_record() -> float:
    return wall_s(record=False) / wall_s(record=True)


def peak_mb(seconds: float) -> float:
    """Resident memory that a run with all its files takes at most."""
    with tempfile.TemporaryDirectory() as folder:
        run = ("run", "wander", "--robot", "arsim", "--arena", "arsim", "--seconds", f"{seconds}", "--out")
        command = [sys.executable, "-m", "boebot", *run, str(Path(folder) / "run")]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, text=True) as process:
            most = resident.peak(process)
        if process.returncode:
            raise RuntimeError(f"the run of {seconds:g} s ended with exit code {process.returncode}")
        return most


@figure("record: memory of a run of an hour with its files, beyond that of a minute", "MB", at_most=100)
def growth_of_memory() -> float:
    return peak_mb(3600.0) - peak_mb(60.0)
