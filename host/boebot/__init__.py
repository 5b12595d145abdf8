"""boebot: drive a Boe-Bot class robot, or its emulated twin, from Python.

import boebot


def step(robot):
    robot.drive(0.5, 0.5)


result = boebot.run(step, on="native", seconds=10)
"""

from boebot import boards
from boebot.errors import BoebotError
from boebot.result import RunResult
from boebot.robot import Command, Observation, Robot
from boebot.robots import load_robot
from boebot.runner import run

__all__ = ["BoebotError", "Command", "Observation", "Robot", "RunResult", "boards", "load_robot", "run"]
