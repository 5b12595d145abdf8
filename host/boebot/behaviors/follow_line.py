"""Follow a dark line on the floor with three line sensors (the kit's own law; the notes have no line).

The sensors say on which side of the robot's middle the line lies:

    e = -1 (left), -1/2 (left and middle), 0 (middle), 1/2 (middle and right), 1 (right)
    s_L = s_0 + k e,   s_R = s_0 - k e

A line that is out of sight was lost on the side where it was seen last: e keeps its sign and becomes 2. After a while
without a line the robot stops.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.behaviors.straight_run import within_signals
from boebot.brain import checks
from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.robot import Robot

LOST = 2.0  # e of a line that is out of sight


@dataclass(kw_only=True)
class FollowLine(MotorBehavior):
    """Keeps a dark line under the middle one of its three line sensors.

    Args:
        signal: s_0, motor signal straight on.
        gain: k, motor signal for each unit of the line's place off the middle.
        patience: s without a line after which it stops.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    NEEDS = ("lines",)

    signal: float = 0.35
    gain: float = 0.3
    patience: float = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.signals(self, "signal", "gain")
        checks.not_negative(self, "patience")

    def enter(self, robot: Robot) -> None:
        self._error = 0.0
        self._seen_s = robot.time

    def step(self, robot: Robot) -> None:
        error = line_error(robot)
        if error is not None:
            self._error, self._seen_s = error, robot.time
        elif robot.time > self._seen_s + self.patience:
            robot.drive(0.0, 0.0)
            return
        elif self._error:
            self._error = math.copysign(LOST, self._error)
        correction = self.gain * self._error
        robot.drive(within_signals(self.signal + correction), within_signals(self.signal - correction))


def line_error(robot: Robot) -> float | None:
    """Where the line lies: e, from -1 (left) to 1 (right); None: no sensor sees it."""
    sensors = (robot.line_left, robot.line_middle, robot.line_right)
    dark = [side for side, sensor in zip((-1.0, 0.0, 1.0), sensors, strict=True) if sensor.valid and sensor.dark]
    return sum(dark) / len(dark) if dark else None
