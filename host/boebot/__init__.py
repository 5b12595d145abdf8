"""Drive a Boe-Bot class robot, or its emulated twin, from Python.

    import boebot

    def step(robot: boebot.Robot) -> None:
        robot.drive(0.5, 0.5)

    result = boebot.run(step, on="native", seconds=10)

What to call for what:

    boebot.run(brain)              one robot; gives a RunResult: figures, arrays, plot(), replay(), save(folder)
    boebot.run_together(members)   several Members in one world; gives a TogetherResult
    boebot.Robot                   what `step(robot)` is given: sensors, motors, clock, chance, show, sketch
    boebot.MainRobot               what `main(robot)` is given: the same, and wait, forward, turn
    boebot.Grid                    a map to sketch on the arena
    boebot.load_robot(name)        a robot's description: devices, geometry, pins
    boebot.boards                  boards and vehicles to step by hand
    boebot.BoebotError             what went wrong, in a sentence

    boebot.brain                   Brain: processes chosen by utility, state machines, fixed action patterns
    boebot.behaviors               motor behaviors for it: Wander, Avoid, FollowWall, Homing, ...
    boebot.cognition               what it works out: Odometry, near(), contact(), ...
    boebot.link                    a board's messages, parameters and time
    boebot.result                  read_run(folder): the result of a run that was recorded

Units are SI: m, s, rad, V; motor signals go from -1 (full backward) to 1 (full forward).
"""

import atexit
from importlib import import_module
from typing import TYPE_CHECKING, Any

from boebot import slips

if TYPE_CHECKING:
    from boebot import boards as boards
    from boebot.brain.main_brain import MainRobot as MainRobot
    from boebot.description.robots import load_robot as load_robot
    from boebot.errors import BoebotError as BoebotError
    from boebot.result import RunResult as RunResult
    from boebot.result import TogetherResult as TogetherResult
    from boebot.robot import Command as Command
    from boebot.robot import Observation as Observation
    from boebot.robot import Robot as Robot
    from boebot.running.runner import run as run
    from boebot.running.runner import run_together as run_together
    from boebot.running.tasks import Member as Member
    from boebot.showing import Grid as Grid

    __version__: str

# Loaded when first asked for: the command catches Ctrl-C before numpy and the rest take their time.
_HOMES = {
    "BoebotError": "errors",
    "Command": "robot",
    "Grid": "showing",
    "MainRobot": "brain.main_brain",
    "Member": "running.tasks",
    "Observation": "robot",
    "Robot": "robot",
    "RunResult": "result",
    "load_robot": "description.robots",
    "TogetherResult": "result",
    "run": "running.runner",
    "run_together": "running.runner",
}
__all__ = ["boards", *_HOMES]


atexit.register(slips.say_unrun)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("boebot.resources").version()
    if name == "boards":
        return import_module("boebot.boards")
    if name not in _HOMES:
        guests = import_module("boebot.guests")
        if name in (functions := guests.guests(guests.FUNCTIONS)):
            return functions[name].load()
        raise AttributeError(f"module 'boebot' has no attribute {name!r}")
    value = getattr(import_module(f"boebot.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
