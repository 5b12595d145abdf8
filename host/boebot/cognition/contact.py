"""Contact: touched whiskers, and for how long they have been."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Contact(CognitiveProcess):
    """Counts touches.

    Args:
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        touches: how often a whisker was touched since the run began.
        left: the left whisker is touched.
        right: the right one is.
        last: time (s) of the last step in which one was, or None.
    """

    NEEDS = ("whiskers",)

    def forget(self) -> None:
        self.touches = 0
        self.left = self.right = False
        self.last: float | None = None

    def enter(self, robot: Robot) -> None:
        self.forget()

    def step(self, robot: Robot) -> None:
        left, right = robot.whisker_left.pressed, robot.whisker_right.pressed
        self.touches += (left and not self.left) + (right and not self.right)
        self.left, self.right = left, right
        if left or right:
            self.last = robot.time


def contact() -> StateVariable:
    """State variable "contact": 1 while a whisker is touched; 0 on a robot without whiskers."""
    return StateVariable("contact", _touched)


def _touched(robot: Robot) -> float:
    if not robot.has("whiskers"):
        return 0.0
    return float(robot.whisker_left.pressed or robot.whisker_right.pressed)
