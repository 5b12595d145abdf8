"""Kinesis: how active an animal is depends on the stimulus, where it goes does not (notes, section 4.4.2).

Wood lice hurry where it is dry and linger where it is humid:

    V = V_max (1 - H) + V_min H,   dφ = σ √Δt ξ

A heading that wanders alike everywhere makes the density at a place proportional to 1/V there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Kinesis(MotorBehavior):
    """Slow where the stimulus is strong.

    Args:
        stimulus: H, from 0 to 1. None: nothing is known, 0.
        fast: motor signal without stimulus.
        slow: motor signal at the full stimulus.
        spread: σ (rad/√s) of the heading's random walk.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    stimulus: Callable[[Robot], float | None]
    fast: float = 0.5
    slow: float = 0.1
    spread: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.signals(self, "fast", "slow")
        checks.not_negative(self, "spread")

    def step(self, robot: Robot) -> None:
        stimulus = min(max(checks.reading(self, self.stimulus, robot) or 0.0, 0.0), 1.0)
        signal = self.fast * (1 - stimulus) + self.slow * stimulus
        size = robot.dimensions
        rate = self.spread * self.random.gauss(0.0, 1.0) / math.sqrt(self.step_time)  # rad/s
        turn = rate * size.track_width / 2 / size.speed
        largest = 1 - abs(signal)  # a wheel at full signal cannot turn faster
        turn = min(max(turn, -largest), largest)
        robot.drive(signal - turn, signal + turn)
