"""Taxis: movement along a gradient, to the light or away from it (notes, section 4.4.2).

With two sensors, crossed excitation (V. Braitenberg, "Vehicles", 1984):

    a = (I_l - I_r) / (I_l + I_r),   s_L = s_0 - k a,   s_R = s_0 + k a

With one (klinotaxis), as fly maggots do: swing to one side and to the other, and go where it was brighter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.behaviors.straight_run import within_signals
from boebot.brain import checks
from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Phototaxis(MotorBehavior):
    """To the light by two sensors, or away from it; in the dark it turns on the spot and looks for light.

    Args:
        signal: s_0, motor signal straight on.
        gain: k, motor signal for each unit of a. None: 0.6 s_0.
        flee: away from the light.
        dark: brightness of both together up to which it is dark.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    NEEDS = ("lights",)

    signal: float = 0.5
    gain: float | None = None
    flee: bool = False
    dark: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.signals(self, "signal")
        checks.not_negative(self, "dark")

    def step(self, robot: Robot) -> None:
        left, right = brightness(robot.light_left), brightness(robot.light_right)
        if left + right <= self.dark:
            if self.flee:
                robot.drive(0.0, 0.0)
            else:
                robot.drive(-self.signal / 2, self.signal / 2)
            return
        gain = 0.6 * self.signal if self.gain is None else self.gain
        robot.drive(*steered(self.signal, -gain if self.flee else gain, left, right))


@dataclass(kw_only=True)
class Klinotaxis(MotorBehavior):
    """To the light by one sensor, or away from it: swings left and right, and compares the last two swings.

    Args:
        signal: s_0, motor signal straight on.
        swing: difference of the motor signals while it swings to a side.
        seconds: s of one swing.
        gain: difference of the motor signals for each unit of (I_left - I_right) / (I_left + I_right).
        flee: away from the light.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    NEEDS = ("light_left",)

    signal: float = 0.4
    swing: float = 0.25
    seconds: float = 0.5
    gain: float = 3.0
    flee: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.signals(self, "signal")
        checks.positive(self, "seconds")
        checks.not_negative(self, "swing")

    def enter(self, robot: Robot) -> None:
        self._side = 1  # +1: swings to the left
        self._until = robot.time + self.seconds / 2
        self._sum, self._count = 0.0, 0
        self._seen: dict[int, float] = {}  # of the last swing to each side
        self._steer = 0.0

    def step(self, robot: Robot) -> None:
        self._sum += brightness(robot.light_left)
        self._count += 1
        if robot.time >= self._until - 1e-9:
            self._seen[self._side] = self._sum / self._count
            left, right = (self._seen.get(side, self._seen[self._side]) for side in (1, -1))
            better = (left - right) / (left + right) if left + right > 0 else 0.0
            self._steer = self.gain * better * (-1 if self.flee else 1)
            self._side = -self._side
            self._until = robot.time + self.seconds
            self._sum, self._count = 0.0, 0
        half = (self._side * self.swing + min(max(self._steer, -self.swing), self.swing)) / 2
        robot.drive(within_signals(self.signal - half), within_signals(self.signal + half))


def steered(signal: float, gain: float, left: float, right: float) -> tuple[float, float]:
    """The motor signals s_0 ∓ k a of crossed excitation, where left + right is above 0."""
    steer = gain * ((left - right) / (left + right))
    return within_signals(signal - steer), within_signals(signal + steer)


def brightness(light: object) -> float:
    """What a light sensor says, 0 where it says nothing."""
    value = getattr(light, "brightness", None)
    return float(value) if value is not None and getattr(light, "valid", False) else 0.0
