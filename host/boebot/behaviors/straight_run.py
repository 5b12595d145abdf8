"""Straight-line odometric navigation: code listings 5.3 and 5.4, equation (5.1) of the notes.

    s = a (D - d) / D      (5.1)      d: how far the robot believes to be from where it began

Driving slows down towards the end; behind the end the signal is negative, and the robot comes back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.machine import Machine, State
from boebot.brain.process import MotorBehavior
from boebot.cognition.odometry import Odometry, wrapped

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class StraightRun(MotorBehavior):
    """Drives a distance straight ahead by odometry, and stays there.

    Args:
        goal: D (m), the notes' desiredMovementDistance.
        signal: a, motor signal; the notes' motorSignalConstant.
        threshold: b, the notes' atDestinationThreshold: a share of D.
        least: smallest motor signal: a servo does not turn within its dead band of about 0.05.
        heading_gain: k (1/rad): s ∓ k times the heading error holds the heading; the notes' listing has none.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        distance: m from where it began, as odometry has it.
        arrived: it is within the threshold of its destination.
    """

    goal: float = 1.0
    signal: float = 0.90
    threshold: float = 0.02
    least: float = 0.0
    heading_gain: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "goal", "threshold")
        checks.signals(self, "signal")
        checks.shares(self, "least")

    def forget(self) -> None:
        self.distance = 0.0
        self.arrived = False

    def enter(self, robot: Robot) -> None:
        self.forget()
        self.machine = Machine(robot, self.begin)

    def step(self, robot: Robot) -> None:
        self.machine.step(robot)

    def begin(self, robot: Robot) -> State:
        """State 0: keep the initial position and heading."""
        odometry = self.other(Odometry)
        self._start, self._heading = odometry.position, odometry.heading
        return self.go

    def go(self, robot: Robot) -> State | None:
        """State 1: (5.1)."""
        odometry = self.other(Odometry)
        self.distance = math.dist(odometry.position, self._start)
        signal = self.signal * (self.goal - self.distance) / self.goal
        if abs(self.goal - self.distance) < self.threshold * self.goal:
            self.arrived = True
            return self.stay(robot)
        if abs(signal) < self.least:
            signal = math.copysign(self.least, signal)
        turn = self.heading_gain * wrapped(self._heading - odometry.heading)
        robot.drive(within_signals(signal - turn), within_signals(signal + turn))
        return None

    def stay(self, robot: Robot) -> State | None:
        """State 2."""
        robot.drive(0.0, 0.0)
        return self.stay


def within_signals(signal: float) -> float:
    """The motor signal limited to -1..1."""
    return min(max(signal, -1.0), 1.0)
