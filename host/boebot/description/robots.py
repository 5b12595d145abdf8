"""Robot descriptions: what a robot is, said once in `protocol/robots/*.toml`.

From one description come the firmware's pin header and parameter defaults (`protocol/generate.py`), what the host
expects of the board (`boebot.run`) and how the simulated world is joined to the pins (`sim_bridge`). Units stand in the
keys' names; lengths are in the robot's frame, x forward, y left, origin at the middle of the axle.
"""

from __future__ import annotations

import math
import reprlib
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import msgspec

from boebot import resources
from boebot.description import toml_files
from boebot.devices.device import Device as Device
from boebot.devices.device import pin_name as pin_name
from boebot.devices.device import pin_number as pin_number
from boebot.devices.vehicle_devices import AnyVehicleDevice, Energy, Laser, Motor, VehicleDevice
from boebot.errors import RobotError
from boebot.geometry import Point, polygon_fault, way_out

Positive = Annotated[float, msgspec.Meta(gt=0)]
NotNegative = Annotated[float, msgspec.Meta(ge=0)]

OUTLINE_CORNERS_MAXIMUM = 32
VEHICLE_SENSORS_MAXIMUM = 24


class Body(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Masses and lengths of the robot (SI units)."""

    mass_kg: Positive
    inertia_kg_m2: Positive
    radius_m: Positive
    track_width_m: Positive
    wheel_radius_m: Positive
    wheel_mass_kg: NotNegative
    wheel_inertia_kg_m2: NotNegative
    linear_damping_n_s_m: NotNegative
    angular_damping_n_m_s: NotNegative
    wheel_speed_maximum_m_s: Positive
    outline_m: list[Point] = []  # collision outline around the axle's middle; none: the circle of radius_m
    tyre_grip: NotNegative | None = None  # friction coefficient; none: as any rubber tyre's (imperfections)
    tyre_slip: bool | None = None  # whether tyres slip beyond it; none: yes with a board, no without, as in the notes

    @property
    def front_m(self) -> float:
        """From the axle's middle straight ahead to the body's edge."""
        return way_out(self.outline_m) if self.outline_m else self.radius_m

    @property
    def reach_m(self) -> float:
        """Radius of the circle about the axle's middle that holds the body."""
        return max((math.hypot(x, y) for x, y in self.outline_m), default=self.radius_m)


class Supply(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Battery pack and regulator of a robot with a board."""

    full_v: Positive  # open-circuit voltage of the full pack
    empty_v: NotNegative  # and of the empty one
    capacity_as: Positive  # between the two
    resistance_ohm: NotNegative  # inside the pack and on the way from it
    drop_out_v: NotNegative  # of the 5 V regulator
    servos: Literal["regulated", "pack"]  # what they run on
    minimum_v: Annotated[float, msgspec.Meta(ge=0, le=5.5)]  # of the board, below which its motors are off
    charge: Annotated[float, msgspec.Meta(ge=0, le=1)] = 1.0  # left as a simulated run begins, of the capacity
    charger_a: NotNegative = 1.0  # flows into the pack at a charging station (chosen: C/2 of 2,000 mA h)


_ANALOG = tuple(range(14, 20))


class ContinuousServo(Device, tag="continuous_servo", frozen=True, kw_only=True):
    """A servo modified for continuous rotation: the pulse sets the wheel's speed."""

    pin: int | str
    centre_us: Annotated[float, msgspec.Meta(ge=1400, le=1600)]
    gain_us: Annotated[float, msgspec.Meta(ge=-200, le=200)]  # pulse offset at full forward signal

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"Timer1 compare A": "servo edges"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": (8, 9, 10, 11, 12, 13)}


class PositionServo(Device, tag="position_servo", frozen=True, kw_only=True):
    """A servo that turns to an angle: pulse = centre + gain * angle. A Ping, where there is one, is mounted on it."""

    pin: int | str
    position_m: Point  # of its axis
    centre_us: Annotated[float, msgspec.Meta(ge=1000, le=2000)] = 1500.0
    gain_us_per_rad: Annotated[float, msgspec.Meta(ge=-1000, le=1000)] = 573.0  # 10 us a degree

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"Timer1 compare A": "servo edges"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": (8, 9, 10, 11, 12, 13)}


class Encoder(Device, tag="encoder", frozen=True, kw_only=True):
    """Single-channel wheel encoder: both edges counted, direction unknown."""

    pin: int | str
    edges_per_turn: Annotated[int, msgspec.Meta(ge=2, le=4096)]
    LINES: ClassVar[int] = 1

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"pin-change interrupt of port C": "encoders"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": _ANALOG}


class QuadratureEncoder(Device, tag="quadrature_encoder", frozen=True, kw_only=True):
    """Two-channel wheel encoder: four edges per period, direction known."""

    pin_a: int | str
    pin_b: int | str
    edges_per_turn: Annotated[int, msgspec.Meta(ge=4, le=4096)]  # of both lines together
    LINES: ClassVar[int] = 2

    PINS: ClassVar[dict[str, str]] = {"pin_a": "a", "pin_b": "b"}
    NEEDS: ClassVar[dict[str, str]] = {"pin-change interrupt of port C": "encoders"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin_a": _ANALOG, "pin_b": _ANALOG}


class Whisker(Device, tag="whisker", frozen=True, kw_only=True):
    """A wire that closes a switch to ground when it is bent."""

    pin: int | str
    root_m: Point
    tip_m: Point

    PINS: ClassVar[dict[str, str]] = {"pin": ""}


class InfraredPair(Device, tag="infrared_pair", frozen=True, kw_only=True):
    """An infra-red LED and a 38 kHz receiver that looks the same way."""

    led_pin: int | str
    receiver_pin: int | str
    position_m: Point
    heading_rad: float
    beam_rad: Positive
    range_m: Positive

    PINS: ClassVar[dict[str, str]] = {"led_pin": "led", "receiver_pin": "receiver"}
    NEEDS: ClassVar[dict[str, str]] = {"Timer2": "infra-red carrier"}


class InfraredSchedule(Device, tag="infrared_schedule", frozen=True, kw_only=True):
    """How often the IR pairs are read."""

    period_ticks: Annotated[int, msgspec.Meta(ge=2, le=250)]
    sweep: bool = False  # flash at five frequencies in turn: zones of distance


class Ping(Device, tag="ping", frozen=True, kw_only=True):
    """Parallax Ping))): an ultrasonic range finder on one pin."""

    pin: int | str
    position_m: Point
    heading_rad: float
    beam_rad: Positive
    range_min_m: Positive
    range_max_m: Positive
    period_ticks: Annotated[int, msgspec.Meta(ge=4, le=250)]

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"Timer1 input capture": ""}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": (8,)}


class Battery(Device, tag="battery", frozen=True, kw_only=True):
    """Battery voltage behind a divider."""

    pin: int | str
    ratio: Annotated[float, msgspec.Meta(ge=1)] = 2.0  # voltage of the pack for each volt at the pin

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"analog converter": "analog inputs"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": _ANALOG}


class AnalogInfrared(Device, tag="analog_infrared", frozen=True, kw_only=True):
    """Sharp analog infra-red distance sensor."""

    pin: int | str
    position_m: Point
    heading_rad: float

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"analog converter": "analog inputs"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": _ANALOG}


class LightSensor(Device, tag="light_sensor", frozen=True, kw_only=True):
    """Phototransistor read by its RC decay time."""

    pin: int | str
    position_m: Point
    heading_rad: float

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    # Port D has a pin-change interrupt of its own; on port C the encoders' interrupt stamps the edge, on pin 8 Timer1.
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": (*range(9), *_ANALOG)}


class Compass(Device, tag="compass", frozen=True, kw_only=True):
    """HMC5883L on the two-wire bus."""

    sda_pin: int | str
    scl_pin: int | str
    offset_counts: tuple[float, float] = (0.0, 0.0)  # of the robot's own iron along x and y, at 1090 counts a gauss

    PINS: ClassVar[dict[str, str]] = {"sda_pin": "sda", "scl_pin": "scl"}
    NEEDS: ClassVar[dict[str, str]] = {"two-wire interface": "two-wire bus"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"sda_pin": (18,), "scl_pin": (19,)}


class Buzzer(Device, tag="buzzer", frozen=True, kw_only=True):
    """Piezo speaker."""

    pin: int | str

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    NEEDS: ClassVar[dict[str, str]] = {"Timer0": ""}


class Uart(Device, tag="uart", frozen=True, kw_only=True):
    """The serial line to the host."""

    receive_pin: int | str
    transmit_pin: int | str
    baud: Annotated[int, msgspec.Meta(ge=9600, le=1_000_000)]

    PINS: ClassVar[dict[str, str]] = {"receive_pin": "receive", "transmit_pin": "transmit"}
    NEEDS: ClassVar[dict[str, str]] = {"USART0": ""}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"receive_pin": (0,), "transmit_pin": (1,)}


AnyDevice = (
    ContinuousServo
    | PositionServo
    | Encoder
    | QuadratureEncoder
    | Whisker
    | InfraredPair
    | InfraredSchedule
    | Ping
    | Battery
    | AnalogInfrared
    | LightSensor
    | Compass
    | Buzzer
    | Uart
    | AnyVehicleDevice
)

NO_BOARD = "none"  # the board of a robot that is driven by motor signals


class RobotDescription(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One robot. `device` maps names such as "servo_left" to their descriptions."""

    name: str
    title: str
    board: str
    body: Body
    device: dict[str, AnyDevice]
    pin_map: str = ""  # of the board's firmware
    supply: Supply | None = None  # of the board; a robot without a board has none
    unit: Annotated[int, msgspec.Meta(ge=0, lt=1 << 32)] | None = None
    """serial number of a simulated robot: what its parts are like is drawn by it and stays from run to run, whatever
    the seed; 0: nominal. Without one each seed draws another robot."""

    @property
    def has_board(self) -> bool:
        """Whether a board drives it; otherwise motor signals do, in the simulated world only."""
        return self.board != NO_BOARD

    @property
    def encoder_gap_us(self) -> float:
        """Edges of one encoder line that follow faster are bounces (us): a quarter of the time between two edges at the
        wheel's top speed. 0: there are no encoders."""
        encoder = self.device.get("encoder_left")
        if not isinstance(encoder, Encoder | QuadratureEncoder):
            return 0.0
        edge_m = 2 * math.pi * self.body.wheel_radius_m * encoder.LINES / encoder.edges_per_turn
        return min(0.25 * edge_m / self.body.wheel_speed_maximum_m_s * 1e6, 65535.0)

    def has(self, name: str) -> bool:
        """Whether the robot has a device of that name, switched on."""
        return name in self.device and self.device[name].on


def robot_names() -> list[str]:
    """The bundled robots."""
    return toml_files.bundled_names("robots")


def load_robot(robot: str | Path) -> RobotDescription:
    """The robot of that bundled name, or described by that file.

    Raises:
        RobotError: unknown robot, unreadable file, wrong key or value, or devices that cannot live on one board.
    """
    path = toml_files.find("robots", robot, RobotError)
    table = _read(path, seen=())
    description = toml_files.convert(table, RobotDescription, path.name, RobotError)
    if description.body.outline_m and (fault := polygon_fault(description.body.outline_m, OUTLINE_CORNERS_MAXIMUM)):
        place = f"body.outline_m{fault.partition(' ')[0].rstrip(':')}"
        raise RobotError(f"{toml_files.where(table, path.name, place)}: body.outline_m{fault}")
    if description.has_board:
        _check_supply(description, path.name)
        _check_pins(description, path.name)
        _check_image(description, path)
    else:
        _check_vehicle(description, path.name)
        _check_vehicle_devices(description, table, path.name)
    return description


def _read(path: Path, seen: tuple[Path, ...]) -> dict[str, Any]:
    """The file's table, laid over the robot that it extends."""
    table = toml_files.read(path, RobotError)
    base_name = table.pop("extends", None)
    removed = table.pop("remove", [])
    if not isinstance(table.get("device", {}), dict):
        raise RobotError(f"{path.name}: device: expected a table of devices")
    if base_name is None:
        return table
    if not isinstance(base_name, str):
        raise RobotError(f"{path.name}: extends: expected the name of a robot, got {reprlib.repr(base_name)}")
    if not (isinstance(removed, list) and all(isinstance(name, str) for name in removed)):
        raise RobotError(f"{path.name}: remove: expected a list of devices, got {reprlib.repr(removed)}")
    base_path = toml_files.find("robots", base_name, RobotError)
    if base_path in seen:
        raise RobotError(f"{path.name} extends itself by way of {base_name!r}")
    base = _read(base_path, (*seen, path))
    for name in removed:
        if base.get("device", {}).pop(name, None) is None:
            raise RobotError(f"{path.name} removes device {name!r}, which {base_name!r} does not have")
    return toml_files.overlaid(_overlay(base, table), table, base)


def _overlay(base: dict[str, Any], top: dict[str, Any]) -> dict[str, Any]:
    """`top` over `base`; a table that names its type replaces the whole table below it."""
    merged = dict(base)
    for key, value in top.items():
        below = merged.get(key)
        if isinstance(value, dict) and isinstance(below, dict) and "type" not in value:
            merged[key] = _overlay(below, value)
        else:
            merged[key] = value
    return merged


def _check_supply(robot: RobotDescription, file: str) -> None:
    """Refuses a board without a supply, and a pack that is fuller empty than full."""
    supply = robot.supply
    if supply is None:
        raise RobotError(f"{file}: supply is missing; expected the table of the pack that the board runs on")
    if not supply.full_v > supply.empty_v:
        raise RobotError(
            f"{file}: supply.full_v is {supply.full_v:g}; expected more than empty_v, {supply.empty_v:g} V"
        )


def _check_pins(robot: RobotDescription, file: str) -> None:
    """Refuses devices that cannot share a pin or a unit of the chip (ATmega328P data sheet), naming both."""
    pin_owner: dict[int, str] = {}
    unit_owner: dict[str, tuple[str, str]] = {}
    for name, device in robot.device.items():
        if isinstance(device, VehicleDevice):
            kind = device.__struct_config__.tag
            raise RobotError(f"{file}: device.{name} is {kind}, which only a robot without a board can have")
        try:
            pins = {field: pin_number(getattr(device, field)) for field in device.PINS}
        except ValueError as error:
            raise RobotError(f"{file}: device.{name}: {error}") from None
        for field, pin in pins.items():
            allowed = device.ONLY_PINS.get(field)
            if allowed is not None and pin not in allowed:
                expected = ", ".join(pin_name(number) for number in allowed)
                raise RobotError(
                    f"{file}: device.{name}.{field} is pin {pin_name(pin)}, which cannot do that; expected {expected}"
                )
            if pin in pin_owner:
                raise RobotError(f"{file}: {pin_owner[pin]} and {name} cannot share pin {pin_name(pin)}")
            pin_owner[pin] = name
        for unit, group in device.NEEDS.items():
            owner, owner_group = unit_owner.setdefault(unit, (name, group))
            if owner != name and (group == "" or group != owner_group):
                raise RobotError(f"{file}: {owner} and {name} cannot share {unit}")


def _check_vehicle(robot: RobotDescription, file: str) -> None:
    """Refuses pins, a supply and a drive that is none."""
    if robot.supply is not None:
        raise RobotError(
            f"{file}: supply is given, but a robot without a board has none; its devices say their voltages"
        )
    if robot.pin_map:
        raise RobotError(f"{file}: pin_map is {robot.pin_map!r}, but a robot without a board has no pins")
    for name, device in robot.device.items():
        if not isinstance(device, VehicleDevice):
            kind = device.__struct_config__.tag
            raise RobotError(f"{file}: device.{name} is {kind}, which needs a board's pins, but board is {NO_BOARD!r}")
        if not device.plugged:
            raise RobotError(f"{file}: device.{name}.plugged is false, but a robot without a board has no plugs")
    for name in ("motor_left", "motor_right"):
        if not (robot.has(name) and isinstance(robot.device[name], Motor)):
            raise RobotError(
                f"{file}: device.{name} is missing or off; a robot without a board needs a dc_motor or regulated_motor"
            )
    left, right = (robot.device[name].__struct_config__.tag for name in ("motor_left", "motor_right"))
    if left != right:
        raise RobotError(f"{file}: device.motor_right is {right}, device.motor_left {left}; expected the same type")


def _check_vehicle_devices(robot: RobotDescription, table: dict[str, Any], file: str) -> None:
    """Refuses what no model of a vehicle takes: keys that do not fit each other, too many sensors."""
    sensors: list[VehicleDevice] = []
    for name, device in robot.device.items():
        if not isinstance(device, VehicleDevice) or not device.on:
            continue
        if fault := device.fault():
            key = f"device.{name}.{fault[0]}"
            raise RobotError(f"{toml_files.where(table, file, key)}: {key}{fault[1]}")
        if isinstance(device, Motor):
            continue
        at = f"{toml_files.where(table, file, f'device.{name}')}: device.{name}"
        if isinstance(device, (Laser, Energy)) and any(type(other) is type(device) for other in sensors):
            raise RobotError(f"{at} is a second {device.__struct_config__.tag}; expected one")
        sensors.append(device)
        if len(sensors) > VEHICLE_SENSORS_MAXIMUM:
            raise RobotError(f"{at} is one sensor too many; expected at most {VEHICLE_SENSORS_MAXIMUM}")


_ALWAYS = ("servo_left", "servo_right", "uart")  # what no firmware image can do without


def _check_image(robot: RobotDescription, path: Path) -> None:
    """Refuses what the firmware of the robot's pin map cannot do: other pins or devices than it was built with."""
    file = path.name
    for name in _ALWAYS:
        if not robot.has(name):
            raise RobotError(f"{file}: device.{name} is missing or off; every robot needs it")
    owner = resources.folder("robots") / f"{robot.pin_map}.toml"
    if not owner.is_file() or owner.samefile(path):
        return  # a map of its own, with an image of its own
    image = load_robot(owner)
    for name, device in robot.device.items():
        built = image.device.get(name)
        if type(built) is not type(device) or (built is not None and built.pins() != device.pins()):
            there = "not there" if built is None else f"{built.__struct_config__.tag} on {_pins_text(built)}"
            raise RobotError(
                f"{file}: device.{name} is {device.__struct_config__.tag} on {_pins_text(device)}, but in the firmware "
                f"for pin map {robot.pin_map!r} it is {there}; expected the same, or a pin_map of the robot's own"
            )


def _pins_text(device: Device) -> str:
    pins = [pin_name(pin) for pin in device.pins().values()]
    return f"pin {pins[0]}" if len(pins) == 1 else f"pins {', '.join(pins)}"
