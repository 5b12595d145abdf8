"""Ctrl-C and its like: heard while a brain runs, whatever the brain does, and ignored while a record is being written.

A brain that lets KeyboardInterrupt through ends at once. One that catches it is ended by what watches its step
(boebot.running.stepping). Where Python itself gets no turn any more, because a library that the brain calls keeps it, a
thread without Python ends the process (last_resort.h); the board's dead-man has stopped the motors by then.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Iterator
from types import FrameType
from typing import Any, NoReturn

SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]  # what asks a program to end; not every system has all of them

ONE_PRESS_S = 0.5  # signals that follow one another faster than this are one wish
LIMIT_S = 3.0  # from the first wish to the process's end, if Python does nothing about it
AGAIN_S = 0.5  # from the second one
_HOLD, _WAIT, _END, _HEED = (
    b"\x00",
    b"\xfd",
    b"\xfe",
    b"\xff",
)  # words to the last resort; no signal's numbers
_SENTENCE = "boebot: interrupted; the brain gave Python no turn, so what is written at the end of a run is missing"


class Wishes:
    """That the program ends, by a person or another program.

    Attributes:
        count: how many there were.
        first: number of the first one's signal; None: there was none.
        noted_s: when the last of them came, `time.monotonic()`.
        signal_s: when the last signal came, which may belong to a wish before.
    """

    def __init__(self) -> None:
        self.count = 0
        self.first: int | None = None
        self.noted_s = self.signal_s = float("-inf")

    def note(self, number: int, now_s: float) -> None:
        """One more."""
        self.count += 1
        self.first = self.first or number
        self.noted_s = now_s


wishes = Wishes()
_channel: int | None = None  # where the last resort listens
_listens: int | None = None  # the other end; once nothing more can come there, the run has ended


def interrupt(number: int, frame: FrameType | None) -> None:
    """A signal's handler.

    Raises:
        KeyboardInterrupt: unless it belongs to the wish before.
    """
    before, wishes.signal_s = wishes.signal_s, time.monotonic()
    if wishes.signal_s - before > ONE_PRESS_S:
        wishes.note(number, wishes.signal_s)
        raise KeyboardInterrupt


def exit_code() -> int:
    """Of a program that was asked to end: 128 and the signal's number, as shells have it; 130 after Ctrl-C."""
    return 128 + (wishes.first or unheard() or signal.SIGINT)


def leave(code: int) -> NoReturn:
    """Ends the process at once, with what was printed, whatever its other threads do."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
    os._exit(code)


def unheard() -> int:
    """The signal of a wish of which Python's handler, which needs the main thread, has not heard; 0: there is none."""
    if _channel is None or wishes.first is not None:
        return 0
    from boebot.running._last_resort import lib

    return int(lib.last_resort_signal())


def wait_for_another() -> None:
    """What is left to do may take its time; one more wish ends the process at once."""
    _say(_WAIT)


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
        _say(_HOLD)
        yield
    finally:
        _say(_HEED)
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


@contextlib.contextmanager
def heard() -> Iterator[None]:
    """While a brain is loaded and runs: a signal that asks to end and raises KeyboardInterrupt is a wish that is noted,
    and the last resort watches. Outside the main thread, and within another such block, it does nothing."""
    handlers = {} if _channel is not None else _raising()
    wishes.first = None if handlers else wishes.first
    try:
        for number in handlers:
            signal.signal(number, interrupt)
        with _last_resort(list(handlers)) if handlers else contextlib.nullcontext():
            yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _raising() -> dict[int, Any]:
    """The signals that raise KeyboardInterrupt now, with their handlers; others are the program's own affair."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    return {number: one for number, one in handlers.items() if one in (signal.default_int_handler, interrupt)}


def _say(word: bytes) -> None:
    if _channel is not None:
        os.write(_channel, word)


@contextlib.contextmanager
def _last_resort(numbers: list[int]) -> Iterator[None]:
    """Has a thread of C read from a pipe, into which Python writes each signal's number even if none of its lines can
    run."""
    global _channel, _listens
    try:
        from boebot.running._last_resort import ffi, lib
    except ImportError:  # as on Windows
        yield
        return
    listens, speaks = os.pipe()
    os.set_blocking(speaks, False)
    before = signal.set_wakeup_fd(speaks, warn_on_full_buffer=False)
    if before != -1:  # somebody else, such as asyncio, needs it
        signal.set_wakeup_fd(before)
        os.close(listens)
        os.close(speaks)
        yield
        return
    mask = sum(1 << number for number in numbers)
    sentence = ffi.new("char[]", (_SENTENCE + "\n").encode())
    times = LIMIT_S, AGAIN_S, ONE_PRESS_S
    watcher = threading.Thread(
        target=lambda: lib.last_resort_watch(listens, mask, *times, sentence), name="last resort", daemon=True
    )
    watcher.start()
    _channel, _listens = speaks, listens
    try:
        yield
    finally:
        _say(_END)
        _channel = _listens = None
        signal.set_wakeup_fd(-1)
        watcher.join()
        os.close(listens)
        os.close(speaks)


def _in_child() -> None:
    """A process that a brain forks has no such thread, its signals are not its parent's, and it ends with the run."""
    global _channel
    if _listens is not None:
        threading.Thread(target=_end_with_run, args=(_listens,), daemon=True).start()
    if _channel is not None:
        os.close(_channel)
        _channel = None
        with contextlib.suppress(ValueError):
            signal.set_wakeup_fd(-1)
            for number in _raising():
                signal.signal(number, signal.SIG_DFL)


def _end_with_run(listens: int) -> None:
    run = select.poll()
    run.register(listens, 0)  # nothing is read there: only the end is waited for
    run.poll()
    os._exit(0)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_in_child)
