"""Escalating avoidance, as the trumpet animalcule Stentor has it: equations (7.11) to (7.15) of the notes, section 7.2.

    dU_i/dt + a_i U_i = b_i X      (7.12)          U_0 = C          i_sel = argmax U_i      (7.13)
    dX/dt + k_1 X = X_1     while touched          dX/dt + k_2 X = X_2     else             (7.14), (7.15)

Stentor bends away, reverses its cilia, contracts and at last detaches itself; a robot that is touched turns away, backs
off, stops, and calls for help. Mild answers react first (b_i falls with i), drastic ones are stronger in the end
(b_i / a_i rises) and last longer (a_i falls). After a rest the chain may skip what did not help a moment ago.

Stentor is irritated as long as it feeds (7.14): where it is, the stimulus does not end. A robot has whiskers, so X
follows their touches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from boebot.brain.leaky import LeakyIntegrator
from boebot.brain.process import CognitiveProcess, MotorBehavior
from boebot.brain.utility import HOLD
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


class Link(NamedTuple):
    """One answer of the chain: a_i and b_i of (7.12), both 1/s."""

    decay: float
    gain: float


STENTOR = (Link(8.5, 12.0), Link(4.3, 6.6), Link(1.6, 2.75), Link(0.75, 1.45))
"""turn away, reverse, contract, detach (such that Fig. 7.4 comes out)"""


class LeakyChain:
    """(7.12) and (7.13): leaky integrators of one stimulus, of which the largest is chosen.

    Attributes:
        values: U_1 ... U_n.
        chosen: 0: none of them is above C; i: U_i is the largest.
    """

    def __init__(self, links: Sequence[Link | tuple[float, float]] = STENTOR, rest: float = 0.46) -> None:
        """`links`: mildest first; `rest`: C, the constant utility of being at rest.

        Raises:
            BrainError: a link is not of two numbers above 0.
        """
        try:
            self._integrators = [LeakyIntegrator(*Link(*link)) for link in links]
            wrong = not links or not all(math.isfinite(x) and x > 0 for link in links for x in link)
        except (TypeError, ValueError):
            wrong = True
        if wrong:
            raise BrainError(f"a chain of {links!r}; expected pairs (a, b) of numbers above 0")
        self._rest = rest

    @property
    def values(self) -> tuple[float, ...]:
        """See the class."""
        return tuple(integrator.value for integrator in self._integrators)

    @property
    def chosen(self) -> int:
        """See the class."""
        utilities = (self._rest, *self.values)
        return utilities.index(max(utilities))

    def advance(self, stimulus: float, elapsed: float) -> int:
        """By `elapsed` seconds with that stimulus; returns `chosen`."""
        for integrator in self._integrators:
            integrator.advance(stimulus, elapsed)
        return self.chosen


ANSWERS = ("turn", "reverse", "stop", "call")


@dataclass(kw_only=True)
class Escalate(MotorBehavior):
    """Answers touches that do not end ever more drastically: turns away, reverses, stops, calls for help.

    It brings along a cognitive process, which always feels touches, and calls it. A robot without a buzzer calls by
    turning on the spot, as one that waves.

    Args:
        links: (a_i, b_i) (1/s) of the four answers, mildest first.
        rest: C: what an answer's utility must exceed.
        rise: k_1 (1/s) and X_1 (1/s) of (7.14), while a whisker is touched.
        fade: k_2 and X_2 of (7.15).
        signal: motor signal of turning and reversing.
        tone: Hz, and seconds of each call.
        every: s from call to call.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        answer: "" (at rest), "turn", "reverse", "stop" or "call".
    """

    NEEDS = ("whiskers",)

    links: tuple[tuple[float, float], ...] = STENTOR
    rest: float = 0.46
    rise: tuple[float, float] = (1.15, 2.6)
    fade: tuple[float, float] = (0.9, 0.15)
    signal: float = 0.5
    tone: tuple[float, float] = (2000.0, 0.2)
    every: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.links) != len(ANSWERS):
            raise BrainError(f"{self.name}: {len(self.links)} links; expected one for each of {', '.join(ANSWERS)}")
        for key in ("rise", "fade"):
            rate, source = getattr(self, key)
            if not (rate > 0 and 0 <= source < math.inf):
                raise BrainError(f"{self.name}: {key} is {(rate, source)!r}; expected a rate above 0, and 0 or more")
        if not self.rise[1] > self.fade[1]:
            raise BrainError(f"{self.name}: X_1 is {self.rise[1]!r}; expected more than X_2, {self.fade[1]!r}")
        if not 0 < self.signal <= 1:
            raise BrainError(f"{self.name}: signal is {self.signal!r}; expected a motor signal above 0, to 1")
        if not self.every > 0:
            raise BrainError(f"{self.name}: every is {self.every!r}; expected seconds, more than 0")
        self.chain()  # refuses links that are none

    def forget(self) -> None:
        self.answer = ""

    def chain(self) -> LeakyChain:
        """The chain, calm."""
        return LeakyChain(self.links, self.rest)

    def companions(self) -> tuple[CognitiveProcess, ...]:
        return (Touchiness(escalation=self, name=f"{self.name}_touchiness"),)

    def enter(self, robot: Robot) -> None:
        self._calls_at = robot.time
        self._left = False
        self._aside = ""

    def step(self, robot: Robot) -> None:
        if self.answer != self._aside and self.answer in ("turn", "call"):
            self._left = robot.whisker_right.pressed and not robot.whisker_left.pressed  # away from the touch
        self._aside = self.answer
        match self.answer:
            case "turn":
                self._turn(robot)
            case "reverse":
                robot.drive(-self.signal, -self.signal)
            case "call":
                self._call(robot)
            case _:
                robot.stop()

    def _turn(self, robot: Robot) -> None:
        turn = self.signal if self._left else -self.signal
        robot.drive(-turn, turn)

    def _call(self, robot: Robot) -> None:
        if not robot.has("buzzer"):
            self._turn(robot)
            return
        robot.stop()
        if robot.time >= self._calls_at - 1e-9:
            robot.beep(*self.tone)
            self._calls_at = robot.time + self.every


@dataclass(kw_only=True)
class Touchiness(CognitiveProcess):
    """Lets touches raise the stimulus, and the stimulus the chain.

    Attributes:
        stimulus: X.
    """

    escalation: Escalate

    def forget(self) -> None:
        self._chain = self.escalation.chain()
        self.stimulus = 0.0
        self._touched = False

    def enter(self, robot: Robot) -> None:
        self.forget()
        self.escalation.forget()
        self._time = robot.time

    def step(self, robot: Robot) -> None:
        elapsed, self._time = robot.time - self._time, robot.time
        # held over the step: what was felt at its beginning
        rate, source = self.escalation.rise if self._touched else self.escalation.fade
        chosen = self._chain.advance(self.stimulus, elapsed)
        self.stimulus = LeakyIntegrator(rate, 1.0, self.stimulus).advance(source, elapsed)
        self._touched = robot.whisker_left.pressed or robot.whisker_right.pressed
        self.escalation.answer = ("", *ANSWERS)[chosen]
        self.kick(self.escalation, HOLD if chosen else -HOLD)
