"""Stand still."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Stop(MotorBehavior):
    """Motors off.

    Args:
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    def step(self, robot: Robot) -> None:
        robot.stop()
