"""How far odometry may have drifted: it grows with the way since the pose was last set right."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable
from boebot.cognition.odometry import Odometry

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Drift(CognitiveProcess):
    """Estimates how far odometry has drifted since it was last set right: z = 1 - e^(-s/s_0), s the way since then.

    Args:
        distance: s_0 (m).
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        value: the estimate, 0 to 1.
    """

    distance: float = 10.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "distance")

    def forget(self) -> None:
        self.value = 0.0

    def enter(self, robot: Robot) -> None:
        self.set_right()

    def step(self, robot: Robot) -> None:
        self.value = 1 - math.exp(-(self.other(Odometry).travelled - self._from) / self.distance)

    def set_right(self) -> None:
        """Called when the pose has been corrected."""
        self._from = self.other(Odometry).travelled
        self.value = 0.0

    def variable(self) -> StateVariable:
        """State variable "drift": `value` as of the last step."""
        return StateVariable("drift", self._drifted)

    def _drifted(self, robot: Robot) -> float:
        return self.value
