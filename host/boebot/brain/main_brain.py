"""A brain that runs from top to bottom: `def main(robot)`, with waits in between. A thin layer over `step`.

    def main(robot: MainRobot) -> None:
        for _ in range(4):
            robot.forward(0.3)
            robot.turn(90)

`main` runs in a thread that pauses at each wait. Each step of the brain resumes it and returns at its next wait:
whatever runs brains sees a step like any other.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Sequence
from functools import partial
from types import FrameType, TracebackType
from typing import ClassVar

from boebot import arguments, slips
from boebot.cognition import Odometry
from boebot.cognition.odometry import LAG_S, wrapped
from boebot.errors import BrainError
from boebot.pausable_thread import PausableThread
from boebot.robot import Robot

END_S = 0.5  # that a main which is ended has to clear up
_ON_TIME = 1e-9  # s; times are sums of ticks
_SPEED = 0.5  # of `forward`, as share of the wheels' greatest speed
_TURNING = 0.35  # of `turn`
_NEAR_RAD = 0.005  # to a multiple of π/12: an angle of a few degrees may be meant in radians
_SLOWEST = 0.1  # of both near their end
_SMOOTHING = 0.4  # of the speed, from step to step: an encoder has few edges
_SLOWING_S = 0.5  # the way that is left, divided by this, is the speed
_STEERING = 2.0  # 1/s: turn rate against an error of the heading
_SETTLING_S = 0.2  # until the wheels stand: three times their lag
_PATIENCE_S, _PATIENCE = 2.0, 3.0  # after this, and so many times the time that it should take, a movement is given up


class MainRobot(Robot):
    """The robot as `main` meets it: all that a `Robot` has, waits, and movements that return when they are done.

    A wait ends at a step of the brain, PERIOD seconds apart; sensors show what they said at that step.
    """

    __slots__ = ("_moved", "_odometry", "_pause", "notes")

    def __init__(self, robot: Robot, pause: Callable[[], object]) -> None:
        """`robot`: what the brain steps with; `pause`: returns at the next step."""
        super().__init__(robot.name, robot.period, robot._seed, robot.speed_limit)
        self.showing = robot.showing
        self._pause = pause
        self._odometry = Odometry()
        self._moved = False
        self.notes: dict[str, str] = {}
        """What a user should know of the run, by the signs in slips.toml."""

    # ---- waits -------------------------------------------------------------------------------------------------------

    def wait(self, seconds: float = 0.0) -> None:
        """Lets that time (s) pass, by the board's clock, and at least one step; motors keep their last command.
        Infinite: to the end of the run.

        Raises:
            BrainError: it is no time.
        """
        until = self.time + _seconds("wait: seconds", seconds) - _ON_TIME
        self._next_step()
        while self.time < until:
            self._next_step()

    def wait_until(self, condition: Callable[[], object], timeout: float | None = None) -> bool:
        """Waits until `condition()` is true; it is asked now and at each step. Motors keep their last command.

            robot.wait_until(lambda: robot.whisker_left.pressed)

        Args:
            timeout: for how many seconds at most; None: to the end of the run.

        Returns:
            True; False: time was up.

        Raises:
            BrainError: the condition is no function, or the time-out no time.
        """
        if not callable(condition):
            raise BrainError(slips.of_sign("condition", condition=arguments.shown(condition)))
        limit = math.inf if timeout is None else _seconds("wait_until: timeout", timeout)
        until = self.time + limit - _ON_TIME
        while not condition():
            if self.time >= until:
                return False
            self._next_step()
        return True

    def _next_step(self) -> None:
        self._pause()
        self._odometry.step(self)

    # ---- movements ---------------------------------------------------------------------------------------------------

    def forward(self, metres: float) -> bool:
        """Drives straight ahead that far (negative: backward), then stops. By odometer or wheel encoders; a robot with
        neither drives for the time that it should take.

        Returns:
            True; False: it gave up, for something holds the robot.

        Raises:
            BrainError: it is no length.
        """
        way = arguments.number("forward: metres", metres, BrainError)
        x, y, heading = self._odometry.pose
        sign = math.copysign(1.0, way)
        track_width = self.dimensions.track_width

        def rolled() -> float:
            return math.hypot(self._odometry.pose[0] - x, self._odometry.pose[1] - y)

        def drive(speed: float) -> None:
            error = wrapped(heading - self._odometry.heading)
            correction = max(-speed / 2, min(speed / 2, _STEERING * error * track_width / 2))
            self.drive_speed(sign * speed - correction, sign * speed + correction)

        return self._move(abs(way), _SPEED, rolled, drive)

    def turn(self, degrees: float = 90) -> bool:
        """Turns on the spot, counter-clockwise (negative: clockwise), then stops. By odometer or wheel encoders; a
        robot with neither turns for the time that it should take.

        Returns:
            True; False: it gave up, for something holds the robot.

        Raises:
            BrainError: it is no angle.
        """
        angle = math.radians(arguments.number("turn: degrees", degrees, BrainError))
        if _NEAR_RAD < abs(degrees) < 7.0 and abs(math.remainder(degrees, math.pi / 12)) < _NEAR_RAD:
            self.notes["radians"] = slips.of_sign("radians", angle=degrees, degrees=math.degrees(degrees))
        sign, radius = math.copysign(1.0, angle), self.dimensions.track_width / 2
        turned, last = 0.0, self._odometry.heading

        def rolled() -> float:
            nonlocal turned, last
            turned += wrapped(self._odometry.heading - last)
            last = self._odometry.heading
            return sign * turned * radius

        def drive(speed: float) -> None:
            self.drive_speed(-sign * speed, sign * speed)

        return self._move(abs(angle) * radius, _TURNING, rolled, drive)

    def _move(self, way: float, share: float, rolled: Callable[[], float], drive: Callable[[float], None]) -> bool:
        """Drives until the wheels have `rolled` that way (m), slower near its end; then stops and waits for them.

        By commands alone it drives at full speed, the only one that is known: a servo's speed is not proportional to
        its signal.
        """
        self._moved = True
        if by_time := self._odometry.source == "commands":
            self.notes["commands"] = slips.of_sign("commands", robot=self.name)
        top = min(self.dimensions.speed, self.speed_limit)
        fastest, slowest = (top, top) if by_time else (share * top, _SLOWEST * top)
        given_up = self.time + _PATIENCE_S + _PATIENCE * way / fastest
        rate = now = 0.0  # m/s, smoothed; m
        while (left := way - now) > rate * (LAG_S + self.period / 2) and self.time < given_up:
            drive(max(slowest, min(fastest, left / _SLOWING_S)))
            began, before = self.time, now
            self._next_step()
            now = rolled()
            rate += _SMOOTHING * ((now - before) / (self.time - began) - rate)
        arrived = self.time < given_up
        self.stop()
        self.wait(_SETTLING_S)
        return arrived

    # ---- for the brain -----------------------------------------------------------------------------------------------

    SHARED: ClassVar = ("observation", "command", "slow_command", "latched")

    def take(self, robot: Robot) -> None:
        """What the step's robot shows, and what is in force there."""
        for name in self.SHARED:
            setattr(self, name, getattr(robot, name))

    def give(self, robot: Robot) -> None:
        """What `main` wants, for the step's robot to carry out."""
        for name in self.SHARED[1:]:
            setattr(robot, name, getattr(self, name))

    def begin(self) -> None:
        """The first observation is there."""
        self._odometry.enter(self)

    @property
    def odometry_source(self) -> str | None:
        """What `forward` and `turn` went by (boebot.cognition.Odometry); None: neither was called."""
        return self._odometry.source if self._moved else None


class MainBrain:
    """What steps a `main`. Each run, with a robot not seen before, begins it anew.

    Attributes:
        function: the `main`.
    """

    def __init__(self, main: Callable[[MainRobot], object]) -> None:
        """`main`: of one argument."""
        self.function = main
        self._of: Robot | None = None  # whose run it is
        self._robot: MainRobot | None = None
        self._thread: PausableThread | None = None

    def step(self, robot: Robot) -> None:
        """Runs `main` to its next wait. Once it has returned, the motors stay stopped.

        Raises:
            BaseException: what `main` raises, or what is raised here while it runs: it is ended then.
        """
        if is_first := robot is not self._of:
            self._begin(robot)
        assert self._thread is not None and self._robot is not None
        if self._thread.is_done:
            return
        self._robot.take(robot)
        try:
            self._thread.resume_openly()
        except BaseException as error:  # it takes too long, or Ctrl-C
            place = _trace(self._thread.frame)
            try:
                self.end()
            finally:  # also where the same is raised once more
                raise error.with_traceback(place) from None
        if self._thread.is_done:
            if self._thread.error is not None:
                raise self._thread.error
            self._robot.stop()
            if is_first:
                self._robot.notes["no time"] = slips.of_sign("no time")
        self._robot.give(robot)

    def _begin(self, robot: Robot) -> None:
        self.end()
        self._of = robot
        mine = MainRobot(robot, lambda: thread.pause())
        mine.take(robot)
        mine.begin()
        thread = PausableThread(partial(self.function, mine), "main of a brain")
        self._robot, self._thread = mine, thread
        weakref.finalize(self, thread.end, 0.0).atexit = False  # where nothing else ends it

    def end(self) -> None:
        """The run has ended: so does `main` at its wait, by an exception that runs its `finally` blocks."""
        thread, self._thread, self._of = self._thread, None, None
        if thread is not None and not thread.is_done:
            thread.end(END_S)

    @property
    def is_over(self) -> bool:
        """It has returned, in the present run."""
        return self._thread is not None and self._thread.is_done

    @property
    def odometry_source(self) -> str | None:
        """See `MainRobot.odometry_source`."""
        return None if self._robot is None else self._robot.odometry_source

    @property
    def notices(self) -> Sequence[str]:
        """What a user should know of the run, in sentences."""
        return [] if self._robot is None else list(self._robot.notes.values())


def _trace(frame: FrameType | None) -> TracebackType | None:
    """Where a thread is, as the trace of an error."""
    trace = None
    while frame is not None:
        trace = TracebackType(trace, frame, frame.f_lasti, frame.f_lineno)
        frame = frame.f_back
    return trace


def _seconds(what: str, value: float) -> float:
    """A time, which may be infinite.

    Raises:
        BrainError: it is none.
    """
    return math.inf if value == math.inf else arguments.number(what, value, BrainError, least=0.0)
