"""Path integration as desert ants do it: where home is, from compass headings and the way of the wheels (notes,
section 4.4.4).

    h = -Σ Δs_k (cos φ_k, sin φ_k)

Δs_k is the way that the wheels have rolled since the last step, φ_k the heading by the compass. A compass errs by as
much on the last metre as on the first: h drifts far less than the pose of wheels alone, whose heading errors add up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable
from boebot.cognition.odometry import Odometry, wrapped
from boebot.cognition.sun_compass import SunCompass

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class PathIntegration(CognitiveProcess):
    """Keeps the home vector. Home is where the robot is when this begins, or when `set_home` is called.

    Comes after the brain's Odometry, which gives it the way; its heading is used only while the compass says nothing.

    Args:
        scale: m of distance from home at which the state variable is 0.63.
        sky: takes the heading from the brain's SunCompass.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        vector: h, from the robot to home (m east, m north: along the compass's 0 and π/2).
        travelled: m of way since then, both forward and backward.
        heading: rad in (-pi, pi], by the compass.
    """

    NEEDS = ("compass",)

    scale: float = 1.0
    sky: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "scale")

    def forget(self) -> None:
        self.set_home()
        self.heading = 0.0

    def set_home(self) -> None:
        """Home is here."""
        self.vector = (0.0, 0.0)
        self.travelled = 0.0

    @property
    def distance(self) -> float:
        """|h| (m)."""
        return math.hypot(*self.vector)

    @property
    def direction(self) -> float:
        """Where home lies (rad in (-pi, pi], as the compass counts); 0 at home."""
        return math.atan2(self.vector[1], self.vector[0])

    @property
    def position(self) -> tuple[float, float]:
        """Where the robot is, seen from home (m): -h."""
        return -self.vector[0], -self.vector[1]

    def enter(self, robot: Robot) -> None:
        self.forget()
        odometry = self.other(Odometry)
        self._pose = odometry.pose
        read = self._read(robot)
        self._is_aligned = read is not None
        self.heading = odometry.heading if read is None else read

    def step(self, robot: Robot) -> None:
        (x, y, heading), now = self._pose, self.other(Odometry).pose
        self._pose = now
        turned = wrapped(now[2] - heading)
        along = (now[0] - x) * math.cos(heading + turned / 2) + (now[1] - y) * math.sin(heading + turned / 2)
        way = math.copysign(math.dist(now[:2], (x, y)), along)
        read = self._read(robot)
        if read is not None and not self._is_aligned:
            self._align(wrapped(read - self.heading - turned))
        after = wrapped(self.heading + turned) if read is None else read
        # the heading in the middle of the step, as in the midpoint rule of odometry
        middle = self.heading + wrapped(after - self.heading) / 2
        self.heading = after
        self.vector = (self.vector[0] - way * math.cos(middle), self.vector[1] - way * math.sin(middle))
        self.travelled += abs(way)

    def _align(self, angle: float) -> None:
        """The compass has spoken for the first time: headings until then were counted from another zero."""
        self._is_aligned = True
        x, y = self.vector
        cos, sin = math.cos(angle), math.sin(angle)
        self.vector = (x * cos - y * sin, x * sin + y * cos)
        self.heading = wrapped(self.heading + angle)

    def _read(self, robot: Robot) -> float | None:
        if self.sky:
            heading = self.other(SunCompass).heading
        else:
            compass = robot.compass
            heading = compass.heading if compass.valid else None
        return None if heading is None or not math.isfinite(heading) else wrapped(heading)

    def variable(self) -> StateVariable:
        """State variable "away": 1 - e^(-|h| / scale), as of the last step."""
        return StateVariable("away", self._away, self.NEEDS)

    def _away(self, robot: Robot) -> float:
        return 1 - math.exp(-self.distance / self.scale)
