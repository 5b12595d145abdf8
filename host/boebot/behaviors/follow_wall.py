"""Follow a wall at a distance (named in section 5 of the notes; law of section 4.9 of the specification).

    e = S_side - S_ref,   s_L = s_0 ∓ k e,   s_R = s_0 ± k e        upper signs: the wall is on the right

The nearer, the larger S: too close to a wall on the right (e > 0), it turns left. Something ahead: it turns on the
spot, away from the wall.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from boebot.behaviors.straight_run import within_signals
from boebot.brain.process import MotorBehavior
from boebot.cognition.proximity import left_nearness, nearness_ahead, right_nearness
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class FollowWall(MotorBehavior):
    """Keeps a wall at its side."""

    NEEDS = ("infrared",)

    side: Literal["left", "right"] = "right"
    """where the wall is"""
    signal: float = 0.5
    """s_0"""
    gain: float = 0.5
    """k, for each unit of nearness"""
    reference: float = 0.25
    """S_ref: nearness of the wall that is kept"""
    ahead: float = 0.25
    """nearness of something ahead, or on the other side, from which on it turns on the spot"""
    turn: float = 0.3
    """motor signal of turning on the spot"""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side not in ("left", "right"):
            raise BrainError(f"{self.name}: side is {self.side!r}; expected 'left' or 'right'")

    def step(self, robot: Robot) -> None:
        left, right = left_nearness(robot) or 0.0, right_nearness(robot) or 0.0
        beside, other = (right, left) if self.side == "right" else (left, right)
        away = 1.0 if self.side == "right" else -1.0  # counter-clockwise
        if max(nearness_ahead(robot) or 0.0, other) > self.ahead:
            robot.drive(-away * self.turn, away * self.turn)
            return
        correction = away * self.gain * (beside - self.reference)
        robot.drive(within_signals(self.signal - correction), within_signals(self.signal + correction))
