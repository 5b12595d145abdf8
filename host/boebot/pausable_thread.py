"""A function that runs a stretch at a time: until it pauses, and on when it is resumed.

The link's conversations (opening, requests, stopping) wait inside their calls, so each robot's driver needs a stack to
wait on while others go on: a thread's. So does a brain that runs from top to bottom (main_brain.py). But two stretches
never run at the same time: who resumes a thread waits until it pauses, so that nothing depends on the machine's
scheduling.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading
import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from types import FrameType
from typing import Final

PAUSED: Final = "paused"
DONE: Final = "done"
_LOOK_S = 0.05  # between two looks at what was raised in a waiting thread that no signal wakes
_ASK_S = 0.1  # between two exceptions thrown into a stretch that is to end
_FOREVER_S = 1e6
_REFUSALS = 100  # pauses after the end that raise; the next one lasts for good


class EndedError(SystemExit):
    """Raised in a function that is to end. A kind of SystemExit: a thread ends by it without a word, and
    `except Exception` does not catch it."""


class PausableThread:
    """One function, with its stack.

    Attributes:
        said: what it paused with, or DONE.
        error: what ended it, or None.
    """

    def __init__(self, work: Callable[[], object], name: str) -> None:
        """Nothing of it runs yet: see `resume`, which has to be called until it is done."""
        self.said = PAUSED
        self.error: BaseException | None = None
        self._work = work
        self._process = os.getpid()
        self._thrown: BaseException | None = None
        self._ending = False  # each pause raises
        self._refused = 0
        self._running = False  # whose turn it is; entries of the queues only wake who waits for them
        self._go: SimpleQueue[None] = SimpleQueue()
        self._paused: SimpleQueue[None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def is_done(self) -> bool:
        """It runs no more."""
        return self.said == DONE

    def resume(self, error: BaseException | None = None) -> str:
        """Runs the next stretch; `error` is raised where it paused. Returns what it then pauses with, or DONE.

        Raises:
            KeyboardInterrupt: came meanwhile; raised at the end of the stretch.
        """
        if self.is_done:
            return DONE
        self._thrown = error
        interrupted: KeyboardInterrupt | None = None
        self._running = True
        while self._running:
            try:
                self._go.put(None)
                self._paused.get()
            except KeyboardInterrupt as caught:
                interrupted = caught
        if interrupted is not None:
            raise interrupted
        return self.said

    def resume_openly(self) -> str:
        """Runs the next stretch as `resume` does; but what is raised meanwhile where it waits, such as
        KeyboardInterrupt, is raised at once. The stretch then still runs: see `end`."""
        if not self.is_done:
            self._running = True
            self._go.put(None)
            while self._running:
                with contextlib.suppress(Empty):
                    self._paused.get(timeout=_LOOK_S)
        return self.said

    def end(self, within_s: float) -> None:
        """Has EndedError raised where it paused, or in the midst of its stretch, again and again until it is done, but
        no longer than `within_s`. One that goes on all the same is left to itself: its pauses raise, too, or last."""
        self._ending = True
        was_running, self._running = self._running, True
        if not was_running:
            self._go.put(None)
        until = asked = time.perf_counter()
        until += within_s
        asked += 0.0 if was_running else _ASK_S  # one that paused is given time to clear up
        while not self.is_done and (now := time.perf_counter()) < until:
            if now >= asked:
                asked = now + _ASK_S
                throw(self._thread.ident, EndedError)
            with contextlib.suppress(Empty):
                self._paused.get(timeout=min(_ASK_S, until - now))

    @property
    def frame(self) -> FrameType | None:
        """The innermost frame that it is in; None: it runs no more."""
        return sys._current_frames().get(self._thread.ident or 0)

    def pause(self, saying: str = PAUSED) -> None:
        """Called by the function: ends the stretch. Returns, or raises what `resume` was given, when it goes on."""
        if self._ending:
            self._refused += 1
            while self._refused > _REFUSALS:  # it catches what should end it: it may at least not keep a processor busy
                time.sleep(_FOREVER_S)
            raise EndedError
        self._give_back(saying)
        self._await_turn()

    def _give_back(self, saying: str) -> None:
        leave_copy(self._process)
        self.said = saying
        self._running = False
        self._paused.put(None)

    def _await_turn(self) -> None:
        while not self._running:
            self._go.get()
        if self._ending:
            raise EndedError
        thrown, self._thrown = self._thrown, None
        if thrown is not None:
            raise thrown

    def _run(self) -> None:
        try:
            self._await_turn()
            self._work()
        except BaseException as error:  # raised where the thread is resumed
            self.error = error
        self._give_back(DONE)


def leave_copy(process: int) -> None:
    """Ends this process if it is not that one (`os.getpid()`, before) but a copy of it, which a brain has forked: only
    the first one goes on with the run."""
    if os.getpid() != process:
        os._exit(0)


def throw(thread: int | None, kind: type[BaseException] | None) -> None:
    """Has an exception raised in a thread, by its identifier, at its next line of Python; None: the one that is on its
    way is not."""
    what = None if kind is None else ctypes.py_object(kind)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread or 0), what)
