"""How much is left in the battery, by its voltage, which sags while motors run; and whether it is being charged.

    τ dV/dt + V = v + sag (|s_L| + |s_R|) / 2       v: the measured voltage, s: the motor signals that make it sag

No robot of the notes has a sensor for its charger: the voltage rises on it, and that is all. So it is charging from
when V has risen by `rise` above its lowest value since it last left a charger, and no more from when V has fallen by
`fall` below its highest value since. In between neither changes: on a charger that is full, or weak, it stays charging.
The state variable "charging" is what keeps a robot there until it is full (without
it, it leaves as soon as it is a little less hungry, and comes back at once).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.leaky import LeakyIntegrator
from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class BatteryLevel(CognitiveProcess):
    """Filters the pack's voltage, makes a level of it, and notices the charger.

    Args:
        empty: volts at which the robot should have stopped.
        full: volts of the full pack at rest.
        tau: time constant (s) of the filter: servos draw their current in pulses.
        sag: volts that the pack sags while both motors run at full signal.
        rise: volts of rise that show a charger; more than noise and than what `sag` leaves over.
        fall: volts of fall that show its end.
        lift: volts that the pack stands higher at once on a charger: the charging current times its internal
            resistance.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        voltage: V, filtered, as if no motor ran; None before the first reading.
        level: 0 (empty) to 1 (full), or None before the first reading.
        charging: the robot seems to be on a charger.
    """

    NEEDS = ("battery",)

    empty: float
    full: float
    tau: float = 2.0
    sag: float = 0.0
    rise: float = 0.1
    fall: float = 0.05
    lift: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.full > self.empty:
            raise BrainError(f"{self.name}: full is {self.full!r} V; expected more than empty, {self.empty!r} V")
        checks.positive(self, "tau", "rise", "fall")

    def forget(self) -> None:
        self.voltage: float | None = None
        self.charging = False
        self._turned = math.nan  # the lowest voltage since the charger was left, or the highest since it was reached

    @property
    def level(self) -> float | None:
        """See the class."""
        if self.voltage is None:
            return None
        rested = self.voltage - self.lift * self.charging
        return min(max((rested - self.empty) / (self.full - self.empty), 0.0), 1.0)

    def enter(self, robot: Robot) -> None:
        self.forget()
        self._time = robot.time

    def step(self, robot: Robot) -> None:
        measured, _, valid = robot.battery
        if not valid or measured is None or not math.isfinite(measured):
            return
        now = robot.time
        elapsed, self._time = now - self._time, now
        unloaded = measured + self.sag * _effort(robot) if self.sag else measured
        if self.voltage is None:
            self.voltage = self._turned = unloaded
            self._filter = LeakyIntegrator(1 / self.tau, value=unloaded)
            return
        self.voltage = self._filter.advance(unloaded, elapsed)
        self._notice_charger(self.voltage)

    def _notice_charger(self, voltage: float) -> None:
        if self.charging:
            self._turned = max(self._turned, voltage)
            changed = voltage < self._turned - self.fall
        else:
            self._turned = min(self._turned, voltage)
            changed = voltage > self._turned + self.rise
        if changed:
            self.charging, self._turned = not self.charging, voltage

    def variable(self) -> StateVariable:
        """State variable "low": 1 - level, as of the last step; 0 before the first reading."""
        return StateVariable("low", self._low, self.NEEDS)

    def _low(self, robot: Robot) -> float | None:
        level = self.level
        return None if level is None else 1 - level

    def charging_variable(self) -> StateVariable:
        """State variable "charging": 1 on a charger, as of the last step, else 0."""
        return StateVariable("charging", self._is_charging, self.NEEDS)

    def _is_charging(self, robot: Robot) -> float:
        return float(self.charging)


def _effort(robot: Robot) -> float:
    """Mean size of both motors' set-points, 0 to 1 (full)."""
    kind, left, right = robot.command
    if kind == "stop":
        return 0.0
    full = robot.dimensions.speed if kind == "speed" else 1.0
    return min((abs(left) + abs(right)) / 2 / full, 1.0)
