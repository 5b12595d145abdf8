"""`boebot teleop`: drives by keyboard. Keys act while they are held; let go, and the robot stops. Space stops it and
latches its motors off; moving again arms them."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, TextIO

import typer

from boebot import system
from boebot.cli import options, output
from boebot.cli.ending import detail, end
from boebot.errors import BoebotError
from boebot.record import run_folder
from boebot.robot import Robot
from boebot.running.tasks import Request

HOLD_S = 0.6  # a key counts as held: terminals begin to repeat it after half a second
TURN = 0.35
HELP = "arrows or W A S D drive, 1..9 set the speed, space stops and latches, Q ends"
_ARROWS = {"A": "w", "B": "s", "C": "d", "D": "a"}  # last byte of an arrow key's escape sequence
_MOVES = {"w": (1.0, 1.0), "s": (-1.0, -1.0), "a": (-TURN, TURN), "d": (TURN, -TURN)}


class Keyboard:
    """The brain behind `boebot teleop`: turns keys into motor signals."""

    PERIOD = 0.05

    def __init__(self, read_keys: Callable[[], str], show: Callable[[str], None]) -> None:
        self._read_keys = read_keys
        self._show = show
        self._speed = 0.5
        self._move = (0.0, 0.0)
        self._until = 0.0
        self.ended = False  # by Q

    def step(self, robot: Robot) -> None:
        """One look at the keys."""
        for key in keys(self._read_keys()):
            if key == "q":
                self.ended = True
                raise KeyboardInterrupt
            if key in _MOVES:
                self._move = _MOVES[key]
                self._until = time.perf_counter() + HOLD_S
                robot.arm()
            elif key == " ":
                self._until = 0.0
                robot.emergency_stop()
            elif key in "123456789":
                self._speed = int(key) / 9
        if time.perf_counter() < self._until:
            left, right = self._move
            robot.drive(left * self._speed, right * self._speed)
        else:
            robot.stop()
        self._show(sensors(robot))


def keys(typed: str) -> Iterator[str]:
    """What was typed, key by key; arrow keys become w, a, s, d."""
    rest = iter(typed.replace("\x1bO", "\x1b["))
    for letter in rest:
        if letter == "\x1b":
            if next(rest, "") == "[":
                yield _ARROWS.get(next(rest, ""), "")
        elif letter == "\x03":
            yield "q"
        else:
            yield letter.lower()


def sensors(robot: Robot) -> str:
    """One line about what the robot senses."""
    drive = "stopped, latched  " if robot.latched else f"drive {robot.command.left:+.2f} {robot.command.right:+.2f}"
    parts = [f"{robot.time:7.1f} s", drive]
    equipment = robot.observation.equipment
    for group, device, sign in (("whiskers", "whisker", "pressed"), ("infrared", "infrared", "detected")):
        if equipment.has(group):
            is_on = {side: getattr(getattr(robot, f"{device}_{side}"), sign) for side in ("left", "right")}
            parts.append(f"{group} {'L' if is_on['left'] else '·'}{'R' if is_on['right'] else '·'}")
    if equipment.has("ping"):
        distance = robot.ping.distance
        unknown = robot.ping.status.name.lower().replace("_", " ")
        parts.append(f"ping {unknown}" if distance is None else f"ping {distance:4.2f} m")
    if equipment.has("encoders"):
        parts.append(f"encoders {robot.encoder_left.count} {robot.encoder_right.count}")
    return "   ".join(parts)


def teleop(
    on: options.RunOn = None,
    robot: options.RobotName = "shieldbot",
    arena: options.ArenaName = None,
    seed: options.Seed = 1,
    without: options.Without = None,
    imperfection: options.Imperfections = None,
    seconds: Annotated[float, options.time("End by itself after this time.")] = float("inf"),
    view: options.View = False,
    view_port: options.ViewPort = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Where to write the record.")] = None,
    json: options.Json = False,
    verbose: options.Verbose = False,
) -> None:
    """Drive by keyboard: arrows or W A S D, 1..9 for the speed, space to stop, Q to end."""
    wanted = detail(json=json, verbose=verbose, quiet=False)
    if not sys.stdin.isatty():
        raise BoebotError("teleop needs a keyboard, but its input is not a terminal")
    screen = sys.stderr if json else sys.stdout  # JSON stands alone on standard output
    output.line(HELP, screen)
    with run_folder.locked(out) as folder:
        with system.raw_keyboard() as read_keys:
            brain = Keyboard(read_keys, functools.partial(_show, screen))
            request = Request.single(
                brain,
                robot=robot,
                arena=arena,
                on=on,
                seconds=seconds,
                seed=seed,
                realtime=True,
                without=options.names(without),
                imperfections=options.magnitudes(imperfection),
            )
            with options.runner(view=view, speed=None, port=view_port, waits=False) as run:
                result = run(request, None, folder)
        with contextlib.suppress(OSError):  # a terminal that has gone must not cost the record
            output.line(file=screen)
        end(dataclasses.replace(result, brain="keyboard", error=None if brain.ended else result.error), out, wanted)


def _show(screen: TextIO, line: str) -> None:
    width = max(20, os.get_terminal_size(screen.fileno()).columns - 1) if screen.isatty() else 200
    print("\r" + line[:width].ljust(width), end="", file=screen, flush=True)
