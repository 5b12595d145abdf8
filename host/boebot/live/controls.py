"""What people want of a run: taken from their pages in the server's thread, carried out before steps of the brains.

One page drives a robot by hand at a time. While it does, the robot stops when the page is closed, or silent for 0.3 s
of the wall clock (a hidden page lets go); its brain drives again only once somebody says so.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass

from boebot.errors import BoebotError
from boebot.live import messages
from boebot.live.pace import Pace
from boebot.record.interventions import Deed, Hand, Parameter, Place, Release, Set, Shape

SILENT_S = 0.3  # of the wall clock, after which a robot that is driven by hand stops
WAITING = 100  # deeds of a robot that wait at most
REAL_TIME = 1.0
PACED = frozenset({"pause", "step", "speed"})
_NEEDS: dict[type, str] = {
    messages.Pause: "pause",
    messages.Resume: "pause",
    messages.Step: "step",
    messages.Speed: "speed",
    messages.Restart: "restart",
    Place: "drag",
    Shape: "drag",
    Parameter: "parameters",
    Set: "set",
    Hand: "hand",
}


@dataclass
class Wheel:
    """Who drives a robot by hand."""

    page: int
    """its number"""
    hand: Hand
    heard_s: float
    """when it last said so, by the wall clock"""


class Controls:
    """Of one run.

    Attributes:
        can: what people may do, as the page has it.
        pace: how fast the run goes.
    """

    def __init__(
        self, robots: int, shapes: int, can: frozenset[str], pace: Pace, pages: Callable[[], Collection[int]]
    ) -> None:
        """`shapes`: how many of them move in the arena. `pages`: those that are open now."""
        self.can, self.pace = can, pace
        self._robots, self._shapes, self._pages = robots, shapes, pages
        self._lock = threading.Lock()
        self._deeds: list[deque[Deed]] = [deque() for _ in range(robots)]
        self._wheels: list[Wheel | None] = [None] * robots

    # ---- from pages ------------------------------------------------------------------------------------------------

    def went(self) -> None:
        """A page is gone. What it drove stops; a run that stands still goes on if that was the last page."""
        with self._lock:
            if not self._pages() and self.pace.paused:
                self.pace.resume()

    def heard(self, page: int, asked: messages.Asked) -> None:
        """What a page asks for.

        Raises:
            BoebotError: it cannot be done.
        """
        need = _NEEDS.get(type(asked.deed if isinstance(asked, messages.Do) else asked))
        if need is not None and need not in self.can:
            raise BoebotError(f"{need} cannot be done here: {_why_not(need)}")
        with self._lock:
            self._take(page, asked)
        self.pace.changed.set()

    def _take(self, page: int, asked: messages.Asked) -> None:
        match asked:
            case messages.Pause():
                self.pace.pause()
            case messages.Resume():
                self.pace.resume()
            case messages.Step():
                self.pace.step()
            case messages.Speed(speed):
                self.pace.set_speed(speed)
            case messages.Do(robot, deed):
                self._do(page, robot, deed)

    def _do(self, page: int, robot: int, deed: Deed) -> None:
        if robot >= self._robots:
            raise BoebotError(f"there is no robot {robot + 1}; expected 1 to {self._robots}")
        if isinstance(deed, Shape) and deed.index >= self._shapes:
            raise BoebotError(f"there is no moving shape {deed.index + 1}; expected 1 to {self._shapes}")
        if isinstance(deed, Hand):
            self._drive(page, robot, deed)
            return
        if isinstance(deed, Release):
            self._may_drive(page, robot)
            self._wheels[robot] = None
        if len(self._deeds[robot]) >= WAITING:
            raise BoebotError(f"{WAITING} interventions wait already; expected fewer at once")
        self._deeds[robot].append(deed)

    def _may_drive(self, page: int, robot: int) -> None:
        wheel = self._wheels[robot]
        if wheel is not None and wheel.page != page and wheel.page in self._pages():
            raise BoebotError(f"another page drives robot {robot + 1}; expected it to let go first")

    def _drive(self, page: int, robot: int, hand: Hand) -> None:
        self._may_drive(page, robot)
        if self._wheels[robot] is None and "speed" in self.can:  # nobody can drive faster than real time
            speed = self.pace.speed
            if speed is None or speed > REAL_TIME:
                self.pace.set_speed(REAL_TIME)
        self._wheels[robot] = Wheel(page, hand, time.perf_counter())

    # ---- to the run ------------------------------------------------------------------------------------------------

    def due(self, robot: int, held: Hand | None) -> list[Deed]:
        """What is to be done to a robot now. `held`: the signals by which it is driven by hand so far."""
        with self._lock:
            deeds = list(self._deeds[robot])
            self._deeds[robot].clear()
            wheel = self._wheels[robot]
            if wheel is None:
                return deeds
            is_silent = time.perf_counter() - wheel.heard_s > SILENT_S
            is_gone = wheel.page not in self._pages()
            hand = Hand(0.0, 0.0) if is_silent or is_gone else wheel.hand
            return deeds if hand == held else [*deeds, hand]

    def drivers(self) -> list[int | None]:
        """For each robot the page that drives it by hand."""
        with self._lock:
            return [None if wheel is None else wheel.page for wheel in self._wheels]


def _why_not(need: str) -> str:
    if need in PACED or need == "drag":
        return "only a simulated run that is not in real time stands still, and only a simulated robot is put elsewhere"
    return "this run has nothing of the kind"
