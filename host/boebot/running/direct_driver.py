"""Drives a robot without a board: motor signals in, readings out, in steps of the simulated world.

The order of a step is that of the notes' loop (Fig. 3.1): sense, process, send motor signals, move.
Time stands still while the brain thinks.
"""

from __future__ import annotations

import time as wall
from collections.abc import Iterator, Sequence

from boebot.boards import VehicleSession
from boebot.description.equipment import Equipment
from boebot.description.robots import RobotDescription
from boebot.devices.readings import Layout, Readings, ages, periods
from boebot.errors import BoardError
from boebot.link.messages import Status as StatusBits
from boebot.record.record import Unrecorded
from boebot.robot import Observation, Robot
from boebot.running.driver import Driver, Status, step_limit, whole_ticks
from boebot.running.tasks import Task


class DirectRobot:
    """One robot in one run.

    Attributes:
        robot: what the brain meets.
        coasts: as of a robot with a board; its motors always have a signal.
    """

    coasts = False

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
        status = 0 if self.robot.latched else int(StatusBits.MOTORS_ENABLED)
        return Readings(tick, status, self._ages, values)

    def show(self, sample: Readings) -> None:
        """The robot's new observation."""
        time_s = sample.tick * self._tick_s
        self.robot.observation = Observation(sample, self._equipment, time_s, time_s, time_s, 0.0, sample)

    def see(self, tick: int, values: Sequence[float]) -> None:
        """The robot's new observation, of these readings after that many steps of the world."""
        self.show(self.sample(tick, tuple(values)))

    def signals(self) -> tuple[float, float]:
        """What the motors get by the robot's command, left and right, in [-1, 1]."""
        kind, left, right = self.robot.command
        if self.robot.latched or kind == "stop":
            return 0.0, 0.0
        if kind == "speed":
            return left / self._speed_maximum, right / self._speed_maximum
        return left, right


class DirectDriver(Driver):
    """Drives one robot by motor signals (see `boebot.running.driver.Driver`)."""

    def __init__(self, session: VehicleSession, task: Task) -> None:
        """Raises BoebotError where the brain's period is no whole number of steps."""
        self.session = session
        self.task = task
        self.description, self.layout = task.board.robot, session.layout
        self.link = self.identity = None
        self.period_ticks = whole_ticks(task.period_s, session.tick_s)
        self.tick_s = session.tick_s
        self.period_s = self.period_ticks * session.tick_s
        count = len(session.readings())
        self._direct = DirectRobot(self.description, self.layout, count, self.tick_s, self.period_s, task.seed)
        self.robot = self._direct.robot
        self.record = task.record
        self.step_limit = step_limit(task.request.step_timeout)
        self.late_steps = 0
        self._last_s = 0.0

    def begin(self) -> None:
        """Nothing is to be made ready."""

    def steps(self) -> Iterator[float]:
        """See `boebot.running.driver.Driver`."""
        session, robot, direct, n = self.session, self.robot, self._direct, self.period_ticks
        tick_s = session.tick_s
        put_aside, command_given = self.record.append_readings, self.record.append_command
        is_recorded = not isinstance(self.record, Unrecorded)
        end_s = self.task.request.seconds - tick_s / 2
        paced = self.task.request.realtime
        started = wall.perf_counter()
        left = right = 0.0
        tick, time_s = 0, 0.0
        sample = direct.sample(tick, session.readings())
        put_aside(time_s, sample, left, right)
        while time_s < end_s:
            if paced and (ahead := time_s - (wall.perf_counter() - started)) > 0:
                wall.sleep(ahead)
            direct.show(sample)
            shown = wall.perf_counter()
            yield time_s
            if paced:
                self.late_steps += int((wall.perf_counter() - shown) / self.period_s)
            command_given(time_s, *robot.command)
            left, right = direct.signals()
            for left_over in range(n - 1, -1, -1):
                session.step(left, right)
                tick += 1
                self._last_s = time_s = tick * tick_s
                has_ended = time_s >= end_s
                if is_recorded or not left_over or has_ended:  # else nobody looks at it
                    sample = direct.sample(tick, session.readings())
                    put_aside(time_s, sample, left, right)
                if has_ended:
                    break
            if ended := session.ended:
                raise BoardError(f"robot {robot.name!r} can go no further: {ended}")

    def end(self) -> None:
        """No motor signals any more, should time go on for others."""
        self.session.stop()

    def status(self) -> Status:
        """See `boebot.running.driver.Driver`."""
        return Status(run_time=self._last_s, clock_offset=0.0, late_steps=self.late_steps)
