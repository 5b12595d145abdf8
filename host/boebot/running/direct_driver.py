"""Drives a robot without a board: motor signals in, readings out, in steps of the simulated world.

The order of a step is that of the notes' loop (Fig. 3.1): sense, process, send motor signals, move.
Time stands still while the brain thinks.
"""

from __future__ import annotations

import time as wall
from collections.abc import Iterator

from boebot.boards import VehicleSession
from boebot.errors import BoardError
from boebot.record.record import Unrecorded
from boebot.result import RunResult
from boebot.running.direct_robot import DirectRobot
from boebot.running.driver import PROGRESS_S, Task, result_so_far, step_limit, whole_ticks


class DirectDriver:
    """Drives one robot by motor signals (see `boebot.running.driver.Driver`)."""

    def __init__(self, session: VehicleSession, task: Task) -> None:
        """Raises BoebotError where the brain's period is no whole number of steps."""
        self.session = session
        self.task = task
        request = task.request
        self.period_ticks = whole_ticks(task.period_s, session.tick_s)
        self.period_s = self.period_ticks * session.tick_s
        count = len(session.readings())
        self._direct = DirectRobot(request.robot, session.layout, count, session.tick_s, self.period_s, task.brain_seed)
        self.robot = self._direct.robot
        self.record = task.record
        self.step_limit = step_limit(task)
        self.late_steps = 0
        self._last_s = 0.0

    def link_quality(self) -> None:
        """See `boebot.running.driver.Driver`: there is no link."""

    def begin(self) -> None:
        """Nothing is to be made ready."""

    def steps(self) -> Iterator[float]:
        """See `boebot.running.driver.Driver`."""
        session, robot, direct, n = self.session, self.robot, self._direct, self.period_ticks
        tick_s, progress = session.tick_s, self.task.progress
        put_aside, command_given = self.record.append_readings, self.record.append_command
        is_recorded = not isinstance(self.record, Unrecorded)
        end_s = self.task.seconds - tick_s / 2
        paced = self.task.request.realtime
        started = next_progress = wall.perf_counter()
        left = right = 0.0
        tick, time_s = 0, 0.0
        sample = direct.sample(tick, session.readings())
        put_aside(time_s, sample, left, right)
        while time_s < end_s:
            if paced and (ahead := time_s - (wall.perf_counter() - started)) > 0:
                wall.sleep(ahead)
            if progress is not None and wall.perf_counter() >= next_progress:
                next_progress = wall.perf_counter() + PROGRESS_S
                progress(time_s)
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

    def result(self, error: BaseException | None, elapsed_s: float) -> RunResult:
        """See `boebot.running.driver.Driver`."""
        return result_so_far(
            self.task,
            self.session,
            error,
            elapsed_s,
            robot=self.task.request.robot,
            period=self.period_s,
            tick=self.session.tick_s,
            clock_offset=0.0,
            late_steps=self.late_steps,
            resets=0,
            lost_frames=0,
            bad_frames=0,
            run_time=self._last_s,
            layout=self.session.layout,
        )
