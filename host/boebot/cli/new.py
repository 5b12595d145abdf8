"""`boebot new NAME`: writes a first brain to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.brains import bundled
from boebot.errors import BrainError

FIRST_BRAIN = '''"""{name}: backs away from what its whiskers touch and turns away from what infra-red sees.

Run it:    boebot run {file} --out {stem}
Watch it:  open {stem}/replay.html in a browser
"""

from boebot import Robot

PERIOD = 0.05  # seconds from one step to the next
NEEDS = ["whiskers", "infrared"]  # a robot without them is refused


def step(robot: Robot) -> None:
    """Called every PERIOD: look at the sensors, drive the motors (-1 full backward ... 1 full forward)."""
    if robot.left_whisker.pressed or robot.right_whisker.pressed:
        robot.drive(-0.6, -0.2)
    elif robot.left_ir.detected:
        robot.drive(0.5, -0.5)
    elif robot.right_ir.detected:
        robot.drive(-0.5, 0.5)
    else:
        robot.drive(0.5, 0.5)

    # More to look at:  robot.ping.distance (m, or None)    robot.left_encoder.count    robot.time (s)
    # More to do:       robot.drive_speed(0.1, 0.1) (m/s)   robot.stop()                robot.chance(0.02)
'''


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Letters, digits and underscores.")],
) -> None:
    """Write a first brain, NAME.py, to start from."""
    stem = name.removesuffix(".py")
    if not stem.isidentifier():
        raise BrainError(f"{stem!r} cannot be a brain's name; expected letters, digits and underscores")
    if stem in bundled():
        raise BrainError(f"{stem!r} is the name of a bundled brain; expected another one")
    path = Path(f"{stem}.py")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(FIRST_BRAIN.format(name=stem, file=path, stem=stem))
    except FileExistsError:
        raise BrainError(f"{path} exists already; it was left as it is") from None
    except OSError as error:
        raise BrainError(f"{path} cannot be written: {error.strerror}") from None
    print(f"wrote {path}; now: boebot run {path} --out {stem}")
