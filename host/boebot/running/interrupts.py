"""Ctrl-C and its like while a robot is being stopped and a record is being written: they have to wait."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator

SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]  # what asks a program to end; not every system has all of them


@contextlib.contextmanager
def ignored() -> Iterator[None]:
    """Ignores those signals for as long as the block lasts. Outside the main thread, which alone hears of them, it
    does nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
