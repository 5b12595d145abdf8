"""Light from the left and from the right: how bright it is, and which side is brighter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class LightSense(CognitiveProcess):
    """Compares both light sensors.

    Args:
        scale: brightness that counts as half of full light in the state variable.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        left: brightness of the left one; None: not known.
        right: of the right one.
        asymmetry: (left - right) / (left + right), -1 to 1; 0 in the dark and where nothing is known.
    """

    NEEDS = ("lights",)

    scale: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "scale")

    def forget(self) -> None:
        self.left: float | None = None
        self.right: float | None = None
        self.asymmetry = 0.0

    def enter(self, robot: Robot) -> None:
        self.forget()

    def step(self, robot: Robot) -> None:
        left, right = robot.light_left, robot.light_right
        self.left = left.brightness if left.valid else None
        self.right = right.brightness if right.valid else None
        both = (self.left or 0.0) + (self.right or 0.0)
        known = self.left is not None and self.right is not None and both > 0
        self.asymmetry = ((self.left or 0.0) - (self.right or 0.0)) / both if known else 0.0

    def variable(self) -> StateVariable:
        """State variable "light": I / (I + scale) of the brighter side, as of the last step."""
        return StateVariable("light", self._light, self.NEEDS)

    def _light(self, robot: Robot) -> float:
        brighter = max(self.left or 0.0, self.right or 0.0)
        return brighter / (brighter + self.scale)
