"""Escape from a touch: a fixed action pattern (notes, section 4.4.3; steps: the kit's own).

Reverse 0.4 s, turn 120 degrees away from the touched side, forward 0.3 s; once begun it runs to its end, whatever the
whiskers say meanwhile. How long the turn takes follows from the robot's lengths: rate = 2 s v / track width.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from boebot.brain.fixed_action import Action, FixedActionPattern
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Escape(FixedActionPattern):
    """Backs off from what a whisker has touched, turns away and goes on.

    Args:
        back: s of reversing.
        angle: rad of turning away.
        forward: s straight on.
        signal: motor signal of all of it.
        refractory: s after its end in which no touch begins it again.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    NEEDS = ("whiskers",)

    actions: Sequence[Action | tuple[float, float, float]] = field(default=(), init=False, repr=False)
    releaser: Callable[[Robot], bool] = field(default=bool, init=False, repr=False)

    back: float = 0.4
    angle: float = 2 * math.pi / 3
    forward: float = 0.3
    signal: float = 0.5

    def __post_init__(self) -> None:
        self.releaser = self._touched
        super().__post_init__()
        for key in ("back", "angle", "forward", "signal"):
            if not 0 < getattr(self, key) < math.inf or self.signal > 1:
                raise BrainError(
                    f"{self.name}: {key} is {getattr(self, key)!r}; expected more than 0, a signal up to 1"
                )

    def forget(self) -> None:
        super().forget()
        self._left = False  # it turns, or turned last, to the left

    def enter(self, robot: Robot) -> None:
        super().enter(robot)
        s, size = self.signal, robot.dimensions
        turn = -s if self._left else s
        seconds = self.angle * size.track_width / (2 * s * size.speed)
        self._actions = [Action(-s, -s, self.back), Action(turn, -turn, seconds), Action(s, s, self.forward)]

    def _touched(self, robot: Robot) -> bool:
        left, right = robot.whisker_left.pressed, robot.whisker_right.pressed
        if left or right:
            self._left = self.chance(0.5) if left == right else right  # turns away from the touch
        return left or right
