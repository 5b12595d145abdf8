"""Ctrl-C and its like: the first asks a run to end, the second ends the program at once.

The first raises KeyboardInterrupt: the motors are stopped, the record is written. A brain may catch it, or wait in a
library where it does not arrive; then a second one, half a second later or more, ends the process. The board's dead-man
stops the motors, and the record is cut there: it is mended when it is read (docs/decisions/0015-ctrl-c.md).
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from types import FrameType
from typing import NoReturn

SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]  # what asks a program to end; not every system has all of them
AGAIN_S = 0.5  # signals that follow the first one sooner are the same press of a key
_SENTENCE = b"boebot: interrupted again, so the program has ended at once; what is recorded by then is kept\n"
_LOOK_S = 0.5  # between two looks at whether the parent of a brain's process is there

first: int | None = None  # number of the signal that has asked to end; None: there was none
_first_s = 0.0
_held = 0  # blocks in which the first one is noted only
_runs = 0  # that go on in this process; several may take turns in threads, and end in any order
_process = 0  # of the latest one


def interrupt(number: int, frame: FrameType | None) -> None:
    """A signal's handler.

    Raises:
        KeyboardInterrupt: it is the first one.
    """
    global first, _first_s
    if first is None:
        first, _first_s = number, time.perf_counter()
        if not _held:
            raise KeyboardInterrupt
    elif time.perf_counter() - _first_s >= AGAIN_S:
        os.write(2, _SENTENCE)
        os._exit(exit_code())


def exit_code() -> int:
    """Of a program that was asked to end: 128 and the signal's number, as shells have it; 130 after Ctrl-C."""
    return 128 + (first or signal.SIGINT)


def leave(code: int) -> NoReturn:
    """Ends the process at once, with what was printed, whatever its other threads do."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
    os._exit(code)


@contextlib.contextmanager
def held() -> Iterator[None]:
    """A first signal is noted, and raises nothing: what ends anyway is not to be torn."""
    global _held
    _held += 1
    try:
        yield
    finally:
        _held -= 1


@contextlib.contextmanager
def uncut() -> Iterator[None]:
    """The same, and once the block is over it raises KeyboardInterrupt for it: what is on its way is not lost."""
    with held():
        yield
    if first is not None:
        raise KeyboardInterrupt


@contextlib.contextmanager
def heard() -> Iterator[None]:
    """While a run goes on, signals that would raise KeyboardInterrupt are handled as above; others are the program's
    own affair. Outside the main thread, which alone hears of them, they stay as they are."""
    global first, _runs, _process
    is_main = threading.current_thread() is threading.main_thread()
    mine = [one for one in SIGNALS if is_main and signal.getsignal(one) is signal.default_int_handler]
    _runs, _process = _runs + 1, os.getpid()
    try:
        for number in mine:
            signal.signal(number, interrupt)
        yield
    finally:
        _runs, first = _runs - 1, None if mine else first
        for number in mine:
            signal.signal(number, signal.default_int_handler)


def _in_child() -> None:
    """A process that a brain forks ends once the run's process has."""
    if _runs:
        threading.Thread(target=_end_with, args=(_process,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_S)
    os._exit(0)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_in_child)
