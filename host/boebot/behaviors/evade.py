"""The moth's two-threshold escape from bats (notes, section 5.1; thresholds: the kit's own).

A weak signal, a bat far off, makes the moth steer away; a strong one, a bat that has found it, makes it fly erratically
and then drop:

    weak < S <= strong       a = (S_l - S_r) / (S_l + S_r),  s_L = s_0 + k a,  s_R = s_0 - k a; equal sides: straight on
    S > strong               for `erratic` seconds a turn by chance every `beat` seconds, then `drop` seconds of nothing

What was begun is done to its end, whatever the signal does meanwhile; then the moth hears anew. What a robot takes for
the bat is what its `left` and `right` functions read: light, sound, or the nearness of things, the default.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.behaviors.phototaxis import steered
from boebot.brain import checks
from boebot.brain.machine import Machine, State
from boebot.brain.process import CognitiveProcess, MotorBehavior
from boebot.brain.utility import HOLD
from boebot.cognition.proximity import left_nearness, right_nearness
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Evade(MotorBehavior):
    """Steers away from what is weak, and becomes unpredictable before what is strong.

    It brings along a cognitive process, which always listens, and calls it.

    Args:
        left: S_l, the signal on the left, 0 or more. None: nothing is known, 0.
        right: S_r, on the right.
        weak: max(S_l, S_r) above which it steers away.
        strong: max(S_l, S_r) above which it is found.
        signal: s_0, motor signal of steering away.
        gain: k, motor signal for each unit of a.
        erratic: s of turns by chance.
        beat: s from one of them to the next.
        spread: motor signals of each wheel are drawn from -spread to spread.
        drop: s to lie still.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    left: Callable[[Robot], float | None] = left_nearness
    right: Callable[[Robot], float | None] = right_nearness
    weak: float = 0.1
    strong: float = 0.5
    signal: float = 0.5
    gain: float = 0.5
    erratic: float = 1.0
    beat: float = 0.2
    spread: float = 0.8
    drop: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.weak < self.strong:
            raise BrainError(
                f"{self.name}: weak is {self.weak!r} and strong {self.strong!r}; expected 0 <= weak < strong"
            )
        checks.positive(self, "erratic", "beat", "drop")
        checks.shares(self, "signal", "spread")

    def companions(self) -> tuple[CognitiveProcess, ...]:
        return (Hearing(moth=self, name=f"{self.name}_hearing"),)

    def hear(self, robot: Robot) -> tuple[float, float]:
        """S_l and S_r."""
        left, right = (checks.reading(self, function, robot) or 0.0 for function in (self.left, self.right))
        return max(left, 0.0), max(right, 0.0)

    @property
    def is_bound(self) -> bool:
        """It is in the middle of its erratic flight or of its drop."""
        return self._bound

    def forget(self) -> None:
        self._bound = False

    def enter(self, robot: Robot) -> None:
        self.forget()
        self.machine = Machine(robot, self.steer)

    def step(self, robot: Robot) -> None:
        if not self._bound and max(self.hear(robot)) > self.strong:
            self._bound, self._next = True, robot.time
            self.machine.go(robot, self.flutter)
        self.machine.step(robot)

    def exit(self, robot: Robot) -> None:
        self.forget()

    def steer(self, robot: Robot) -> State | None:
        left, right = self.hear(robot)
        if left + right > 0:
            robot.drive(*steered(self.signal, -self.gain, left, right))
        else:
            robot.drive(self.signal, self.signal)
        return None

    def flutter(self, robot: Robot) -> State | None:
        if self.machine.time(robot) >= self.erratic - 1e-9:
            robot.stop()
            return self.lie
        if robot.time >= self._next - 1e-9:
            self._next = robot.time + self.beat
            robot.drive(*(self.random.uniform(-self.spread, self.spread) for _ in range(2)))
        return None

    def lie(self, robot: Robot) -> State | None:
        robot.stop()
        if self.machine.time(robot) < self.drop - 1e-9:
            return None
        self._bound = False
        return self.steer


@dataclass(kw_only=True)
class Hearing(CognitiveProcess):
    """Calls the moth's escape while something is heard, and until what it began is done."""

    moth: Evade

    def step(self, robot: Robot) -> None:
        heard = max(self.moth.hear(robot))
        self.kick(self.moth, HOLD if heard > self.moth.weak or self.moth.is_bound else -HOLD)
