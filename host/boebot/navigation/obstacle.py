"""What blocks the way: something right before the robot, by its whiskers and by sonars near the floor (the process
"Proximity detection" of section 6.1 of the notes)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from boebot.robot import Robot

SONARS = ("ping", "ping_left", "ping_right")  # names of those that look where a robot drives


def is_blocked(robot: Robot, near: float, sonars: Sequence[str] = SONARS) -> bool:
    """Whether something is before the robot.

    Args:
        near: distance from a sonar (m).
        sonars: their names; those that the robot has not are left out.
    """
    if robot.has("whiskers") and (robot.whisker_left.pressed or robot.whisker_right.pressed):
        return True
    seen = [getattr(robot, name) for name in sonars if robot.has(name)]
    return any(one.too_near or (one.distance is not None and one.distance < near) for one in seen)
