"""The devices of one robot, ready to be read: from a board's telemetry, or from the readings of a robot without one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final, NamedTuple, NoReturn

from boebot.description import robots
from boebot.devices.analog_infrared import AnalogInfrared, AnalogInfraredReader
from boebot.devices.battery import Battery, BatteryReader
from boebot.devices.buzzer import Buzzer, BuzzerReader
from boebot.devices.compass import Compass, CompassReader
from boebot.devices.encoder import Encoder, EncoderReader
from boebot.devices.freshness import MESSAGE_TICKS
from boebot.devices.infrared import Infrared, InfraredReader, InfraredZone, InfraredZoneReader
from boebot.devices.light import Light, LightReader
from boebot.devices.ping import Ping, PingReader
from boebot.devices.readings import Heading, Layout, OdometerPose, Proximity, Reading, Scan, readers
from boebot.devices.servo import Servo, ServoReader
from boebot.devices.told import Told
from boebot.devices.turret import Turret, TurretReader
from boebot.devices.whisker import Whisker, WhiskerReader
from boebot.errors import BrainError
from boebot.link import messages

# What a brain may name in NEEDS besides a single device.
GROUPS: Final[dict[str, tuple[str, ...]]] = {
    "whiskers": ("left_whisker", "right_whisker"),
    "infrared": ("left_ir", "right_ir"),
    "encoders": ("left_encoder", "right_encoder"),
    "servos": ("left_servo", "right_servo"),
    "lights": ("left_light", "right_light"),
    "zones": ("left_zone", "right_zone"),
}


class Dimensions(NamedTuple):
    """What is known of a robot by its description; those of the one at hand may be a little different."""

    track_width: float
    """m, between the wheels' middles"""
    wheel_radius: float
    """m"""
    radius: float
    """m, of the circle about the body"""
    speed: float
    """m/s along the ground at motor signal 1"""


class Equipment:
    """The devices of one robot, ready to be read: one reader per device, called with a telemetry message, those from
    `left_light` on with what the board told of its slow devices; for a robot without a board all with its readings.

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
        "odometer",
        "laser",
        "accelerometer",
        "left_light",
        "right_light",
        "compass",
        "battery",
        "analog_ir",
        "left_zone",
        "right_zone",
        "turret",
        "buzzer",
    )
    left_whisker: Callable[[Any], Whisker]
    right_whisker: Callable[[Any], Whisker]
    left_ir: Callable[[Any], Infrared | Proximity]
    right_ir: Callable[[Any], Infrared | Proximity]
    ping: Callable[[Any], Ping]
    left_encoder: Callable[[Any], Encoder]
    right_encoder: Callable[[Any], Encoder]
    left_servo: Callable[[Any], Servo]
    right_servo: Callable[[Any], Servo]
    odometer: Callable[[Any], OdometerPose]
    laser: Callable[[Any], Scan]
    accelerometer: Callable[[Any], Reading]
    left_light: Callable[[Any], Light]
    right_light: Callable[[Any], Light]
    compass: Callable[[Any], Compass | Heading]
    battery: Callable[[Any], Battery]
    analog_ir: Callable[[Any], AnalogInfrared]
    left_zone: Callable[[Any], InfraredZone]
    right_zone: Callable[[Any], InfraredZone]
    turret: Callable[[Any], Turret]
    buzzer: Callable[[Any], Buzzer]

    def __init__(
        self,
        robot: robots.RobotDescription,
        tick_s: float,
        layout: Layout | None = None,
        told_ticks: int = MESSAGE_TICKS,
    ) -> None:
        """`layout`: where the readings of a robot without a board stand, once that is known. `told_ticks`: from one
        message of a board's slow devices to the next."""
        self.robot_name = robot.name
        self.tick_s = tick_s
        body = robot.body
        self.dimensions = Dimensions(
            body.track_width_m, body.wheel_radius_m, body.radius_m, body.wheel_speed_maximum_m_s
        )
        found: dict[str, Any] = {}
        slow: dict[str, Any] = {}
        if robot.has_board:
            slow = {name: _of_told(reader) for name, reader in slow_readers(robot, tick_s, told_ticks).items()}
            found = _board_readers(robot, tick_s) | slow
        else:
            found.update(readers(robot, layout or {name: slice(0, 1) for name in robot.device if robot.has(name)}))
        groups = [group for group, members in GROUPS.items() if found.keys() >= set(members)]
        self._found = frozenset((*found, *groups))
        self.tells_slowly = bool(slow)
        """The board sends messages of slow devices."""
        for name in self.NAMES:
            setattr(self, name, found.get(name) or self._refusal(name))

    def _refusal(self, name: str) -> Callable[[Any], NoReturn]:
        sentence = f"robot {self.robot_name!r} has no {name}"

        def refuse(_: object) -> NoReturn:
            raise BrainError(sentence)

        return refuse

    def has(self, name: str) -> bool:
        """Whether the robot has the device, by the name that a brain uses ("ping", "left_ir"), or all of a group."""
        return name in self._found

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


SlowReader = Callable[[messages.DevicesTelemetry, float], Any]


def slow_readers(
    robot: robots.RobotDescription, tick_s: float, told_ticks: int = MESSAGE_TICKS
) -> dict[str, SlowReader]:
    """One reader of devices_telemetry for each slow device of a board, by the brain's name of it; `told_ticks`: from
    one such message to the next."""
    found: dict[str, SlowReader] = {}
    for name, device in robot.device.items():
        if not device.on:
            continue
        match device:
            case robots.LightSensor() if name in ("light_left", "light_right"):
                side = name.removeprefix("light_")
                found[f"{side}_light"] = LightReader(side == "left", tick_s, told_ticks)
            case robots.Compass() if name == "compass":
                found["compass"] = CompassReader(tick_s, device.offset_counts, told_ticks)
            case robots.Battery() if name == "battery":
                found["battery"] = BatteryReader(device.ratio, tick_s, told_ticks)
            case robots.AnalogInfrared() if name == "analog_infrared":
                found["analog_ir"] = AnalogInfraredReader(tick_s, told_ticks)
            case robots.PositionServo() if name == "turret":
                found["turret"] = TurretReader(device.centre_us, device.gain_us_per_rad, tick_s, told_ticks)
            case robots.Buzzer() if name == "buzzer":
                found["buzzer"] = BuzzerReader(tick_s, told_ticks)
            case robots.InfraredSchedule() if name == "infrared" and device.sweep:
                for side in ("left", "right"):
                    if robot.has(f"infrared_{side}"):
                        found[f"{side}_zone"] = InfraredZoneReader(
                            side == "left", device.period_ticks, tick_s, told_ticks
                        )
    return found


def _of_told(reader: SlowReader) -> Callable[[Told], Any]:
    return lambda told: reader(told.devices, told.since)


def _board_readers(robot: robots.RobotDescription, tick_s: float) -> dict[str, Any]:
    """One reader of telemetry for each device of a board that a brain can see, by the brain's name of it."""
    device = {name: entry for name, entry in robot.device.items() if entry.on}
    schedule = device.get("infrared")
    infrared_period = schedule.period_ticks if isinstance(schedule, robots.InfraredSchedule) else 5
    found: dict[str, Any] = {}
    for side, left in (("left", True), ("right", False)):
        if isinstance(device.get(f"whisker_{side}"), robots.Whisker):
            found[f"{side}_whisker"] = WhiskerReader(messages.Whiskers.LEFT if left else messages.Whiskers.RIGHT)
        if isinstance(device.get(f"infrared_{side}"), robots.InfraredPair):
            bit = messages.Infrared.LEFT if left else messages.Infrared.RIGHT
            found[f"{side}_ir"] = InfraredReader(bit, infrared_period, tick_s)
        encoder = device.get(f"encoder_{side}")
        if isinstance(encoder, robots.Encoder | robots.QuadratureEncoder):
            directed = isinstance(encoder, robots.QuadratureEncoder)
            radius_m = robot.body.wheel_radius_m
            found[f"{side}_encoder"] = EncoderReader(left, encoder.edges_per_turn, radius_m, directed)
        servo = device.get(f"servo_{side}")
        if isinstance(servo, robots.ContinuousServo):
            found[f"{side}_servo"] = ServoReader(left, servo.centre_us, servo.gain_us)
    sonar = device.get("ping")
    if isinstance(sonar, robots.Ping):
        found["ping"] = PingReader(sonar.range_min_m, sonar.range_max_m, sonar.period_ticks, tick_s)
    return found
