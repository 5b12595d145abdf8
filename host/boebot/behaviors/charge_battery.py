"""To the charging station, by the lamp on it, and stay there (notes, section 4.4.2 and Fig. 5.1).

    seek      phototaxis; in the dark a round on the spot, then some way straight on, for light may be hidden
    under     what was bright ahead is dark by now: the lamp has been passed; a body's radius further is the station
    wait      stand still until the battery's voltage would have risen; if it has not, seek again

Once it charges, it stands still, whatever it was about to do. Which is noticed by BatteryLevel alone, that has to be
among the brain's processes; when the battery is full enough is for the utilities to say:

    Utility(b=-1.7, w={"low": 3.2, "charging": 1.9})        1.5 - 3.2 E + 1.9 on_charger, with low = 1 - E
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.behaviors.phototaxis import brightness, steered
from boebot.brain import checks
from boebot.brain.machine import Machine, State
from boebot.brain.process import MotorBehavior
from boebot.cognition.battery import BatteryLevel
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class ChargeBattery(MotorBehavior):
    """Drives to the light and stands still where it charges.

    Args:
        signal: motor signal straight on, and s_0 of phototaxis.
        gain: k of phototaxis, a motor signal. None: 0.6 s_0.
        creep: motor signal on the last bit, under the lamp.
        passed: share of the greatest brightness of this approach below which the lamp has been passed.
        patience: s to stand and wait for the voltage to rise.
        dark: brightness of both sensors together up to which it is dark.
        straight: s straight on between two rounds in the dark.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        charging: it stands on a charger, as BatteryLevel has it.
    """

    NEEDS = ("lights", "battery")

    signal: float = 0.4
    gain: float | None = None
    creep: float = 0.15
    passed: float = 0.6
    patience: float = 3.0
    dark: float = 0.0
    straight: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.passed < 1:
            raise BrainError(f"{self.name}: passed is {self.passed!r}; expected a share between 0 and 1")
        checks.positive(self, "signal", "creep")
        checks.signals(self, "signal", "creep")
        checks.not_negative(self, "patience", "dark", "straight")

    def forget(self) -> None:
        self.charging = False

    def enter(self, robot: Robot) -> None:
        self.forget()
        self._brightest = 0.0
        self.machine = Machine(robot, self.seek)

    def step(self, robot: Robot) -> None:
        was, self.charging = self.charging, self.other(BatteryLevel).charging
        if self.charging:
            robot.stop()
            return
        if was:  # pushed off, or the charger was switched off
            self._look_anew(robot)
        self.machine.step(robot)

    def seek(self, robot: Robot) -> State | None:
        left, right = brightness(robot.light_left), brightness(robot.light_right)
        seen = left + right
        if seen < self.passed * self._brightest:
            return self.under
        self._brightest = max(self._brightest, seen)
        if seen <= self.dark:
            self._search(robot)
        else:
            gain = 0.6 * self.signal if self.gain is None else self.gain
            robot.drive(*steered(self.signal, gain, left, right))
        return None

    def under(self, robot: Robot) -> State | None:
        if self.machine.time(robot) >= robot.dimensions.radius / (self.creep * robot.dimensions.speed) - 1e-9:
            return self.wait
        robot.drive(self.creep, self.creep)
        return None

    def wait(self, robot: Robot) -> State | None:
        robot.stop()
        if self.machine.time(robot) < self.patience - 1e-9:
            return None
        self._brightest = 0.0
        return self.seek

    def _look_anew(self, robot: Robot) -> None:
        self._brightest = 0.0
        self.machine.go(robot, self.seek)

    def _search(self, robot: Robot) -> None:
        """In the dark: rounds on the spot, and straight on between them."""
        turn = self.signal / 2
        size = robot.dimensions
        a_round = math.pi * size.track_width / (turn * size.speed)  # s: 2π over the rate 2 turn v / track width
        if self.machine.time(robot) % (a_round + self.straight) < a_round:
            robot.drive(-turn, turn)
        else:
            robot.drive(self.signal, self.signal)
