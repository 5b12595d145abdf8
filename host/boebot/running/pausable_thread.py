"""A function that runs a stretch at a time: until it pauses, and on when it is resumed.

The link's conversations (opening, requests, stopping) wait inside their calls, so each robot's driver needs a stack to
wait on while others go on: a thread's. But two stretches never run at the same time: who resumes a thread waits until
it pauses, so that nothing depends on the machine's scheduling.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Final

PAUSED: Final = "paused"
DONE: Final = "done"


class PausableThread:
    """One function, with its stack.

    Attributes:
        said: what it paused with, or DONE.
        error: what ended it, or None.
    """

    def __init__(self, work: Callable[[], None], name: str) -> None:
        """Nothing of it runs yet: see `resume`, which has to be called until it is done."""
        self.said = PAUSED
        self.error: BaseException | None = None
        self._work = work
        self._thrown: BaseException | None = None
        self._running = False  # whose turn it is; entries of the queues only wake who waits for them
        self._go: SimpleQueue[None] = SimpleQueue()
        self._paused: SimpleQueue[None] = SimpleQueue()
        threading.Thread(target=self._run, name=name, daemon=True).start()

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

    def pause(self, saying: str = PAUSED) -> None:
        """Called by the function: ends the stretch. Returns, or raises what `resume` was given, when it goes on."""
        self._give_back(saying)
        self._await_turn()

    def _give_back(self, saying: str) -> None:
        self.said = saying
        self._running = False
        self._paused.put(None)

    def _await_turn(self) -> None:
        while not self._running:
            self._go.get()
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
