"""A stuck robot: the motors are commanded to move it, and it does not move."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable
from boebot.cognition.odometry import Odometry, wrapped

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class StuckDetector(CognitiveProcess):
    """Compares what was asked of the wheels over some time with what odometry says came of it.

    Wheels that spin without the robot moving are only seen where odometry comes from something else than wheels.
    Odometry that comes from commands (`Odometry.source`) believes what was asked: with it, nothing is ever missing.

    Args:
        window: s over which motion is compared.
        least: share of the robot's full speed below which nothing is asked of it.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        share: how much of the asked motion is missing over the time, 0 (moves as commanded) to 1 (stands still).
    """

    window: float = 1.0
    least: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "window", "least")

    def forget(self) -> None:
        self.share = 0.0

    def enter(self, robot: Robot) -> None:
        self.forget()
        self._past: deque[tuple[float, float, float]] = deque()  # time, asked and made so far (m)
        self._asked = self._made = 0.0
        self._time = robot.time
        self._heading = self.other(Odometry).heading

    def step(self, robot: Robot) -> None:
        odometry, dimensions = self.other(Odometry), robot.dimensions
        elapsed, self._time = robot.time - self._time, robot.time
        kind, left, right = robot.command
        full = dimensions.speed if kind == "signal" else 1.0
        wanted = 0.0 if kind == "stop" else (abs(left) + abs(right)) / 2 * full
        turned = wrapped(odometry.heading - self._heading)
        self._heading = odometry.heading
        if wanted >= self.least * dimensions.speed:
            self._asked += wanted * elapsed
            # a wheel's mean way: along the robot's path, or about its middle
            self._made += max(abs(odometry.speed) * elapsed, abs(turned) * dimensions.track_width / 2)
        self._past.append((robot.time, self._asked, self._made))
        while robot.time - self._past[0][0] > self.window + 1e-9:
            self._past.popleft()
        begun, asked, made = self._past[0]
        asked, made = self._asked - asked, self._made - made
        full_window = robot.time - begun > 0.9 * self.window
        self.share = min(max(1 - made / asked, 0.0), 1.0) if full_window and asked > 0 else 0.0

    def variable(self) -> StateVariable:
        """State variable "stuck": `share` as of the last step."""
        return StateVariable("stuck", self._missing)

    def _missing(self, robot: Robot) -> float:
        return self.share
