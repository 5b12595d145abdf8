"""How much is left in the battery, by its voltage, which sags while motors run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class BatteryLevel(CognitiveProcess):
    """Filters the pack's voltage and makes a level of it.

    Attributes:
        level: 0 (empty) to 1 (full), or None before the first reading.
    """

    NEEDS = ("battery",)

    empty: float
    """volts at which the robot should have stopped"""
    full: float
    """volts of the full pack at rest"""
    tau: float = 2.0
    """time constant (s) of the filter: servos draw their current in pulses"""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.level: float | None = None

    def enter(self, robot: Robot) -> None:
        self.level = None
        self._time = robot.time

    def step(self, robot: Robot) -> None:
        elapsed, self._time = robot.time - self._time, robot.time
        battery = robot.battery
        if not battery.valid or battery.voltage is None:
            return
        now = min(max((battery.voltage - self.empty) / (self.full - self.empty), 0.0), 1.0)
        self.level = now if self.level is None else now + (self.level - now) * math.exp(-elapsed / self.tau)

    def variable(self) -> StateVariable:
        """State variable "low": 1 - level, as of the last step; 0 before the first reading."""
        return StateVariable("low", lambda robot: None if self.level is None else 1 - self.level, self.NEEDS)
