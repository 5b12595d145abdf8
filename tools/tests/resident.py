"""Resident memory of another process, as Linux counts it."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from pathlib import Path

LOOKS_EACH_S = 0.02


def megabytes(process: int, key: str = "VmRSS") -> float | None:
    """Of that process now; `key` "VmHWM": the most so far. None: it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text(encoding="utf-8")
    except (FileNotFoundError, ProcessLookupError):
        return None
    _, found, value = status.partition(f"{key}:")
    return int(value.split()[0]) / 1024 if found else None


def peak(process: subprocess.Popen[str], look: Callable[[float], None] = lambda _: None) -> float:
    """Waits for its end; the most that it took (MB). Unlike `resource.getrusage` it leaves out what the parent took
    when it started it. `look` is called now and then, with what it takes at that time."""
    most = 0.0
    while process.poll() is None:
        most = megabytes(process.pid, "VmHWM") or most
        look(megabytes(process.pid) or most)
        time.sleep(LOOKS_EACH_S)
    return most
