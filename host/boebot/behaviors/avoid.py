"""Obstacle avoidance by infra-red sensors (chapter 4 of the notes; law of section 4.9 of the specification).

Active while max(S_l, S_r) is above a limit; then (∓0.5, ±0.5), away from the stronger side, until both are clear, and
a little longer. The limit is the utility's, against Wander's tanh(0.5) with "near" = max(S_l, S_r):

    Utility(b=-1.0, w={"near": 10.0}, tau=0.1)        above tanh(0.5) where 10 S - 1 > 0.5, that is, S > 0.15

The specification's figures, S > 0.3, clear below 0.15, 0.2 s longer, are too little for a body that is wider than its
sensors' beams. A pillar's corner meets but one of a sensor's three rays, which makes S a third of a wall's: on the
notes' robot S passes 0.3 where the corner is 0.2 m away at the beam's edge, a robot's radius beside its path. So it is
heeded earlier, and turned away from for longer. The utility's lag costs distance as well: at 0.68 m/s and τ = 0.2 s
0.18 m until a sudden S has called it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain.process import MotorBehavior
from boebot.brain.utility import HOLD
from boebot.cognition.proximity import left_nearness, right_nearness

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Avoid(MotorBehavior):
    """Turns on the spot away from the side that is nearer, until both are clear and a little longer."""

    NEEDS = ("infrared",)

    turn: float = 0.5
    """motor signal of one wheel, and the other's reversed"""
    clear: float = 0.08
    """nearness below which a side is clear"""
    after: float = 0.4
    """seconds to turn on once both are clear"""

    def enter(self, robot: Robot) -> None:
        left, right = left_nearness(robot) or 0.0, right_nearness(robot) or 0.0
        self.turns_left = self.chance(0.5) if left == right else right > left
        self._until = robot.time + self.after

    def step(self, robot: Robot) -> None:
        left, right = left_nearness(robot) or 0.0, right_nearness(robot) or 0.0
        if max(left, right) >= self.clear:
            self._until = robot.time + self.after
        # its utility falls as soon as things are out of sight: gamma holds it until the turn is done
        self.kick(self, HOLD if robot.time < self._until else 0.0)
        turn = -self.turn if self.turns_left else self.turn
        robot.drive(turn, -turn)
