"""The whole circle: firmware on an emulated board, its devices as parts at the pins, their models in an arena.

A test builds an arena, puts a robot with its own description into it, and speaks with the board as with any other.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec

from boebot.arenas import Arena, ArenaDescription, Disc, Light, Patch, Polygon
from boebot.description.robots import RobotDescription, load_robot
from sim_bridge.boards import avr
from sim_bridge.boards.emulated import avr_image, native_board, native_library
from sim_bridge.sessions.session import SimSession
from sim_bridge.sim import Sim, SimRobot
from sim_bridge.tests.rigs import SessionRig

WALL_THICKNESS_M = 0.05


def arena_of(
    *obstacles: Polygon,
    light: Sequence[Light] = (),
    disc: Sequence[Disc] = (),
    patch: Sequence[Patch] = (),
) -> Arena:
    """A field with those things in it."""
    return Arena(
        ArenaDescription(name="circle", obstacle=list(obstacles), light=[*light], disc=[*disc], patch=[*patch])
    )


def block(left: float, low: float, right: float, high: float, height: float | None = None) -> Polygon:
    """A rectangular obstacle from (left, low) to (right, high)."""
    return Polygon([(left, low), (right, low), (right, high), (left, high)], height_m=height)


def wall_at(x: float, height: float | None = None) -> Polygon:
    """A wall across the x axis whose face towards the origin is at x > 0."""
    return block(x, -3.0, x + WALL_THICKNESS_M, 3.0, height)


class CircleRig(SessionRig):
    """A rig whose board sits in a robot in an arena."""

    @property
    def robot(self) -> SimRobot:
        """The robot in its world."""
        robot: SimRobot = self.session.robot
        return robot

    def place(self, x: float, y: float, heading: float = 0.0) -> None:
        """Puts the robot elsewhere."""
        self.robot.place(x, y, heading)


def robot_of(name: str = "boebot", **changes: dict[str, Any]) -> RobotDescription:
    """A bundled robot with some keys of some devices (or of `body`, `supply`) changed."""
    robot = load_robot(name)
    device = dict(robot.device)
    whole: dict[str, Any] = {}
    for part, keys in changes.items():
        if part in device:
            device[part] = msgspec.structs.replace(device[part], **keys)
        else:
            whole[part] = msgspec.structs.replace(getattr(robot, part), **keys)
    return msgspec.structs.replace(robot, device=device, **whole)


@contextlib.contextmanager
def circle(
    url: str,
    arena: Arena,
    robot: RobotDescription | None = None,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    noise: bool = False,
    seed: int = 1,
    imperfections: Mapping[str, float] | None = None,
) -> Iterator[CircleRig]:
    """The robot (boebot) in the arena, its board greeted and armed."""
    description = load_robot("boebot") if robot is None else robot
    sim = Sim(arena, seed=seed, noise=noise)
    pins = description.pin_map
    board = avr.create(avr_image(pins)) if url == "avr" else native_board(native_library(pins))
    rig = CircleRig(SimSession(sim.add(board, description, pose=pose, imperfections=imperfections), url, SimRobot.wait))
    with rig:
        rig.start()
        yield rig
