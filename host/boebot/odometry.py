"""Where the robot believes it is: dead reckoning from wheel encoders (notes, equations 2.7 to 2.9).

    ds = (ds_L + ds_R) / 2,   dphi = (ds_R - ds_L) / (2 R)
    x += ds cos(phi + dphi/2),   y += ds sin(phi + dphi/2),   phi += dphi      (midpoint rule; 2 R = track width)

A single-channel encoder knows no direction. Its sign is that of the commanded signal; when the command
reverses, the old sign stays until the new command has been beyond the dead band for 60 ms. A wheel whose
speed follows the command with a time constant of 65 ms passes through standstill 65 ms ln 2 = 45 ms after the
servo has noticed the new pulse, which takes it half a 20 ms frame on average (docs/decisions/0002-sign-hold.md).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

DEAD_BAND = 0.05  # motor signal below which a servo does not turn
HOLD_S = 0.06


class WheelDirection:
    """The assumed direction of a wheel's turning: +1 or -1."""

    def __init__(self) -> None:
        self.sign = 1
        self._reversed_s = 0.0

    def update(self, signal: float, step_s: float) -> int:
        """Takes the commanded signal of the last `step_s` seconds; returns the sign now believed in."""
        if signal * self.sign < 0 and abs(signal) >= DEAD_BAND:
            self._reversed_s += step_s
            if self._reversed_s >= HOLD_S - 1e-9:
                self.sign = -self.sign
                self._reversed_s = 0.0
        else:
            self._reversed_s = 0.0
        return self.sign

    def update_all(self, signals: Floats, steps_s: Floats) -> NDArray[np.int64]:
        """Many updates one after the other: the signs, shape (n,)."""
        both = zip(signals.tolist(), steps_s.tolist(), strict=True)
        return np.array([self.update(signal, step_s) for signal, step_s in both], dtype=np.int64)


class Odometry:
    """The pose estimate; heading counter-clockwise, in (-pi, pi]."""

    def __init__(self, track_width_m: float, x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> None:
        self._track_width_m = track_width_m
        self.x = x
        self.y = y
        self.heading = heading

    def update(self, left_m: float, right_m: float) -> None:
        """Adds what the wheels have rolled since the last update (m, forward positive)."""
        travelled = (left_m + right_m) / 2
        turned = (right_m - left_m) / self._track_width_m
        middle = self.heading + turned / 2
        self.x += travelled * math.cos(middle)
        self.y += travelled * math.sin(middle)
        heading = self.heading + turned
        self.heading = math.atan2(math.sin(heading), math.cos(heading))


def dead_reckoning(left_m: Floats, right_m: Floats, track_width_m: float) -> tuple[Floats, Floats, Floats]:
    """The same for many updates one after the other, from a pose of zeros: x (m), y (m), heading (rad) after each."""
    turned = (right_m - left_m) / track_width_m
    heading = np.cumsum(turned)
    middle = heading - turned / 2
    travelled = (left_m + right_m) / 2
    x, y = np.cumsum(travelled * np.cos(middle)), np.cumsum(travelled * np.sin(middle))
    return x, y, np.arctan2(np.sin(heading), np.cos(heading))
