"""Fixed action patterns (section 4.4.3 of the notes): once released, run to the end.

A sign stimulus releases the pattern; a goose rolls its egg home to the end, even if the egg is removed meanwhile.
The releasing mechanism is a cognitive process, which watches whatever the robot does at the time, and holds
the pattern's gamma parameter up until the pattern is done.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess, MotorBehavior, Process
from boebot.brain.utility import HOLD, Utility
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


class Action(NamedTuple):
    """One part of a pattern.

    Args:
        left: motor signal of the left wheel, -1 to 1.
        right: of the right wheel.
        seconds: how long (s).
    """

    left: float
    right: float
    seconds: float


@dataclass(kw_only=True)
class FixedActionPattern(MotorBehavior):
    """Actions one after the other, without a look at any sensor.

    Args:
        actions: one after the other: motor signals of the left and the right wheel, -1 to 1, and seconds.
        releaser: gives True as long as the sign stimulus is there, from a robot.
        refractory: s after its end in which it cannot be released.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        running: it has been released and is not done.
    """

    actions: Sequence[Action | tuple[float, float, float]]
    releaser: Callable[[Robot], bool]
    refractory: float = 0.0
    utility: Utility = field(default_factory=lambda: Utility(b=-1.0, tau=0.02, tau_gamma=0.05))

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.not_negative(self, "refractory")
        if not callable(self.releaser):
            raise checks.refused(self, "releaser", "a function of the robot")
        self._actions = [self._checked(action) for action in self.actions]

    def _checked(self, action: Action | tuple[float, float, float]) -> Action:
        try:
            checked = Action(*action)
            fits = bool(abs(checked.left) <= 1 and abs(checked.right) <= 1 and 0 < checked.seconds < float("inf"))
        except TypeError:
            fits = False
        if not fits:
            shown = tuple(action) if isinstance(action, tuple) else action
            raise BrainError(f"{self.name}: action {shown!r}; expected signals from -1 to 1, and seconds > 0")
        return checked

    def forget(self) -> None:
        self.running = False
        self._ended = float("-inf")

    @property
    def duration(self) -> float:
        """Seconds of all actions."""
        return sum(action.seconds for action in self._actions)

    def may_begin(self, time: float) -> bool:
        """Whether its sign stimulus would release it at that time (s)."""
        return not self.running and time - self._ended >= self.refractory

    def companions(self) -> Sequence[Process]:
        return (ReleasingMechanism(pattern=self, name=f"{self.name}_release"),)

    def enter(self, robot: Robot) -> None:
        self._begun = robot.time

    def step(self, robot: Robot) -> None:
        since = robot.time - self._begun
        for left, right, seconds in self._actions:
            # robot.time is a sum of ticks: an action of 0.3 s has ended at 0.3 s, whatever its last digit is
            if since < seconds - 1e-9:
                robot.drive(left, right)
                return
            since -= seconds
        robot.drive(0.0, 0.0)
        self._end(robot)
        self.kick(self, -HOLD)  # others take over at the next step

    def exit(self, robot: Robot) -> None:
        self._end(robot)  # in case a stronger process took the motors

    def _end(self, robot: Robot) -> None:
        if self.running:
            self.running = False
            self._ended = robot.time


@dataclass(kw_only=True)
class ReleasingMechanism(CognitiveProcess):
    """Releases a pattern at its sign stimulus and holds it until it is done."""

    pattern: FixedActionPattern

    def enter(self, robot: Robot) -> None:
        self.pattern.forget()

    def step(self, robot: Robot) -> None:
        pattern = self.pattern
        if pattern.may_begin(robot.time) and pattern.releaser(robot):
            pattern.running = True
        self.kick(pattern, HOLD if pattern.running else -HOLD)
