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
from typing import Final, NamedTuple

from boebot.devices import buzzer, turret
from boebot.devices.analog_infrared import AnalogInfrared
from boebot.devices.battery import Battery
from boebot.devices.buzzer import Buzzer
from boebot.devices.compass import Compass
from boebot.devices.encoder import Encoder
from boebot.devices.equipment import Dimensions
from boebot.devices.equipment import Equipment as Equipment
from boebot.devices.infrared import Infrared, InfraredZone
from boebot.devices.light import Light
from boebot.devices.ping import Ping
from boebot.devices.readings import Heading, OdometerPose, Proximity, Reading, Readings, Scan
from boebot.devices.servo import Servo
from boebot.devices.told import NOTHING_TOLD, Told
from boebot.devices.turret import Turret
from boebot.devices.whisker import Whisker
from boebot.errors import BrainError
from boebot.link.messages import Buzzer as BuzzerMessage
from boebot.link.messages import Status, Telemetry
from boebot.link.messages import Turret as TurretMessage

SPEED_LIMIT: Final = 0.5  # m/s; the widest set-point in speed that the protocol carries


class Command(NamedTuple):
    """What the brain wants of the motors; it never changes."""

    kind: str
    """"signal" (-1 full backward .. 1 full forward), "speed" (m/s along the ground) or "stop" (no pulses: the wheels
    turn freely)."""
    left: float
    """Of the left wheel: motor signal, -1 to 1, or m/s, as `kind` says; 0 with "stop"."""
    right: float
    """Of the right wheel, the same."""


STOP: Final = Command("stop", 0.0, 0.0)


class SlowCommand(NamedTuple):
    """What a brain asks of turret and buzzer; None: nothing new."""

    turret: TurretMessage | None = None
    tone: BuzzerMessage | None = None


NO_SLOW_COMMAND: Final = SlowCommand()


class Observation(NamedTuple):
    """What the robot's sensors said at one tick. It never changes; values are computed when they are looked
    at.

    Each device is a small view with its values in SI units, their `age` (s) and whether they are `valid`.
    """

    sample: Telemetry | Readings
    """What the devices said: a board's telemetry, or the readings of a robot without one."""
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
    slow: Told | Readings = NOTHING_TOLD
    """What the slow devices said last; of a robot without a board the same as `sample`."""

    @property
    def tick(self) -> int:
        """The board's control tick that this observation belongs to."""
        return self.sample.tick

    @property
    def status(self) -> Status:
        """State and faults of the board."""
        return Status(self.sample.status)

    @property
    def left_whisker(self) -> Whisker:
        """Left whisker: `.pressed`."""
        return self.equipment.left_whisker(self.sample)

    @property
    def right_whisker(self) -> Whisker:
        """Right whisker: `.pressed`."""
        return self.equipment.right_whisker(self.sample)

    @property
    def left_ir(self) -> Infrared | Proximity:
        """Left infra-red sensor: `.detected`; an analog one also says `.reading`."""
        return self.equipment.left_ir(self.sample)

    @property
    def right_ir(self) -> Infrared | Proximity:
        """Right infra-red sensor: `.detected`; an analog one also says `.reading`."""
        return self.equipment.right_ir(self.sample)

    @property
    def ping(self) -> Ping:
        """Ultrasonic range finder: `.distance` in metres, or None."""
        return self.equipment.ping(self.sample)

    @property
    def left_encoder(self) -> Encoder:
        """Left wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        return self.equipment.left_encoder(self.sample)

    @property
    def right_encoder(self) -> Encoder:
        """Right wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        return self.equipment.right_encoder(self.sample)

    @property
    def left_servo(self) -> Servo:
        """Left wheel's servo as driven now: `.pulse_us`, `.signal`."""
        return self.equipment.left_servo(self.sample)

    @property
    def right_servo(self) -> Servo:
        """Right wheel's servo as driven now: `.pulse_us`, `.signal`."""
        return self.equipment.right_servo(self.sample)

    @property
    def odometer(self) -> OdometerPose:
        """Pose by odometry: `.x`, `.y` (m), `.heading` (rad)."""
        return self.equipment.odometer(self.sample)

    @property
    def laser(self) -> Scan:
        """Laser range finder: `.distances` (m, -1: nothing), `.angles` (rad)."""
        return self.equipment.laser(self.sample)

    @property
    def accelerometer(self) -> Reading:
        """Acceleration along the heading: `.value` (m/s^2)."""
        return self.equipment.accelerometer(self.sample)

    @property
    def left_light(self) -> Light:
        """Left light sensor: `.brightness`, twice as much in twice the light; or None."""
        return self.equipment.left_light(self.slow)

    @property
    def right_light(self) -> Light:
        """Right light sensor: `.brightness`, twice as much in twice the light; or None."""
        return self.equipment.right_light(self.slow)

    @property
    def compass(self) -> Compass | Heading:
        """Compass: `.heading` (rad), or None."""
        return self.equipment.compass(self.slow)

    @property
    def battery(self) -> Battery:
        """Battery: `.voltage` (V), or None."""
        return self.equipment.battery(self.slow)

    @property
    def analog_ir(self) -> AnalogInfrared:
        """Analog infra-red sensor: `.distance` in metres, or None."""
        return self.equipment.analog_ir(self.slow)

    @property
    def left_zone(self) -> InfraredZone:
        """Left infra-red pair's zone: `.zone`, 0 nothing to 5 nearest."""
        return self.equipment.left_zone(self.slow)

    @property
    def right_zone(self) -> InfraredZone:
        """Right infra-red pair's zone: `.zone`, 0 nothing to 5 nearest."""
        return self.equipment.right_zone(self.slow)

    @property
    def turret(self) -> Turret:
        """Turret as driven now: `.angle` (rad, counter-clockwise from ahead), or None: free."""
        return self.equipment.turret(self.slow)

    @property
    def buzzer(self) -> Buzzer:
        """Buzzer: `.token` of the last tone that the board began."""
        return self.equipment.buzzer(self.slow)


class Robot:
    """The robot as a brain meets it: sensors to read, motors to drive, a clock and a seeded source of chance.

    The same object is handed to every step of a run; its sensors always show the newest observation.
    """

    __slots__ = (
        "_chances",
        "_period",
        "_seed",
        "_speed_limit",
        "command",
        "latched",
        "name",
        "observation",
        "random",
        "slow_command",
    )

    def __init__(self, name: str, period: float, seed: int = 1, speed_limit: float = SPEED_LIMIT) -> None:
        self.name: Final = name
        self._speed_limit = speed_limit  # m/s
        self._period = period
        self._seed = seed
        self.observation: Observation
        self.command: Command = STOP
        self.slow_command: SlowCommand | None = None
        """What was asked of turret and buzzer and not yet carried out."""
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
        return self.observation.sample.tick

    @property
    def period(self) -> float:
        """Seconds from one step of the brain to the next."""
        return self._period

    # ---- sensors -------------------------------------------------------------------------------------------

    @property
    def left_whisker(self) -> Whisker:
        """Left whisker: `.pressed`."""
        seen = self.observation
        return seen.equipment.left_whisker(seen.sample)

    @property
    def right_whisker(self) -> Whisker:
        """Right whisker: `.pressed`."""
        seen = self.observation
        return seen.equipment.right_whisker(seen.sample)

    @property
    def left_ir(self) -> Infrared | Proximity:
        """Left infra-red sensor: `.detected`; an analog one also says `.reading`."""
        seen = self.observation
        return seen.equipment.left_ir(seen.sample)

    @property
    def right_ir(self) -> Infrared | Proximity:
        """Right infra-red sensor: `.detected`; an analog one also says `.reading`."""
        seen = self.observation
        return seen.equipment.right_ir(seen.sample)

    @property
    def ping(self) -> Ping:
        """Ultrasonic range finder: `.distance` in metres, or None."""
        seen = self.observation
        return seen.equipment.ping(seen.sample)

    @property
    def left_encoder(self) -> Encoder:
        """Left wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        seen = self.observation
        return seen.equipment.left_encoder(seen.sample)

    @property
    def right_encoder(self) -> Encoder:
        """Right wheel's encoder: `.count`, `.distance` (m), `.speed` (m/s)."""
        seen = self.observation
        return seen.equipment.right_encoder(seen.sample)

    @property
    def odometer(self) -> OdometerPose:
        """Pose by odometry: `.x`, `.y` (m), `.heading` (rad)."""
        seen = self.observation
        return seen.equipment.odometer(seen.sample)

    @property
    def laser(self) -> Scan:
        """Laser range finder: `.distances` (m, -1: nothing), `.angles` (rad)."""
        seen = self.observation
        return seen.equipment.laser(seen.sample)

    @property
    def accelerometer(self) -> Reading:
        """Acceleration along the heading: `.value` (m/s^2)."""
        seen = self.observation
        return seen.equipment.accelerometer(seen.sample)

    @property
    def left_light(self) -> Light:
        """Left light sensor: `.brightness`, twice as much in twice the light; or None."""
        seen = self.observation
        return seen.equipment.left_light(seen.slow)

    @property
    def right_light(self) -> Light:
        """Right light sensor: `.brightness`, twice as much in twice the light; or None."""
        seen = self.observation
        return seen.equipment.right_light(seen.slow)

    @property
    def compass(self) -> Compass | Heading:
        """Compass: `.heading` (rad), or None."""
        seen = self.observation
        return seen.equipment.compass(seen.slow)

    @property
    def battery(self) -> Battery:
        """Battery: `.voltage` (V), or None."""
        seen = self.observation
        return seen.equipment.battery(seen.slow)

    @property
    def analog_ir(self) -> AnalogInfrared:
        """Analog infra-red sensor: `.distance` in metres, or None."""
        seen = self.observation
        return seen.equipment.analog_ir(seen.slow)

    @property
    def left_zone(self) -> InfraredZone:
        """Left infra-red pair's zone: `.zone`, 0 nothing to 5 nearest."""
        seen = self.observation
        return seen.equipment.left_zone(seen.slow)

    @property
    def right_zone(self) -> InfraredZone:
        """Right infra-red pair's zone: `.zone`, 0 nothing to 5 nearest."""
        seen = self.observation
        return seen.equipment.right_zone(seen.slow)

    @property
    def turret(self) -> Turret:
        """Turret as driven now: `.angle` (rad, counter-clockwise from ahead), or None: free."""
        seen = self.observation
        return seen.equipment.turret(seen.slow)

    @property
    def buzzer(self) -> Buzzer:
        """Buzzer: `.token` of the last tone that the board began."""
        seen = self.observation
        return seen.equipment.buzzer(seen.slow)

    def has(self, name: str) -> bool:
        """Whether the robot has that device ("ping", "left_ir"), or all of that group ("whiskers", "infrared")."""
        return self.observation.equipment.has(name)

    @property
    def dimensions(self) -> Dimensions:
        """Lengths of the robot, and how fast it is, by its description."""
        return self.observation.equipment.dimensions

    # ---- motors --------------------------------------------------------------------------------------------

    @property
    def speed_limit(self) -> float:
        """Greatest wheel speed that `drive_speed` takes (m/s)."""
        return self._speed_limit

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
            BrainError: a speed is beyond 0.5 m/s (without a board: the wheels' greatest) or no number.
        """
        limit = self._speed_limit
        try:
            within = -limit <= left <= limit and -limit <= right <= limit
        except (TypeError, ValueError):
            raise _no_numbers("drive_speed", left, right) from None
        if not within:
            raise BrainError(f"drive_speed({left}, {right}): wheel speeds go from -{limit:g} to {limit:g} m/s")
        self.command = Command("speed", left, right)

    def stop(self) -> None:
        """Switches the motors off until the next command: no pulses, the wheels turn freely. The turret stays, and a
        tone goes on."""
        self.command = STOP

    def emergency_stop(self) -> None:
        """Stops the motors and latches them off: no command moves them until `arm`. The turret is released and the
        buzzer silenced; where the turret shall look then has to be said again, and it turns after `arm`."""
        self.command = STOP
        self.slow_command = None
        self.latched = True

    def arm(self) -> None:
        """Ends what `emergency_stop` began: the next command moves the motors again."""
        self.latched = False

    # ---- turret and buzzer ---------------------------------------------------------------------------------

    def turn_turret(self, angle: float) -> None:
        """Turns the turret to an angle in radians, counter-clockwise from straight ahead; it holds until the next one,
        `release_turret` or `emergency_stop`. What stops the motors for a while (dead-man, reset) frees it meanwhile.

        Raises:
            BrainError: the robot has no turret, or the angle is beyond 1.6 rad or no number.
        """
        self._need("turret", "turn_turret")
        try:
            within = -turret.ANGLE_MAX <= angle <= turret.ANGLE_MAX
        except (TypeError, ValueError):
            raise BrainError(f"turn_turret({angle!r}) expects a number") from None
        if not within:
            raise BrainError(f"turn_turret({angle}): angles go from -{turret.ANGLE_MAX} to {turret.ANGLE_MAX} rad")
        self.slow_command = (self.slow_command or NO_SLOW_COMMAND)._replace(turret=turret.command(angle))

    def release_turret(self) -> None:
        """No pulses for the turret: it is free.

        Raises:
            BrainError: the robot has no turret.
        """
        self._need("turret", "release_turret")
        self.slow_command = (self.slow_command or NO_SLOW_COMMAND)._replace(turret=turret.command(None))

    def beep(self, frequency: float, seconds: float) -> None:
        """Sounds a tone (Hz, s) in place of the one that sounds, also while the motors are latched off; 0 Hz or 0 s:
        silence. Whatever stops the motors silences it.

        Raises:
            BrainError: the robot has no buzzer, or it has no such tone.
        """
        self._need("buzzer", "beep")
        try:
            tone = buzzer.command(frequency, seconds, 0)  # the link gives it its token
        except TypeError:
            raise BrainError(f"beep({frequency!r}, {seconds!r}) expects two numbers") from None
        except ValueError as error:
            raise BrainError(f"beep({frequency}, {seconds}): {error}") from None
        self.slow_command = (self.slow_command or NO_SLOW_COMMAND)._replace(tone=tone)

    def _need(self, device: str, call: str) -> None:
        if not self.observation.equipment.has(device):
            raise BrainError(f"{call}(): robot {self.name!r} has no {device}")

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

    def stream(self, name: str) -> random.Random:
        """A `random.Random` for one part of the brain, whose numbers do not depend on what others draw."""
        return random.Random(f"brain {self._seed} {name}")


def _no_numbers(call: str, left: object, right: object) -> BrainError:
    return BrainError(f"{call}({left!r}, {right!r}) expects two numbers")
