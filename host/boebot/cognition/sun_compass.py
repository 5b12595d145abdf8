"""A compass by the sky, as desert ants have it: the sun's pattern turns, and an ephemeris function makes up for it.

    φ = θ_sky + ψ(t),   ψ(t) = ψ_0 + ω_s t,   ω_s = 2π / 86,400 s

θ_sky is the heading against the pattern, ψ the sun's azimuth, assumed to grow evenly through the day (notes,
section 4.4.4). Here a magnetic or given heading plays the sky's part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain.process import CognitiveProcess
from boebot.cognition.odometry import wrapped

if TYPE_CHECKING:
    from boebot.robot import Robot

DAY_S = 86_400.0


def sun_azimuth(time: float, at_start: float = 0.0) -> float:
    """ψ(t): the sun's azimuth, rad in (-pi, pi].

    Args:
        time: s since it was `at_start`.
        at_start: ψ_0 (rad).
    """
    return wrapped(at_start + 2 * math.pi / DAY_S * time)


@dataclass(kw_only=True)
class SunCompass(CognitiveProcess):
    """Heading from the sky's pattern and the time of day.

    Args:
        azimuth_at_start: ψ_0 (rad).
        turning: the compass shows a pattern that turns with the sun; False: it shows the heading itself.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        heading: rad in (-pi, pi], or None while the sky has not been seen.
    """

    NEEDS = ("compass",)

    azimuth_at_start: float = 0.0
    turning: bool = False

    def forget(self) -> None:
        self.heading: float | None = None

    def enter(self, robot: Robot) -> None:
        self.forget()

    def step(self, robot: Robot) -> None:
        compass = robot.compass
        if compass.valid and compass.heading is not None:
            azimuth = sun_azimuth(robot.time, self.azimuth_at_start) if self.turning else 0.0
            self.heading = wrapped(compass.heading + azimuth)
