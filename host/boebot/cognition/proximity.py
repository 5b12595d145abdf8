"""How near things are, by all that the robot senses them with (IR pairs and their zones, analog IR, Ping)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain.process import CognitiveProcess
from boebot.brain.variables import StateVariable, maximum
from boebot.devices.infrared import Infrared

if TYPE_CHECKING:
    from boebot.devices.analog_infrared import AnalogInfrared
    from boebot.devices.ping import Ping
    from boebot.robot import Robot

REACH_M = 0.4  # distances become nearness: 1 at the sensor, 0 from here on
ZONES = 5
AHEAD_RAD = 0.35  # a turret that is turned farther looks aside: Ping's beam is about 0.35 rad to either side


@dataclass(kw_only=True)
class Proximity(CognitiveProcess):
    """Remembers where something was seen last.

    Args:
        threshold: nearness from which on something is seen.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        left: nearness by the left IR sensor, 0 (nothing) to 1 (touching); None: nothing is known.
        right: by the right one.
        ahead: by what looks straight ahead.
        last_left: time (s) at which the left sensor last saw something, or None.
        last_right: of the right one.
    """

    threshold: float = 0.3

    def forget(self) -> None:
        self.left: float | None = None
        self.right: float | None = None
        self.ahead: float | None = None
        self.last_left: float | None = None
        self.last_right: float | None = None

    def enter(self, robot: Robot) -> None:
        self.forget()

    def step(self, robot: Robot) -> None:
        self.left, self.right, self.ahead = left_nearness(robot), right_nearness(robot), nearness_ahead(robot)
        if (self.left or 0.0) >= self.threshold:
            self.last_left = robot.time
        if (self.right or 0.0) >= self.threshold:
            self.last_right = robot.time


def left_nearness(robot: Robot) -> float | None:
    """Nearness of what the left IR sensor sees, 0..1; None: no fresh reading."""
    return _nearness(robot, "infrared_left")


def right_nearness(robot: Robot) -> float | None:
    """The same of the right one."""
    return _nearness(robot, "infrared_right")


def nearness_ahead(robot: Robot) -> float | None:
    """Nearness of what Ping or analog IR sees straight ahead: 1 - distance / 0.4 m, 0 where there is nothing.

    A Ping that its turret has turned aside sees nothing ahead.
    """
    found = []
    if robot.has("ping") and not _looks_aside(robot):
        found.append(ping_nearness(robot))
    if robot.has("analog_infrared"):
        found.append(_of_distance(robot.analog_infrared))
    return maximum(found)


def ping_nearness(robot: Robot) -> float | None:
    """The same of what Ping sees, wherever it looks; 1: too near to be measured; None: no fresh reading."""
    return 1.0 if robot.ping.too_near else _of_distance(robot.ping)


def _of_distance(device: Ping | AnalogInfrared) -> float | None:
    if not device.valid:
        return None
    return 0.0 if device.distance is None else max(0.0, 1 - device.distance / REACH_M)


def _looks_aside(robot: Robot) -> bool:
    return robot.has("turret") and abs(robot.turret.angle or 0.0) > AHEAD_RAD


def near() -> StateVariable:
    """State variable "near": the nearest of all that is seen (8.3)."""
    return StateVariable("near", _nearest)


def _nearest(robot: Robot) -> float | None:
    return maximum((left_nearness(robot), right_nearness(robot), nearness_ahead(robot)))


def _nearness(robot: Robot, name: str) -> float | None:
    """An analog sensor's reading; of a pair its zone if it sweeps, else 1 for detected and 0 for not."""
    sensor = robot.device(name, Infrared) if robot.has(name) else None
    if sensor is None:
        return None
    if sensor.zone is not None:
        return sensor.zone / ZONES
    if not sensor.valid:
        return None
    return float(sensor.detected) if sensor.reading is None else sensor.reading
