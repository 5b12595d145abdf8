"""What is typed at the terminal during a run goes to the program that drives the robot, line by line."""

from __future__ import annotations

import codecs
import os
import sys
import threading
from collections.abc import Iterable, Sequence
from queue import SimpleQueue

from boebot.record.interventions import Deed, Typed
from boebot.record.run import Run
from boebot.running.hands import Hands, Onlooker

ROOM = 1000  # bytes that are read at once


class Typist(Onlooker):
    """Reads standard input beside the run, from when it begins."""

    def __init__(self) -> None:
        self._typed: SimpleQueue[str] = SimpleQueue()
        self._robot = 0
        threading.Thread(target=self._read, daemon=True).start()

    def begin(self, robots: Sequence[Hands], results: Sequence[Run]) -> None:
        """See `Onlooker`: it types to the one robot that a program drives."""
        self._robot = next(number for number, robot in enumerate(robots) if robot.driver.is_program)

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        """See `Onlooker`."""
        while number == self._robot and not self._typed.empty():
            yield Typed(self._typed.get())

    def _read(self) -> None:
        # not by sys.stdin, whose lock a thread that waits there would keep until Python has ended
        decoder = codecs.getincrementaldecoder("utf-8")("replace")  # a letter may come in two pieces
        try:
            while data := os.read(sys.stdin.fileno(), ROOM):
                self._typed.put(decoder.decode(data))
        except (OSError, ValueError, AttributeError):  # there is none, or none to read from
            return
