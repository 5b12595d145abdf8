"""Settings for all tests: how many random cases; the same ones each time unless `make fuzz` asks for new. And what
each folder's tests take, for the table at the end of `make test` (tools/times_table.py). What follows from the
protocol is made before the first test is read."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

GENERATOR = Path(__file__).parent / "protocol" / "generate.py"
if GENERATOR.is_file() and subprocess.run([sys.executable, GENERATOR], check=False).returncode:
    sys.exit(1)  # it has said why

EXAMPLES = os.environ.get("BOEBOT_EXAMPLES")
SANITIZED = "BOEBOT_SANITIZED" in os.environ
TIMES = os.environ.get("BOEBOT_TEST_TIMES")  # file to which a line per folder is added

# Sanitizers make each example some five times as slow; what they look for shows in a few. `make fuzz` tries thousands.
settings.register_profile("same every time", max_examples=8 if SANITIZED else 30, deadline=None, derandomize=True)
settings.register_profile("fuzz", max_examples=int(EXAMPLES or 100), deadline=None, print_blob=True)
settings.load_profile("fuzz" if EXAMPLES else "same every time")

# A shell without job control lets its background processes ignore Ctrl-C, and their children: tests need to be heard.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

_tests: Counter[str] = Counter()
_seconds: Counter[str] = Counter()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Counts a test, and what it, its set-up and its tear-down took."""
    folder = report.nodeid.partition("/")[0] + (", sanitized" if SANITIZED else "")
    _tests[folder] += report.when == "call"
    _seconds[folder] += report.duration  # type: ignore[assignment]


def pytest_sessionfinish() -> None:
    """Adds the folders of this call of pytest to the file, if one is wanted."""
    if TIMES:
        with Path(TIMES).open("a", encoding="utf-8") as file:
            file.writelines(f"{folder}\t{_tests[folder]}\t{_seconds[folder]:.3f}\n" for folder in _seconds)
