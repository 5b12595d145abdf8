"""The command as tests run it: in their own process, or in one that heeds signals."""

from __future__ import annotations

import signal
import sys

import pytest

from boebot import cli
from boebot.running.interrupts import SIGNALS


def boebot(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Runs the command in this process; returns exit code, standard output and standard error."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    sys.argv = ["boebot", *arguments]
    try:
        with pytest.raises(SystemExit) as end:
            cli.main()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    captured = capsys.readouterr()
    return int(end.value.code or 0), captured.out, captured.err


def heed_signals() -> None:
    """A shell may have started this process so that it, and so its children, ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
