"""What a brain meets of a robot without a board: its readings as an observation, its command as motor signals.

Motor signals go in, readings come out; the owner of the world steps it. A command in speed becomes a motor signal as in
the firmware: the share of the wheels' greatest speed.
"""

from __future__ import annotations

from boebot.description.robots import RobotDescription
from boebot.devices.readings import Layout, Readings, ages, periods
from boebot.link.messages import Status
from boebot.robot import Equipment, Observation, Robot


class DirectRobot:
    """One robot in one run.

    Attributes:
        robot: what the brain meets.
    """

    def __init__(
        self, description: RobotDescription, layout: Layout, readings: int, tick_s: float, period_s: float, seed: int
    ) -> None:
        """
        Args:
            layout: where the readings of each device stand.
            readings: how many there are.
            tick_s: of a step of the world.
            period_s: from step to step of the brain.
            seed: of the brain's chance.
        """
        self._speed_maximum = description.body.wheel_speed_maximum_m_s
        self._equipment = Equipment(description, tick_s, layout)
        self._tick_s = tick_s
        self._periods = periods(description.device, layout, readings)
        self._sampled = any(sample_s > tick_s for sample_s in self._periods)
        self._ages = (0.0,) * readings
        self.robot = Robot(description.name, period_s, seed, self._speed_maximum)

    def sample(self, tick: int, values: tuple[float, ...]) -> Readings:
        """The readings (SI units) after that many steps of the world."""
        if self._sampled:
            self._ages = ages(self._periods, tick * self._tick_s, self._tick_s)
        status = 0 if self.robot.latched else int(Status.MOTORS_ENABLED)
        return Readings(tick, status, self._ages, values)

    def show(self, sample: Readings) -> None:
        """The robot's new observation."""
        time_s = sample.tick * self._tick_s
        self.robot.observation = Observation(sample, self._equipment, time_s, time_s, time_s, 0.0, sample)

    def signals(self) -> tuple[float, float]:
        """What the motors get by the robot's command, left and right, in [-1, 1]."""
        kind, left, right = self.robot.command
        if self.robot.latched or kind == "stop":
            return 0.0, 0.0
        if kind == "speed":
            return left / self._speed_maximum, right / self._speed_maximum
        return left, right
