"""What a brain touches: an immutable `Observation` of the sensors, a `Command` for the motors, and `Robot`,
the friendly face of both.

    def step(robot: Robot) -> None:
        if robot.whisker_left.pressed:
            robot.drive(-0.5, -0.2)
        else:
            robot.drive(0.5, 0.5)

A brain sees what the robot's own sensors, motors and clock give, and nothing else: here is no
way to the simulated world, to the board or to the link.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from boebot.description.equipment import Dimensions
from boebot.description.equipment import Equipment as Equipment
from boebot.devices import buzzer, turret
from boebot.devices.attributes import Attributes
from boebot.devices.latest import NO_MESSAGES, Latest
from boebot.devices.readings import Readings
from boebot.errors import BrainError
from boebot.link.messages import Buzzer as BuzzerMessage
from boebot.link.messages import Status, Telemetry
from boebot.link.messages import Turret as TurretMessage
from boebot.showing import Grid, Showing

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

SPEED_LIMIT: Final = 0.5  # m/s; the widest set-point in speed that the protocol carries


class Command(NamedTuple):
    """What the brain wants of the motors; it never changes.

    Attributes:
        kind: "signal" (-1 full backward .. 1 full forward), "speed" (m/s along the ground) or "stop" (no pulses: the
            wheels turn freely).
        left: of the left wheel: motor signal, -1 to 1, or m/s, as `kind` says; 0 with "stop".
        right: of the right wheel, the same.
    """

    kind: str
    left: float
    right: float


STOP: Final = Command("stop", 0.0, 0.0)


class SlowCommand(NamedTuple):
    """What a brain asks of turret and buzzer; None: nothing new."""

    turret: TurretMessage | None = None
    tone: BuzzerMessage | None = None


NO_SLOW_COMMAND: Final = SlowCommand()


class _Fields(NamedTuple):
    sample: Telemetry | Readings
    """What the devices said: a board's telemetry, or the readings of a robot without one."""
    equipment: Equipment
    time: float
    """Seconds since the run began, by the board's clock."""
    board_time: float = 0.0
    """Seconds since the board was reset, by its clock: the start of the tick."""
    host_time: float = 0.0
    """The same instant on the host's clock, `time.perf_counter()` (s; of a simulated board its simulated clock)."""
    host_time_error: float = float("inf")
    """Error bound of `host_time` (s): the true instant lies within it, whatever the line's delays are, as long as the
    board's clock keeps its rate."""
    slow: Latest | Readings = NO_MESSAGES
    """The newest messages of the slow devices; of a robot without a board the same as `sample`."""


class Observation(_Fields, Attributes):
    """What the robot's sensors said at one tick. It never changes; values are computed when they are looked at.

    Each device is an attribute by its name: a reading with its values in SI units, their `age` (s) and whether they are
    `valid`.
    """

    __slots__ = ()

    @property
    def tick(self) -> int:
        """The board's control tick that this observation belongs to."""
        return self.sample.tick

    @property
    def status(self) -> Status:
        """State and faults of the board."""
        return Status(self.sample.status)

    if not TYPE_CHECKING:  # who knows the names of devices by boebot.devices.attributes

        def __getattr__(self, name):
            reader = self.equipment.readers.get(name)
            if reader is None:
                raise self.equipment.no_device(name, [*dir(type(self)), *self.equipment.readers])
            return reader(self.sample, self.slow)


class Robot(Attributes):
    """The robot as a brain meets it: sensors to read, motors to drive, a clock and a seeded source of chance.

    The same object is handed to every step of a run; its sensors always show the newest observation.
    """

    __slots__ = (
        "_period",
        "_seed",
        "_speed_limit",
        "command",
        "latched",
        "name",
        "observation",
        "random",
        "showing",
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
        self.showing = Showing()
        """What the brain shows."""

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

    if not TYPE_CHECKING:

        def __getattr__(self, name):
            if name == "observation":
                raise AttributeError("the robot has not been observed yet")
            seen = self.observation
            reader = seen.equipment.readers.get(name)
            if reader is None:
                raise seen.equipment.no_device(name, [*dir(type(self)), *seen.equipment.readers])
            return reader(seen.sample, seen.slow)

    def has(self, name: str) -> bool:
        """Whether the robot has that device ("ping"), or all of that group ("whiskers", "infrared")."""
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

    # ---- what the brain shows --------------------------------------------------------------------------------

    def show(self, name: str, value: float | str | None) -> None:
        """Shows a value: a column `shown_NAME` of run.csv, a curve on the replay page. It holds until the next one.

        Args:
            name: up to 32 of them; with its unit, as in "goal_distance_m".
            value: a number, a truth value, or a text of 100 characters at most; None: it is shown no longer.

        Raises:
            BrainError: name or value is none of these.
        """
        self.showing.show(self.observation.time, name, value)

    def sketch(
        self,
        layer: str,
        *,
        lines: Sequence[ArrayLike] = (),
        points: ArrayLike = (),
        grid: Grid | None = None,
        frame: str = "start",
    ) -> None:
        """Draws on the arena, in picture and replay: a layer that holds until the next sketch of the same name. Without
        lines, points and grid it is empty again. A layer changes ten times a second at most, and what a brain shows
        comes to 50 kB a second in the long run; what is more is left out, and the run says so.

        Args:
            layer: its name, up to 32 of them.
            lines: each a list of points (x, y) in m.
            points: pairs (x, y) in m, shape (n, 2); with those of the lines up to 20,000.
            grid: a table of cells, up to 250,000 of them.
            frame: "start": from where the robot stood when the run began, x ahead, as odometry counts; "arena": the
                arena's coordinates; "robot": from where the robot is, x ahead, as its sensors see.

        Raises:
            BrainError: they are none of these.
        """
        self.showing.sketch(self.observation.time, layer, lines, points, grid, frame)

    # ---- chance --------------------------------------------------------------------------------------------

    def chance(self, probability: float, per: float | None = None) -> bool:
        """True with that probability.

        Args:
            probability: 0..1, of happening within `per` seconds.
            per: seconds that the probability is meant for. A brain that asks once per step then behaves alike at every
                brain period: p' = 1 - (1 - p)^(period / per). None: the probability is meant as it stands.
        """
        if per is not None:
            probability = 1.0 - (1.0 - probability) ** (self._period / per)
        return self.random.random() < probability

    def stream(self, name: str) -> random.Random:
        """A `random.Random` for one part of the brain, whose numbers do not depend on what others draw."""
        return random.Random(f"brain {self._seed} {name}")


def _no_numbers(call: str, left: object, right: object) -> BrainError:
    return BrainError(f"{call}({left!r}, {right!r}) expects two numbers")
