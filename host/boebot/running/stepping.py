"""One step of a brain, guarded: what it may do wrong ends the run with one sentence and the place in the user's file.

A step that does not end is interrupted from a second thread. Its driver says how long it may take by the wall clock: a
run that is as fast as possible only has to notice an endless loop; in real time a step that outlasts its set-points has
let the robot run into its dead-man. Shorter overruns are counted and the run goes on: the set-points outlive two missed
periods, and a computer that was busy for a moment is no error in the brain.

After Ctrl-C the run ends with the step, also where the brain has caught it (boebot.running.interrupts).
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time as wall
from collections.abc import Callable
from numbers import Real
from types import FrameType
from typing import Any, NamedTuple

from boebot import brains, slips
from boebot.brains import LoadedBrain
from boebot.errors import BrainError
from boebot.pausable_thread import leave_copy, throw
from boebot.robot import Command, Robot
from boebot.running import interrupts

STEP_LIMIT_S = 10.0  # for a step, by the wall clock, where nothing waits for it
_LOOKS = 10  # of the watching thread while a step may last
_LOOK_S = 0.1  # from one look to the next at most
_WAKE: Any = getattr(signal, "SIGURG", None)  # what nobody minds; it ends a wait of the main thread


class StepLimit(NamedTuple):
    """How long a step of the brain may take."""

    seconds: float
    """by the wall clock; infinite: as long as it wants"""
    reason: str
    """ends the sentence about a step that took longer"""


class StepTimes:
    """How long the steps of one brain took by the wall clock, however fast its run was.

    Attributes:
        longest: of them, s.
        long: how many took longer than the brain's period: a robot would have waited for those.
    """

    def __init__(self) -> None:
        self.longest = 0.0
        self.long = 0

    def add(self, seconds: float, period_s: float) -> None:
        """One step more."""
        if seconds > self.longest:
            self.longest = seconds
        if seconds > period_s:
            self.long += 1


AT_LEISURE = StepLimit(STEP_LIMIT_S, "expected it to return (step_timeout, --step-timeout: how long to wait)")


def step_once(robot: Robot, brain: LoadedBrain, watch: StepWatch, times: StepTimes) -> None:
    """One step of the brain; how long it took goes to `times`.

    Raises:
        BrainError: whatever goes wrong in it, with its place.
        KeyboardInterrupt: Ctrl-C.
    """
    begun = wall.perf_counter()
    try:
        answer = watch.call(brain.step, robot)
    except KeyboardInterrupt:
        raise
    except _OverdueError as error:
        sentence = watch.sentence if brain.main is None else slips.of_sign("no wait", seconds=watch.limit.seconds)
        raise BrainError(brains.locate(error, brain.path, sentence)) from None
    except BaseException as error:  # also what asyncio, test tools or the brain itself derive from it
        raise BrainError(brains.explain(error, brain.path)) from error
    finally:
        times.add(wall.perf_counter() - begun, robot.period)
    if answer is not None and _is_pair(answer):
        raise BrainError(f"{_where(brain)}: {slips.of_sign('pair', answer=repr(answer))}")
    command = robot.command
    if not _is_possible(command, robot.speed_limit):
        raise BrainError(
            f"{_where(brain)}: robot.command is {command!r}; expected what robot.drive(left, right) makes of it"
        )


def _is_pair(answer: object) -> bool:
    """It looks like signals for two motors."""
    if not isinstance(answer, tuple | list):
        return False
    return isinstance(answer, Command) or (len(answer) == 2 and all(isinstance(one, Real | str) for one in answer))


def _is_possible(command: object, speed_limit: float) -> bool:
    """`robot.drive` refuses what motors cannot do; a brain may have set `robot.command` itself."""
    if not isinstance(command, Command) or command.kind not in ("signal", "speed", "stop"):
        return False
    limit = speed_limit if command.kind == "speed" else 1.0
    try:
        return bool(abs(command.left) <= limit and abs(command.right) <= limit)
    except (TypeError, ValueError):
        return False


def _where(brain: LoadedBrain) -> str:
    """The brain's file, or where its function stands."""
    code = getattr(brain.step, "__code__", None)
    if code is not None and (brain.path is None or code.co_filename == str(brain.path)):
        return f"{code.co_filename}, line {code.co_firstlineno}"
    return str(brain.path or brain.name)


class _OverdueError(BaseException):
    """Thrown into a step that takes too long; a brain's `except Exception` does not catch it."""


class StepWatch:
    """Interrupts a step that takes too long. The steps run in the thread that enters the watch.

    Time is counted in looks of the watching thread at whether it is still the same step: a computer that slept, or that
    has too much to do, counts as little as the time that somebody spends in a debugger.

    A step that waits inside a library is woken where the system has signals for it and the step runs in the main
    thread; elsewhere it ends when that call does.
    """

    def __init__(self, limit: StepLimit) -> None:
        """`limit`: may be changed between two steps."""
        self.limit = limit
        self._thread = 0  # which the steps run in
        self._process = os.getpid()
        self._count = 0  # of steps that have begun
        self._inside = False
        self._thrown = False
        self._lock = threading.Lock()  # held for each change of the last two
        self._ended = threading.Event()
        self._watcher = threading.Thread(target=self._watch, name="step watch", daemon=True)
        self._wakes = False  # the thread can be woken from a wait
        self._handler: object = signal.SIG_DFL  # of that signal, before

    @property
    def sentence(self) -> str:
        """The error of a step that took too long."""
        return f"a step of the brain has not ended after {self.limit.seconds:g} s; {self.limit.reason}"

    def __enter__(self) -> StepWatch:
        self._thread = threading.get_ident()
        self._wakes = _WAKE is not None and threading.current_thread() is threading.main_thread()
        if self._wakes:
            self._handler = signal.signal(_WAKE, lambda number, frame: None) or signal.SIG_DFL
        self._watcher.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()
        self._ended.set()
        self._watcher.join()
        if self._wakes:
            signal.signal(_WAKE, self._handler)  # type: ignore[arg-type]

    def call(self, step: Callable[[Robot], object], robot: Robot) -> object:
        """What `step(robot)` returns.

        Raises:
            _OverdueError: it took too long.
            KeyboardInterrupt: Ctrl-C.
        """
        try:
            self._count += 1
            self._inside = True
            answer = step(robot)
        finally:
            leave_copy(self._process)
            self._leave()
            if interrupts.first is not None:  # also where the brain has caught it
                raise KeyboardInterrupt
        if self._thrown:  # and the brain has caught it
            raise _OverdueError
        return answer

    def _leave(self) -> None:
        """From here on nothing is thrown any more, nor is anything on its way."""
        while True:
            try:
                with self._lock:
                    self._inside = False
                    if self._thrown:
                        throw(self._thread, None)
                return
            except _OverdueError:  # came before the lock was ours
                continue

    # ---- the watching thread ---------------------------------------------------------------------------------------

    def _watch(self) -> None:
        seen, looks = -1, 0
        while not self._ended.wait(look_s := min(self.limit.seconds / _LOOKS, _LOOK_S)):
            if not self._inside or self._count != seen or self._in_debugger():
                seen, looks = self._count, 0
                continue
            looks += 1
            if looks * look_s >= self.limit.seconds * (1 - 1e-9):
                looks = 0  # a brain that catches it is asked again
                self._interrupt()

    def _interrupt(self) -> None:
        with self._lock:
            if self._inside:
                self._thrown = True
                throw(self._thread, _OverdueError)
                if self._wakes:
                    signal.pthread_kill(self._thread, _WAKE)

    def _in_debugger(self) -> bool:
        """Somebody traces the step line by line, or a thread of the brain."""
        for innermost in sys._current_frames().values():
            frame: FrameType | None = innermost
            while frame is not None:
                if frame.f_trace is not None:
                    return True
                frame = frame.f_back
        return False
