"""Obstacle avoidance by infra-red sensors (chapter 4 of the notes; law of section 4.9 of the specification)."""

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
    clear: float = 0.15
    """nearness below which a side is clear"""
    after: float = 0.2
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
