"""`boebot serve` in another process."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def serving(*words: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The URL of an emulated robot that is served with those options, and the process."""
    command = [sys.executable, "-m", "boebot", "serve", *words, "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        announced = ""
        for line in server.stdout:
            announced += line
            if line == "}\n":
                break
        try:
            yield json.loads(announced)["url"], server
        finally:
            server.send_signal(signal.SIGINT)
            assert server.wait(timeout=20) in (0, 130, -signal.SIGKILL)
