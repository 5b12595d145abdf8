"""Steering to a reference heading: (6.5) to (6.7) of the notes, and rotation on the spot.

    ΔV = K_p V_nav (φ_ref - φ)      (6.5)
    v_L = V_nav - ΔV / 2            (6.6)
    v_R = V_nav + ΔV / 2            (6.7)

Where the heading is far off, the robot turns on the spot until it nearly fits: v_L = -V_rot, v_R = V_rot to the left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import MotorBehavior
from boebot.cognition.odometry import wrapped

if TYPE_CHECKING:
    from boebot.robot import Robot


BRAKING_S = 0.3
SHARE_TO_DRIVE, SHARE_TO_TURN = 0.75, 0.4  # of the speed at full motor signal, at most: the rest is for steering


def stand(robot: Robot, since_s: float) -> None:
    """Stands still since a time (s): brakes, and then switches the motors off, for servos at rest may creep. Motors
    that are off stay so."""
    if robot.command.kind != "stop" and robot.time - since_s < BRAKING_S:
        robot.drive_speed(0.0, 0.0)
    else:
        robot.stop()


@dataclass(kw_only=True)
class SteeredBehavior(MotorBehavior):
    """A motor behavior that drives under a heading; speeds are set-points of the wheels.

    Attributes:
        turning: it turns on the spot.
    """

    speed: float = 0.12
    """V_nav (m/s)"""
    turn_speed: float = 0.06
    """V_rot: of each wheel while it turns on the spot (m/s)"""
    gain: float = 3.0
    """K_p (1/rad)"""
    turn_above: float = math.pi / 3
    """heading error beyond which it turns on the spot (rad)"""
    turn_below: float = math.pi / 12
    """heading error at which it drives again (rad)"""

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "speed", "turn_speed", "gain", "turn_above", "turn_below")

    def forget(self) -> None:
        self.turning = False
        self._driven_s = -math.inf

    def stand(self, robot: Robot) -> None:
        """Stays where it is."""
        stand(robot, self._driven_s)

    def steer(self, robot: Robot, error: float, share: float = 1.0) -> None:
        """Drives on.

        Args:
            error: φ_ref - φ (rad).
            share: of the speed, 0 to 1.
        """
        self._driven_s = robot.time
        error = wrapped(error)
        self.turning = abs(error) > (self.turn_below if self.turning else self.turn_above)
        if self.turning:
            turn = math.copysign(min(self.turn_speed, SHARE_TO_TURN * robot.dimensions.speed), error)
            robot.drive_speed(-turn, turn)
            return
        speed = min(self.speed, SHARE_TO_DRIVE * robot.dimensions.speed) * share
        difference = max(-2.0 * speed, min(2.0 * speed, self.gain * speed * error))  # no wheel turns backward
        robot.drive_speed(speed - difference / 2, speed + difference / 2)
