"""Brains and processes stepped without a board: a robot whose readings a test gives, step by step."""

from __future__ import annotations

from boebot.brain import Brain, MotorBehavior, Process
from boebot.link import messages
from boebot.robot import Command, Equipment, Observation, Robot
from boebot.robots import RobotDescription, load_robot

SHIELDBOT = load_robot("shieldbot")
TICK_S = 0.01
NOTHING = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))


class Stepped:
    """A robot, and the time that goes on by the brain's period with each step.

    Attributes:
        robot: what the brain meets.
        steps: how many there have been.
    """

    def __init__(self, period: float = 0.01, seed: int = 1, description: RobotDescription = SHIELDBOT) -> None:
        self.robot = Robot(description.name, period, seed)
        self.steps = 0
        self._equipment = Equipment(description, TICK_S)
        self.see()

    def see(self, **fields: int) -> None:
        """What the sensors say from now on: fields of telemetry."""
        sample = NOTHING._replace(tick=self.steps, **fields)
        self.robot.observation = Observation(sample, self._equipment, time=self.steps * self.robot.period)

    def step(self, brain: Brain, **fields: int) -> Command:
        """One step of the brain; its command."""
        self.see(**fields)
        brain.step(self.robot)
        self.steps += 1
        return self.robot.command


def alone(behavior: MotorBehavior, *others: Process) -> Brain:
    """A brain of one motor behavior, and cognitive processes."""
    return Brain([behavior, *others])
