"""What a brain touches: an immutable `Observation` of the sensors, a `Command` for the motors, and `Robot`,
the friendly face of both.

    def step(robot):
        if robot.left_whisker.pressed:
            robot.drive(-0.5, -0.2)
        else:
            robot.drive(0.5, 0.5)

A brain sees what the robot's own sensors, motors and clock give, and nothing else: here is no
way to the simulated world, to the board or to the link.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple, NoReturn, TypeVar

from boebot import robots
from boebot.devices.encoder import Encoder, EncoderReader
from boebot.devices.infrared import Infrared, InfraredReader
from boebot.devices.ping import Ping, PingReader
from boebot.devices.servo import Servo, ServoReader
from boebot.devices.whisker import Whisker, WhiskerReader
from boebot.errors import BrainError
from boebot.link import messages
from boebot.link.messages import Status, Telemetry

_T = TypeVar("_T")

# What a brain may name in NEEDS besides a single device.
GROUPS: Final[dict[str, tuple[str, ...]]] = {
    "whiskers": ("left_whisker", "right_whisker"),
    "infrared": ("left_ir", "right_ir"),
    "encoders": ("left_encoder", "right_encoder"),
    "servos": ("left_servo", "right_servo"),
}
SPEED_LIMIT: Final = 0.5  # m/s; the widest set-point in speed that the protocol carries


class Command(NamedTuple):
    """What the brain wants of the motors."""

    kind: str
    """"signal" (-1 full backward .. 1 full forward), "speed" (m/s along the ground) or "stop" (no pulses: the wheels
    turn freely)."""
    left: float
    right: float


STOP: Final = Command("stop", 0.0, 0.0)


class Equipment:
    """The devices of one robot, ready to be read: one reader per device, called with a telemetry message.

    In place of a device that the robot lacks stands a function that says so.
    """

    NAMES: Final = (
        "left_whisker",
        "right_whisker",
        "left_ir",
        "right_ir",
        "ping",
        "left_encoder",
        "right_encoder",
        "left_servo",
        "right_servo",
    )

    def __init__(self, robot: robots.RobotDescription, tick_s: float) -> None:
        self.robot_name = robot.name
        self.tick_s = tick_s
        device = {name: entry for name, entry in robot.device.items() if entry.on}
        schedule = device.get("infrared")
        infrared_period = schedule.period_ticks if isinstance(schedule, robots.InfraredSchedule) else 5

        def whisker(key: str, bit: messages.Whiskers) -> Callable[[Telemetry], Whisker] | None:
            return WhiskerReader(bit) if isinstance(device.get(key), robots.Whisker) else None

        def infrared(key: str, bit: messages.Infrared) -> Callable[[Telemetry], Infrared] | None:
            pair = device.get(key)
            return InfraredReader(bit, infrared_period, tick_s) if isinstance(pair, robots.InfraredPair) else None

        def encoder(key: str, left: bool) -> Callable[[Telemetry], Encoder] | None:
            entry = device.get(key)
            if not isinstance(entry, robots.Encoder | robots.QuadratureEncoder):
                return None
            directed = isinstance(entry, robots.QuadratureEncoder)
            return EncoderReader(left, entry.edges_per_turn, robot.body.wheel_radius_m, directed)

        def servo(key: str, left: bool) -> Callable[[Telemetry], Servo] | None:
            entry = device.get(key)
            if not isinstance(entry, robots.ContinuousServo):
                return None
            return ServoReader(left, entry.centre_us, entry.gain_us)

        sonar = device.get("ping")
        ping = (
            PingReader(sonar.range_min_m, sonar.range_max_m, sonar.period_ticks, tick_s)
            if isinstance(sonar, robots.Ping)
            else None
        )
        self.left_whisker = self._or_refuse("left_whisker", whisker("whisker_left", messages.Whiskers.LEFT))
        self.right_whisker = self._or_refuse("right_whisker", whisker("whisker_right", messages.Whiskers.RIGHT))
        self.left_ir = self._or_refuse("left_ir", infrared("infrared_left", messages.Infrared.LEFT))
        self.right_ir = self._or_refuse("right_ir", infrared("infrared_right", messages.Infrared.RIGHT))
        self.ping = self._or_refuse("ping", ping)
        self.left_encoder = self._or_refuse("left_encoder", encoder("encoder_left", True))
        self.right_encoder = self._or_refuse("right_encoder", encoder("encoder_right", False))
        self.left_servo = self._or_refuse("left_servo", servo("servo_left", True))
        self.right_servo = self._or_refuse("right_servo", servo("servo_right", False))

    def _or_refuse(self, name: str, reader: Callable[[Telemetry], _T] | None) -> Callable[[Telemetry], _T]:
        if reader is not None:
            return reader

        def refuse(_: Telemetry) -> NoReturn:
            raise BrainError(f"robot {self.robot_name!r} has no {name}")

        refuse.missing = True  # type: ignore[attr-defined]
        return refuse

    def has(self, name: str) -> bool:
        """Whether the robot has the device, by the name that a brain uses ("ping", "left_ir", ...)."""
        return not hasattr(getattr(self, name), "missing")

    def missing(self, needs: Iterable[str]) -> list[str]:
        """Which of the needed devices the robot lacks; a group such as "whiskers" needs all of its devices.

        Raises:
            BrainError: a need is no device at all.
        """
        lacking = []
        for need in needs:
            if need not in GROUPS and need not in self.NAMES:
                known = ", ".join((*GROUPS, *self.NAMES))
                raise BrainError(f"a brain cannot need {need!r}; expected one of {known}")
            lacking += [name for name in GROUPS.get(need, (need,)) if not self.has(name)]
        return lacking


class Observation(NamedTuple):
    """What the robot's sensors said at one tick. It never changes; values are computed when they are looked
    at.

    Each device is a small view with its values in SI units, their `age` (s) and whether they are `valid`.
    """

    telemetry: Telemetry
    equipment: Equipment
    time: float
    """Seconds since the run began, by the board's clock."""
    board_time: float = 0.0
    """Seconds since the board was reset, by its clock: the start of the tick."""
    host_time: float = 0.0
    """The same instant on the host's clock, `time.monotonic()` (s; for a simulated board its own simulated clock)."""
    host_time_error: float = float("inf")
    """Error bound of `host_time` (s): the true instant lies within it, whatever the line's delays are, as long as the
    board's clock keeps its rate."""

    @property
    def tick(self) -> int:
        """The board's control tick that this observation belongs to."""
        return self.telemetry.tick

    @property
    def status(self) -> Status:
        """State and faults of the board."""
        return Status(self.telemetry.status)

    @property
    def left_whisker(self) -> Whisker:
        """Left whisker: `.pressed`."""
        return self.equipment.left_whisker(self.telemetry)

    @property
    def right_whisker(self) -> Whisker:
        """Right whisker: `.pressed`."""
        return self.equipment.right_whisker(self.telemetry)

    @property
    def left_ir(self) -> Infrared:
        """Left infra-red pair: `.detected`."""
        return self.equipment.left_ir(self.telemetry)

    @property
    def right_ir(self) -> Infrared:
        """Right infra-red pair: `.detected`."""
        return self.equipment.right_ir(self.telemetry)

    @property
    def ping(self) -> Ping:
        """Ultrasonic range finder: `.distance` in metres, or None."""
        return self.equipment.ping(self.telemetry)

    @property
    def left_encoder(self) -> Encoder:
        """Left wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        return self.equipment.left_encoder(self.telemetry)

    @property
    def right_encoder(self) -> Encoder:
        """Right wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        return self.equipment.right_encoder(self.telemetry)

    @property
    def left_servo(self) -> Servo:
        """Left wheel's servo as driven now: `.pulse_us`, `.signal`."""
        return self.equipment.left_servo(self.telemetry)

    @property
    def right_servo(self) -> Servo:
        """Right wheel's servo as driven now: `.pulse_us`, `.signal`."""
        return self.equipment.right_servo(self.telemetry)


class Robot:
    """The robot as a brain meets it: sensors to read, motors to drive, a clock and a seeded source of chance.

    The same object is handed to every step of a run; its sensors always show the newest observation.
    """

    __slots__ = ("_chances", "_period", "command", "latched", "name", "observation", "random")

    def __init__(self, name: str, period: float, seed: int = 1) -> None:
        self.name: Final = name
        self._period = period
        self.observation: Observation
        self.command: Command = STOP
        self.latched = False
        """The motors are latched off by `emergency_stop`, until `arm`."""
        self.random = random.Random(f"brain {seed}")
        """A `random.Random` of the brain's own: the same run gives the same numbers."""
        self._chances: dict[tuple[float, float], float] = {}

    # ---- clock ---------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Seconds since the run began, by the board's clock."""
        return self.observation.time

    @property
    def tick(self) -> int:
        """The board's control tick that the sensors show."""
        return self.observation.telemetry.tick

    @property
    def period(self) -> float:
        """Seconds from one step of the brain to the next."""
        return self._period

    # ---- sensors -------------------------------------------------------------------------------------------

    @property
    def left_whisker(self) -> Whisker:
        """Left whisker: `.pressed`."""
        seen = self.observation
        return seen.equipment.left_whisker(seen.telemetry)

    @property
    def right_whisker(self) -> Whisker:
        """Right whisker: `.pressed`."""
        seen = self.observation
        return seen.equipment.right_whisker(seen.telemetry)

    @property
    def left_ir(self) -> Infrared:
        """Left infra-red pair: `.detected`."""
        seen = self.observation
        return seen.equipment.left_ir(seen.telemetry)

    @property
    def right_ir(self) -> Infrared:
        """Right infra-red pair: `.detected`."""
        seen = self.observation
        return seen.equipment.right_ir(seen.telemetry)

    @property
    def ping(self) -> Ping:
        """Ultrasonic range finder: `.distance` in metres, or None."""
        seen = self.observation
        return seen.equipment.ping(seen.telemetry)

    @property
    def left_encoder(self) -> Encoder:
        """Left wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        seen = self.observation
        return seen.equipment.left_encoder(seen.telemetry)

    @property
    def right_encoder(self) -> Encoder:
        """Right wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        seen = self.observation
        return seen.equipment.right_encoder(seen.telemetry)

    # ---- motors --------------------------------------------------------------------------------------------

    def drive(self, left: float, right: float) -> None:
        """Sets the motor signals, -1 (full backward) to 1 (full forward); they hold until the next command.

        Raises:
            BrainError: a signal is out of range or no number.
        """
        try:
            within = -1.0 <= left <= 1.0 and -1.0 <= right <= 1.0
        except (TypeError, ValueError):
            raise _no_numbers("drive", left, right) from None
        if not within:
            raise BrainError(f"drive({left}, {right}): motor signals go from -1 to 1")
        self.command = Command("signal", left, right)

    def drive_speed(self, left: float, right: float) -> None:
        """Sets the wheels' speeds along the ground in m/s, forward positive; they hold until the next
        command.

        Raises:
            BrainError: a speed is beyond 0.5 m/s or no number.
        """
        try:
            within = -SPEED_LIMIT <= left <= SPEED_LIMIT and -SPEED_LIMIT <= right <= SPEED_LIMIT
        except (TypeError, ValueError):
            raise _no_numbers("drive_speed", left, right) from None
        if not within:
            raise BrainError(f"drive_speed({left}, {right}): wheel speeds go from -{SPEED_LIMIT} to {SPEED_LIMIT} m/s")
        self.command = Command("speed", left, right)

    def stop(self) -> None:
        """Switches the motors off until the next command: no pulses, the wheels turn freely."""
        self.command = STOP

    def emergency_stop(self) -> None:
        """Stops the motors and latches them off: no command moves them until `arm`."""
        self.command = STOP
        self.latched = True

    def arm(self) -> None:
        """Ends what `emergency_stop` began: the next command moves the motors again."""
        self.latched = False

    # ---- chance --------------------------------------------------------------------------------------------

    def chance(self, probability: float, per: float | None = None) -> bool:
        """True with that probability.

        Args:
            probability: 0..1, of happening within `per` seconds.
            per: seconds that the probability is meant for. A brain that asks once per step then behaves alike
            at every
                brain period: p' = 1 - (1 - p)^(period / per). None: the probability is meant as
                it stands.
        """
        if per is not None:
            key = (probability, per)
            if key not in self._chances:
                self._chances[key] = 1.0 - (1.0 - probability) ** (self._period / per)
            probability = self._chances[key]
        return self.random.random() < probability


def _no_numbers(call: str, left: object, right: object) -> BrainError:
    return BrainError(f"{call}({left!r}, {right!r}) expects two numbers")
