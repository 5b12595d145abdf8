"""Wandering: code listings 5.1 and 5.2 of the notes.

Straight ahead; now and then, by chance, a turn on the spot to a side and for a time that chance chooses. Alone it is
for empty space: it looks at nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.machine import Machine, State
from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.robot import Robot

PER_S = 0.01  # the notes' step, which their probabilities are meant for


@dataclass(kw_only=True)
class Wander(MotorBehavior):
    """Drives straight, and turns on the spot now and then, by chance.

    The parameters are the notes'; where a robot is a fifth as fast, `turn_probability` 0.002 gives the same paths.

    Args:
        forward: motor signal of both wheels.
        turn: motor signal of one wheel, and the other's reversed.
        turn_probability: to begin to turn, in each 0.01 s.
        stop_turn_probability: to stop turning, in each 0.01 s.
        left_turn_probability: of a turn to the left rather than to the right.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        left: it turns, or turned last, to the left.
    """

    forward: float = 0.5
    turn: float = 0.7
    turn_probability: float = 0.01
    stop_turn_probability: float = 0.03
    left_turn_probability: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.signals(self, "forward", "turn")
        checks.shares(self, "turn_probability", "stop_turn_probability", "left_turn_probability")

    def forget(self) -> None:
        self.left = False

    def enter(self, robot: Robot) -> None:
        self.machine = Machine(robot, self.start_forward)

    def step(self, robot: Robot) -> None:
        self.machine.step(robot)

    def start_forward(self, robot: Robot) -> State:
        """State 0 of the listing."""
        robot.drive(self.forward, self.forward)
        return self.time_to_turn

    def time_to_turn(self, robot: Robot) -> State | None:
        """State 1."""
        if not self.chance(self.turn_probability, per=PER_S):
            return None
        self.left = self.chance(self.left_turn_probability)
        turn = -self.turn if self.left else self.turn
        robot.drive(turn, -turn)
        return self.time_to_stop_turning

    def time_to_stop_turning(self, robot: Robot) -> State | None:
        """State 2."""
        return self.start_forward if self.chance(self.stop_turn_probability, per=PER_S) else None
