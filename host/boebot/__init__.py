"""boebot: drive a Boe-Bot class robot, or its emulated twin, from Python.

import boebot


def step(robot):
    robot.drive(0.5, 0.5)


result = boebot.run(step, on="native", seconds=10)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from boebot import boards
    from boebot.brain.main_brain import MainRobot
    from boebot.description.robots import load_robot
    from boebot.errors import BoebotError
    from boebot.record.result import RunResult, TogetherResult
    from boebot.robot import Command, Observation, Robot
    from boebot.running.runner import run
    from boebot.running.tasks import Member
    from boebot.running.together import run_together
    from boebot.showing import Grid

    __version__: str

__all__ = [
    "BoebotError",
    "Command",
    "Grid",
    "MainRobot",
    "Member",
    "Observation",
    "Robot",
    "RunResult",
    "TogetherResult",
    "boards",
    "load_robot",
    "run",
    "run_together",
]

# Loaded when first asked for: the command catches Ctrl-C before numpy and the rest take their time.
_HOMES = {
    "BoebotError": "errors",
    "Command": "robot",
    "Grid": "showing",
    "MainRobot": "brain.main_brain",
    "Member": "running.tasks",
    "Observation": "robot",
    "Robot": "robot",
    "RunResult": "record.result",
    "load_robot": "description.robots",
    "TogetherResult": "record.result",
    "run": "running.runner",
    "run_together": "running.together",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("boebot.resources").version()
    if name == "boards":
        return import_module("boebot.boards")
    if name not in _HOMES:
        raise AttributeError(f"module 'boebot' has no attribute {name!r}")
    value = getattr(import_module(f"boebot.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
