"""Chemotaxis of E. coli: equation (4.1) of the notes, Figs. 4.1 and 4.2.

    U(t) = X(t) - V(t),   dV/dt + a V = b X      (4.1)

It runs straight on while U exceeds a threshold T, that is, while the concentration X grows against what it remembers;
else it tumbles: a new heading by chance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.leaky import LeakyIntegrator
from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class RunAndTumble(MotorBehavior):
    """Runs while things get better.

    Args:
        stimulus: X, what it follows: a function of the robot. None: as before.
        a: of (4.1), 1/s: how fast it forgets.
        b: of (4.1), 1/s: how much the stimulus counts.
        threshold: T, which U must exceed for it to run on.
        signal: motor signal of running.
        turn: motor signal of turning on the spot.
        run_on: s that it runs after each tumble, or it would never leave a place that has become bad.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        value: U of (4.1), of the last step.
    """

    stimulus: Callable[[Robot], float | None]
    a: float = 1.0
    b: float = 1.0
    threshold: float = 0.0
    signal: float = 0.5
    turn: float = 0.5
    run_on: float = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "a", "b", "turn")
        checks.signals(self, "signal", "turn")
        checks.not_negative(self, "run_on")

    def forget(self) -> None:
        self.value = 0.0

    def enter(self, robot: Robot) -> None:
        self._stimulus = checks.reading(self, self.stimulus, robot) or 0.0
        self._memory = LeakyIntegrator(self.a, self.b, self.b / self.a * self._stimulus)
        self._time = robot.time
        self._turning_until = self._running_until = -math.inf
        self._side = 1

    def step(self, robot: Robot) -> None:
        now = robot.time
        read = checks.reading(self, self.stimulus, robot)
        self._stimulus = self._stimulus if read is None else read
        self.value = self._stimulus - self._memory.advance(self._stimulus, now - self._time)
        self._time = now
        if now >= max(self._turning_until, self._running_until) - 1e-9 and self.value <= self.threshold:
            self._tumble(robot)
        if now < self._turning_until - 1e-9:
            robot.drive(-self._side * self.turn, self._side * self.turn)
        else:
            robot.drive(self.signal, self.signal)

    def _tumble(self, robot: Robot) -> None:
        """A heading by chance, by turning on the spot for as long as that takes by the robot's lengths."""
        angle = self.random.uniform(-math.pi, math.pi)
        self._side = 1 if angle > 0 else -1
        rate = 2 * self.turn * robot.dimensions.speed / robot.dimensions.track_width
        self._turning_until = robot.time + abs(angle) / rate
        self._running_until = self._turning_until + self.run_on
