"""Drives a robot without a board: motor signals in, readings out, in steps of the simulated world.

The order of a step is that of the notes' loop (Fig. 3.1): sense, process, send motor signals, move.
Time stands still while the brain thinks. A command in speed becomes a motor signal as in the firmware: the share of the
wheels' greatest speed.
"""

from __future__ import annotations

import time as wall
from collections.abc import Iterator

from boebot.boards import VehicleSession
from boebot.devices.readings import Readings, ages, periods
from boebot.errors import BoardError
from boebot.link.messages import Status
from boebot.record.brain_record import BrainRecord
from boebot.record.record import Record
from boebot.record.result import RunResult
from boebot.robot import Command, Equipment, Observation, Robot
from boebot.running.driver import PROGRESS_S, Task, step_limit, whole_ticks


class DirectDriver:
    """Drives one robot by motor signals (see `boebot.running.driver.Driver`)."""

    def __init__(self, session: VehicleSession, task: Task) -> None:
        """Raises BoebotError where the brain's period is no whole number of steps."""
        self.session = session
        self.task = task
        request = task.request
        self.period_ticks = whole_ticks(task.period_s, session.tick_s)
        self.period_s = self.period_ticks * session.tick_s
        self.equipment = Equipment(request.robot, session.tick_s, session.layout)
        self._speed_maximum = request.robot.body.wheel_speed_maximum_m_s
        self.robot = Robot(request.robot.name, self.period_s, task.brain_seed, self._speed_maximum)
        self.record = Record()
        self.step_limit = step_limit(task)
        self.late_steps = 0
        self._periods = periods(request.robot.device, session.layout, len(session.readings()))
        self._sampled = any(period_s > session.tick_s for period_s in self._periods)
        self._ages = (0.0,) * len(self._periods)

    def begin(self) -> None:
        """Nothing is to be made ready."""

    def steps(self) -> Iterator[float]:
        """See `boebot.running.driver.Driver`."""
        session, robot, equipment, n = self.session, self.robot, self.equipment, self.period_ticks
        tick_s, progress = session.tick_s, self.task.progress
        put_aside, command_given = self.record.append_readings, self.record.append_command
        end_s = self.task.seconds - tick_s / 2
        paced = self.task.request.realtime
        started = next_progress = wall.perf_counter()
        left = right = 0.0
        tick, time_s = 0, 0.0
        sample = self._sample(tick, time_s)
        put_aside(time_s, sample, left, right)
        while time_s < end_s:
            if paced and (ahead := time_s - (wall.perf_counter() - started)) > 0:
                wall.sleep(ahead)
            if progress is not None and wall.perf_counter() >= next_progress:
                next_progress = wall.perf_counter() + PROGRESS_S
                progress(time_s)
            robot.observation = Observation(sample, equipment, time_s, time_s, time_s, 0.0, sample)
            shown = wall.perf_counter()
            yield time_s
            if paced:
                self.late_steps += int((wall.perf_counter() - shown) / self.period_s)
            command = robot.command
            command_given(time_s, *command)
            left, right = (0.0, 0.0) if robot.latched else self._signals(command)
            for _ in range(n):
                session.step(left, right)
                tick += 1
                time_s = tick * tick_s
                sample = self._sample(tick, time_s)
                put_aside(time_s, sample, left, right)
                if time_s >= end_s:
                    break
            if ended := session.ended:
                raise BoardError(f"robot {robot.name!r} can go no further: {ended}")

    def _sample(self, tick: int, time_s: float) -> Readings:
        if self._sampled:
            self._ages = ages(self._periods, time_s, self.session.tick_s)
        status = 0 if self.robot.latched else int(Status.MOTORS_ENABLED)
        return Readings(tick, status, self._ages, self.session.readings())

    def _signals(self, command: Command) -> tuple[float, float]:
        """What the motors get."""
        kind, left, right = command
        if kind == "signal":
            return left, right
        if kind == "speed":
            return left / self._speed_maximum, right / self._speed_maximum
        return 0.0, 0.0

    def end(self) -> None:
        """No motor signals any more, should time go on for others."""
        self.session.stop()

    def result(self, error: BaseException | None, elapsed_s: float) -> RunResult:
        """See `boebot.running.driver.Driver`."""
        request = self.task.request
        return RunResult(
            brain=self.task.brain.name,
            robot=request.robot,
            board=self.task.on,
            description=self.session.description,
            arena=request.arena,
            seed=self.task.brain_seed,
            period=self.period_s,
            tick=self.session.tick_s,
            error=error,
            record=self.record,
            truth=self.session.truth(),
            clock_offset=0.0,
            steps=len(self.record.rows("command")),
            late_steps=self.late_steps,
            odometry_source=self.task.brain.odometry,
            resets=0,
            lost_frames=0,
            bad_frames=0,
            run_time=self.record.rows("readings")[-1][0] if self.record.rows("readings") else 0.0,
            wall_time=elapsed_s,
            counters=dict(self.session.counters()),
            layout=self.session.layout,
            without=request.without,
            brain_record=BrainRecord.of(self.task.brain.brain, self.robot),
        )
