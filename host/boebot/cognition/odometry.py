"""Where the robot believes it is: the cognitive process behind all navigation (notes, equations (2.7) to (2.9)).

It takes the best that the robot has: its odometer; else wheel encoders, by the midpoint rule and, where they know no
direction, the sign rule of boebot.odometry; else the motors' commands, which know nothing of slip, load or
battery. `source` says which; brains that need to know how far to trust the pose should look.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Literal

from boebot.brain.process import CognitiveProcess
from boebot.errors import BrainError
from boebot.odometry import Odometry as DeadReckoning
from boebot.odometry import WheelDirection

if TYPE_CHECKING:
    from boebot.devices.encoder import Encoder
    from boebot.robot import Robot

Source = Literal["odometer", "encoders", "commands"]
SOURCES: tuple[Source, ...] = ("odometer", "encoders", "commands")
LAG_S = 0.065  # with which a wheel's speed follows a command (docs/decisions/0002-sign-hold.md)


@dataclass(kw_only=True)
class Odometry(CognitiveProcess):
    """Keeps the pose: a process of a `Brain`, or called by a brain of another kind, `step(robot)` in each of its steps.

    Args:
        use: what to take; None: the best that the robot has.
        start: pose at the beginning (m, m, rad); an odometer has its own.
        factors: k_w: metres that the left and the right wheel really roll for each metre by encoders or commands.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        pose: x, y (m) and heading (rad in (-pi, pi]), from where the run began or the odometer's origin.
        origin: the pose with which it began: `start`, or what the odometer said.
        speed: m/s ahead, over the last step.
        turn_rate: rad/s counter-clockwise, over the last step.
        travelled: m of way so far, both forward and backward.
        source: what the pose comes from: "odometer", "encoders" or "commands".
    """

    use: Source | None = None
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    factors: tuple[float, float] = (1.0, 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.use not in (None, *SOURCES):
            raise BrainError(f"{self.name}: use is {self.use!r}; expected one of {', '.join(SOURCES)}")
        if not (isinstance(self.start, tuple | list) and len(self.start) == 3 and all(map(_is_finite, self.start))):
            raise BrainError(f"{self.name}: start is {self.start!r}; expected x (m), y (m), heading (rad)")
        if len(self.factors) != 2 or not all(0 < factor < math.inf for factor in self.factors):
            raise BrainError(f"{self.name}: factors are {self.factors!r}; expected two numbers above 0")

    def forget(self) -> None:
        self.pose = self.origin = self.start
        self.speed = self.turn_rate = self.travelled = 0.0
        self.source: Source = self.use or "commands"
        self._reckoning: DeadReckoning | None = None
        self._time = math.nan

    def enter(self, robot: Robot) -> None:
        self.forget()
        if self.use is None:
            kinds: dict[str, Source] = {"odometer": "odometer", "encoders": "encoders"}
            self.source = next((source for device, source in kinds.items() if robot.has(device)), "commands")
        elif self.use != "commands" and not robot.has(self.use):
            raise BrainError(f"{self.name}: robot {robot.name!r} has no {self.use}")
        self._time = robot.time
        if self.source == "odometer":
            self.pose = self.origin = self._pose_of_odometer(robot)
            return
        self._reckoning = DeadReckoning(robot.dimensions.track_width, *self.start)
        self._directions = WheelDirection(), WheelDirection()
        if self.source == "encoders":
            self._encoders = robot.encoder_left, robot.encoder_right
        self._speeds = (0.0, 0.0)

    def step(self, robot: Robot) -> None:
        if math.isnan(self._time):  # in no Brain, which would have entered it
            self.enter(robot)
        elapsed = robot.time - self._time
        if elapsed <= 0:
            return
        self._time = robot.time
        x, y, heading = self.pose
        if self._reckoning is None:
            self.pose = self._pose_of_odometer(robot)
        else:
            rolled = self._counted(robot, elapsed) if self.source == "encoders" else self._commanded(robot, elapsed)
            self._reckoning.update(self.factors[0] * rolled[0], self.factors[1] * rolled[1])
            self.pose = (self._reckoning.x, self._reckoning.y, self._reckoning.heading)
        along = (self.pose[0] - x) * math.cos(heading) + (self.pose[1] - y) * math.sin(heading)
        way = math.copysign(math.hypot(self.pose[0] - x, self.pose[1] - y), along)
        self.speed = way / elapsed
        self.turn_rate = wrapped(self.pose[2] - heading) / elapsed
        self.travelled += abs(way)

    @property
    def position(self) -> tuple[float, float]:
        """x, y (m)."""
        return self.pose[:2]

    @property
    def heading(self) -> float:
        """rad in (-pi, pi]"""
        return self.pose[2]

    def _pose_of_odometer(self, robot: Robot) -> tuple[float, float, float]:
        """What the odometer says; where that is no pose, the last one."""
        odometer = robot.odometer
        pose = odometer.x, odometer.y, odometer.heading
        return pose if odometer.valid and all(math.isfinite(value) for value in pose) else self.pose

    def _counted(self, robot: Robot, elapsed: float) -> tuple[float, float]:
        """What the wheels have rolled by their encoders (m)."""
        before, self._encoders = self._encoders, (robot.encoder_left, robot.encoder_right)
        signals = _signals(robot)
        rolled = [0.0, 0.0]
        for side in (0, 1):
            rolled[side] = _rolled(before[side], self._encoders[side])
            if not self._encoders[side].directed:
                rolled[side] *= self._directions[side].update(signals[side], elapsed)
        return rolled[0], rolled[1]

    def _commanded(self, robot: Robot, elapsed: float) -> tuple[float, float]:
        """What the wheels would roll by the commands (m): their speeds follow the signals with a lag,

        v(t) = v_1 + (v_0 - v_1) e^(-t/τ),   s = v_1 t + (v_0 - v_1) τ (1 - e^(-t/τ))
        """
        decay = math.exp(-elapsed / LAG_S)
        rolled, speeds = [], []
        for speed, signal in zip(self._speeds, _signals(robot), strict=True):
            aim = signal * robot.dimensions.speed
            rolled.append(aim * elapsed + (speed - aim) * LAG_S * (1 - decay))
            speeds.append(aim + (speed - aim) * decay)
        self._speeds = speeds[0], speeds[1]
        return rolled[0], rolled[1]


def _rolled(before: Encoder, now: Encoder) -> float:
    """What a wheel has rolled between two readings (m): counters roll over at 2^31 edges."""
    edges = (now.count - before.count + 2**31) % 2**32 - 2**31
    known = now if now.count else before
    return edges * known.distance / known.count if known.count else 0.0


def _signals(robot: Robot) -> tuple[float, float]:
    """Motor signals now in force: as the servos are driven, else those of the last command."""
    if robot.has("servos"):
        return robot.observation.servo_left.signal, robot.observation.servo_right.signal
    kind, left, right = robot.command
    if kind == "speed":
        return left / robot.dimensions.speed, right / robot.dimensions.speed
    return (left, right) if kind == "signal" else (0.0, 0.0)


def _is_finite(number: object) -> bool:
    return isinstance(number, Real) and math.isfinite(number)


def wrapped(angle: float) -> float:
    """The angle in (-pi, pi] (rad)."""
    turned = math.remainder(angle, 2 * math.pi)
    return math.pi if turned == -math.pi else turned
