"""Settings for all tests: how many random cases; the same ones each time unless `make fuzz` asks for new. What each
folder's tests took is printed at the end. What follows from the protocol is made before the first test is read."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import settings

GENERATOR = Path(__file__).parent / "protocol" / "generate.py"
MADE = "PYTEST_XDIST_WORKER" in os.environ  # by the process that has started this one
if not MADE and GENERATOR.is_file() and subprocess.run([sys.executable, GENERATOR], check=False).returncode:
    sys.exit(1)  # it has said why

EXAMPLES = os.environ.get("BOEBOT_EXAMPLES")
SANITIZED = "BOEBOT_SANITIZED" in os.environ

# Sanitizers make each example some five times as slow; what they look for shows in a few. `make fuzz` tries thousands.
settings.register_profile("same every time", max_examples=8 if SANITIZED else 30, deadline=None, derandomize=True)
settings.register_profile("fuzz", max_examples=int(EXAMPLES or 100), deadline=None, print_blob=True)
settings.load_profile("fuzz" if EXAMPLES else "same every time")

# What sketches are built to: not the user's own.
os.environ.setdefault("BOEBOT_CACHE", str(Path(__file__).resolve().parent / "build" / "cache"))

# A shell without job control lets its background processes ignore Ctrl-C, and their children: tests need to be heard.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

_seconds: Counter[str] = Counter()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """A command that runs in this process leaves its handlers of signals, as its process would end with it."""
    from boebot.running import interrupts

    before = {number: signal.getsignal(number) for number in interrupts.SIGNALS}
    try:
        return (yield)
    finally:
        interrupts.first = None
        for number, handler in before.items():
            signal.signal(number, handler)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Adds up what a test, its set-up and its tear-down took."""
    folder, below, _ = report.nodeid.partition("/")
    _seconds[folder if below else "this folder"] += report.duration  # type: ignore[assignment]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """A line for each folder."""
    for folder, seconds in _seconds.most_common():
        terminalreporter.write_line(f"time of {folder}: {seconds:.1f} s")
