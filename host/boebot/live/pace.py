"""How fast a simulated run goes by the wall clock: so many times real time, as fast as possible, step by step, not at
all. It only waits before steps of the brains: what happens in a run does not depend on it."""

from __future__ import annotations

import threading
import time

LAG_S = 0.5  # of the wall clock, that is caught up; what is beyond is forgotten
LOOK_S = 0.02  # of the wall clock, between two looks at what people want


class Pace:
    """Of one run. People change it from another thread.

    Attributes:
        speed: simulated seconds in one of the wall clock; None: as fast as possible.
        paused: time stands still.
    """

    def __init__(self, speed: float | None) -> None:
        self.speed = speed
        self.paused = False
        self._stepping = False
        self._passing_s = float("nan")  # the step that is carried out while time stands still
        self._anchor: tuple[float, float] | None = None  # wall clock and run's time that belong together
        self.changed = threading.Event()

    def set_speed(self, speed: float | None) -> None:
        """Another speed from now on."""
        self.speed, self._anchor = speed, None
        self.changed.set()

    def pause(self) -> None:
        """From the next step on time stands still."""
        self.paused = True
        self.changed.set()

    def resume(self) -> None:
        """It goes on."""
        self.paused, self._anchor = False, None
        self.changed.set()

    def step(self) -> None:
        """One step of the brains, then time stands still again."""
        self.paused = self._stepping = True
        self.changed.set()

    def holds(self, time_s: float) -> bool:
        """Whether the step at that time of the run has to wait. If it does, waits for a moment."""
        if self.paused:
            if self._stepping:
                self._stepping, self._passing_s = False, time_s
            if time_s == self._passing_s:
                return False
            self._wait(LOOK_S)
            return True
        speed = self.speed
        if speed is None:
            return False
        now = time.perf_counter()
        anchor = self._anchor  # once: another thread may take it away
        if anchor is None:
            self._anchor = anchor = now, time_s
        due = anchor[0] + (time_s - anchor[1]) / speed
        if now - due > LAG_S:
            self._anchor = now, time_s
        if due <= now:
            return False
        self._wait(min(due - now, LOOK_S))
        return True

    def _wait(self, seconds: float) -> None:
        self.changed.wait(seconds)
        self.changed.clear()
