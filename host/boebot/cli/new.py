"""`boebot new NAME`: writes a brain to start from: a first one, one that runs from top to bottom, or one of several
behaviors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.brains import bundled
from boebot.cli import output
from boebot.errors import BrainError

FIRST_BRAIN = '''"""{name}: backs away from what its whiskers touch and turns away from what infra-red sees.

Watch it:  boebot run {file} --view
Keep it:   boebot run {file} --out {stem}
"""

from boebot import Robot

PERIOD = 0.05  # seconds from one step to the next
NEEDS = ["whiskers", "infrared"]  # a robot without them is refused


def step(robot: Robot) -> None:
    """Called every PERIOD: look at the sensors, drive the motors (-1 full backward ... 1 full forward)."""
    if robot.whisker_left.pressed or robot.whisker_right.pressed:
        robot.drive(-0.6, -0.2)
    elif robot.infrared_left.detected:
        robot.drive(0.5, -0.5)
    elif robot.infrared_right.detected:
        robot.drive(-0.5, 0.5)
    else:
        robot.drive(0.5, 0.5)

    # More to look at:  robot.ping.distance (m, or None)    robot.encoder_left.count    robot.time (s)
    # More to do:       robot.drive_speed(0.1, 0.1) (m/s)   robot.stop()                robot.chance(0.02)
'''

FROM_TOP = '''"""{name}: drives a square, then goes on until a whisker touches something.

Watch it:  boebot run {file} --view
Keep it:   boebot run {file} --out {stem}
"""

from boebot import MainRobot

NEEDS = ["whiskers"]  # a robot without them is refused


def main(robot: MainRobot) -> None:
    """Runs once, from top to bottom; the run ends when it returns. Between two waits it may not take long."""
    for _ in range(4):
        robot.forward(0.2)  # m
        robot.turn(90)  # degrees, to the left

    robot.drive(0.5, 0.5)  # motor signals, -1 full backward ... 1 full forward; they hold until the next ones
    if robot.wait_until(lambda: robot.whisker_left.pressed or robot.whisker_right.pressed, timeout=20):
        robot.forward(-0.1)
        robot.turn(180)
    robot.stop()

    # More to look at:  robot.ping.distance (m, or None)    robot.encoder_left.count    robot.time (s)
    # More to do:       robot.wait(0.5) (s)                 robot.drive_speed(0.1, 0.1) (m/s)
'''

SEVERAL_BEHAVIORS = '''"""{name}: wanders, turns away from near things, and backs off from what it touches.

Of the motor behaviors, the one of the highest utility drives. A utility follows tanh(b + sum of w * state variable +
gamma) with a lag of tau seconds; gamma is what `kick` sets, and decays.

Watch it:  boebot run {file} --view
Keep it:   boebot run {file} --out {stem}
"""

from dataclasses import dataclass

from boebot import Robot
from boebot.behaviors import Avoid, Wander
from boebot.brain import Brain, MotorBehavior, StateVariable, Utility
from boebot.cognition import contact, near


@dataclass(kw_only=True)
class BackOff(MotorBehavior):
    """A behavior of your own: back, turning a little."""

    NEEDS = ("whiskers",)  # a robot without them is refused

    signal: float = 0.6  # a parameter: a motor signal

    def enter(self, robot: Robot) -> None:
        """Called when it becomes the active one."""
        self.until = robot.time + 0.8  # s

    def step(self, robot: Robot) -> None:
        """Called at each step while it is active: look at the sensors, drive the motors (-1 ... 1)."""
        robot.drive(-self.signal, -0.3 * self.signal)
        if robot.time < self.until:
            self.kick(self, 5.0)  # keep going, even when nothing is touched any more


# State variables: numbers from 0 to 1, made of what sensors say. More of them: StateVariable("late", read), where
# read(robot) gives the number.
variables: list[StateVariable] = [near(), contact()]

brain = Brain(
    [
        Wander(turn_probability=0.002, utility=Utility(b=0.5)),
        Avoid(utility=Utility(b=-1.0, w={{"near": 3.0}}, tau=0.1)),
        BackOff(utility=Utility(b=-1.0, w={{"contact": 4.0}}, tau=0.05)),
    ],
    variables,
    period=0.05,  # seconds from one step to the next
)
'''


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Letters, digits and underscores.")],
    brain: Annotated[bool, typer.Option("--brain", help="A brain of several behaviors, chosen by utility.")] = False,
    main: Annotated[bool, typer.Option("--main", help="A brain that runs from top to bottom: main(robot).")] = False,
) -> None:
    """Write a brain, NAME.py, to start from."""
    if brain and main:
        raise BrainError("--brain and --main are two kinds of brain; expected one of them")
    template = SEVERAL_BEHAVIORS if brain else FROM_TOP if main else FIRST_BRAIN
    stem = name.removesuffix(".py")
    if not stem.isidentifier():
        raise BrainError(f"{stem!r} cannot be a brain's name; expected letters, digits and underscores")
    if stem in bundled():
        raise BrainError(f"{stem!r} is the name of a bundled brain; expected another one")
    path = Path(f"{stem}.py")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(template.format(name=stem, file=path, stem=stem))
    except FileExistsError:
        raise BrainError(f"{path} exists already; it was left as it is") from None
    except OSError as error:
        raise BrainError(f"{path} cannot be written: {error.strerror}") from None
    output.line(f"wrote {path}; now: boebot run {path} --view")
