"""What people want of a run: taken from their pages in the server's thread, carried out before steps of the brains.

One page drives a robot by hand at a time. While it does, the robot stops when the page is hidden, closed, or silent for
0.3 s of the wall clock; its brain drives again only once somebody says so.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from dataclasses import dataclass

from boebot.errors import BoebotError
from boebot.live import messages
from boebot.live.pace import Pace
from boebot.record.interventions import Arm, Deed, Hand, Parameter, Place, Release, Shape, Stop

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
    messages.Place: "drag",
    messages.Shape: "drag",
    messages.Parameter: "parameters",
    messages.Hand: "hand",
}


@dataclass
class Wheel:
    """Who drives a robot by hand."""

    page: int
    """its number"""
    left: float
    right: float
    heard_s: float
    """when it last said so, by the wall clock"""


class Controls:
    """Of one run.

    Attributes:
        can: what people may do, as the page has it.
        pace: how fast the run goes.
        restart: what the run is to begin afresh with; None: it goes on.
        is_idle: nothing is to be done to any robot, nobody drives one by hand, and no other run is asked for.
    """

    def __init__(self, robots: int, shapes: int, can: frozenset[str], pace: Pace) -> None:
        """`shapes`: how many of them move in the arena."""
        self.can, self.pace = can, pace
        self.restart: messages.Restart | None = None
        self.is_idle = True
        self._robots, self._shapes = robots, shapes
        self._lock = threading.Lock()
        self._deeds: list[deque[Deed]] = [deque() for _ in range(robots)]
        self._wheels: list[Wheel | None] = [None] * robots
        self._hidden: set[int] = set()
        self._open: set[int] = set()

    # ---- from pages ------------------------------------------------------------------------------------------------

    def came(self, page: int) -> None:
        """A page is open."""
        with self._lock:
            self._open.add(page)

    def went(self, page: int) -> None:
        """It is gone. What it drove stops; a run that stands still goes on if that was the last page."""
        with self._lock:
            self._open.discard(page)
            self._hidden.discard(page)
            if not self._open and self.pace.paused:
                self.pace.resume()

    def heard(self, page: int, asked: messages.Asked) -> None:
        """What a page asks for.

        Raises:
            BoebotError: it cannot be done.
        """
        need = _NEEDS.get(type(asked))
        if need is not None and need not in self.can:
            raise BoebotError(f"{need} cannot be done here: {_why_not(need)}")
        robot = getattr(asked, "robot", 0)
        if robot >= self._robots:
            raise BoebotError(f"there is no robot {robot + 1}; expected 1 to {self._robots}")
        with self._lock:
            self._take(page, robot, asked)
        self.pace.changed.set()

    def _take(self, page: int, robot: int, asked: messages.Asked) -> None:
        match asked:
            case messages.Pause():
                self.pace.pause()
            case messages.Resume():
                self.pace.resume()
            case messages.Step():
                self.pace.step()
            case messages.Speed(speed):
                self.pace.set_speed(speed)
            case messages.Restart():
                self.begin_afresh(asked)
            case messages.Place(_, pose):
                self._put(robot, Place(*pose))
            case messages.Shape(shape, pose):
                if shape >= self._shapes:
                    raise BoebotError(f"there is no moving shape {shape + 1}; expected 1 to {self._shapes}")
                self._put(0, Shape(shape, *pose))
            case messages.Parameter(_, name, value):
                self._put(robot, Parameter(name, value))
            case messages.Hand(_, left, right):
                self._drive(page, robot, left, right)
            case messages.Release():
                self._may_drive(page, robot)
                self._wheels[robot] = None
                self._put(robot, Release())
            case messages.Stop():
                self._put(robot, Stop())
            case messages.Arm():
                self._put(robot, Arm())
            case messages.Visible(visible):
                (self._hidden.discard if visible else self._hidden.add)(page)

    def begin_afresh(self, restart: messages.Restart) -> None:
        """Another run is asked for."""
        self.restart, self.is_idle = restart, False

    def _put(self, robot: int, deed: Deed) -> None:
        if len(self._deeds[robot]) >= WAITING:
            raise BoebotError(f"{WAITING} interventions wait already; expected fewer at once")
        self._deeds[robot].append(deed)
        self.is_idle = False

    def _may_drive(self, page: int, robot: int) -> None:
        wheel = self._wheels[robot]
        if wheel is not None and wheel.page != page and wheel.page in self._open:
            raise BoebotError(f"another page drives robot {robot + 1}; expected it to let go first")

    def _drive(self, page: int, robot: int, left: float, right: float) -> None:
        self._may_drive(page, robot)
        if self._wheels[robot] is None and "speed" in self.can:  # nobody can drive faster than real time
            speed = self.pace.speed
            if speed is None or speed > REAL_TIME:
                self.pace.set_speed(REAL_TIME)
        self._wheels[robot] = Wheel(page, left, right, time.monotonic())
        self.is_idle = False

    # ---- to the run ------------------------------------------------------------------------------------------------

    def due(self, robot: int, held: Hand | None) -> list[Deed]:
        """What is to be done to a robot now. `held`: the signals by which it is driven by hand so far."""
        with self._lock:
            deeds = list(self._deeds[robot])
            self._deeds[robot].clear()
            by_hand = self._wheels.count(None) < self._robots
            self.is_idle = not any(self._deeds) and not by_hand and self.restart is None
            wheel = self._wheels[robot]
            if wheel is None:
                return deeds
            is_silent = time.monotonic() - wheel.heard_s > SILENT_S
            is_absent = wheel.page in self._hidden or wheel.page not in self._open
            hand = Hand(0.0, 0.0) if is_silent or is_absent else Hand(wheel.left, wheel.right)
            return deeds if hand == held else [*deeds, hand]

    def drivers(self) -> list[int | None]:
        """For each robot the page that drives it by hand."""
        with self._lock:
            return [None if wheel is None else wheel.page for wheel in self._wheels]


def _why_not(need: str) -> str:
    if need in PACED or need == "drag":
        return "only a simulated run that is not in real time stands still, and only a simulated robot is put elsewhere"
    return "this run has nothing of the kind"


def usual_speed(speed: float | None) -> float | None:
    """A speed as people give it, checked: None or infinite: as fast as possible.

    Raises:
        BoebotError: it is none.
    """
    if speed is None or speed == math.inf:
        return None
    if not 0.01 <= speed <= 10_000:
        raise BoebotError(f"a run cannot go {speed:g} times as fast as real time; expected 0.01 to 10000, or max")
    return float(speed)
