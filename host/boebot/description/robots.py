"""Robot descriptions: what a robot is, said once in `protocol/robots/*.toml`.

From one description come the firmware's pin header and parameter defaults (`protocol/generate.py`), what the host
expects of the board (`boebot.run`) and how the simulated world is joined to the pins (`sim_bridge`). Units are in the
keys' names; lengths are in the robot's frame, x forward, y left, origin at the middle of the axle.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

import msgspec

from boebot import resources
from boebot.arenas.description import Point
from boebot.description import toml_files
from boebot.description.outlines import polygon_fault, way_out
from boebot.devices.battery import Energy
from boebot.devices.device import Device, VehicleDevice, kinds, pin_name, pin_number
from boebot.devices.encoder import WheelEncoder
from boebot.devices.h_bridge import HBridge
from boebot.devices.motor import Motor
from boebot.devices.servo import ContinuousServo
from boebot.devices.turret import PositionServo
from boebot.devices.uart import Uart
from boebot.errors import CallError, RobotError, did_you_mean
from boebot.imperfections import Imperfection, imperfections, switched_off, unknown

Positive = Annotated[float, msgspec.Meta(gt=0)]
NotNegative = Annotated[float, msgspec.Meta(ge=0)]

OUTLINE_CORNERS_MAXIMUM = 32

TAKEN = frozenset((
    "arm", "beep", "chance", "command", "device", "dimensions", "drive", "drive_speed", "emergency_stop", "has",
    "latched", "name", "observation", "period", "random", "release_turret", "show", "showing", "sketch", "slow_command",
    "speed_limit", "stop", "stream", "tick", "time", "turn_turret",
))  # fmt: skip
"""What a brain's `Robot` itself has under these names, which no device can have."""

Scheme = Literal["kit", "arsim"]
SCHEME_BODIES: dict[str, dict[str, float]] = {
    "arsim": {"linear_damping_n_s_m": 15.0, "angular_damping_n_m_s": 0.78},  # alpha, beta of ARSim 1.2
}
"""Keys of [body] that a file has by naming a scheme; those that it gives itself win."""


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


if TYPE_CHECKING:
    AnyDevice = Device
else:
    AnyDevice = Union[kinds()]  # noqa: UP007  # of which msgspec chooses by `type`

NO_BOARD = "none"  # the board of a robot that is driven by motor signals


class RobotDescription(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One robot. `device` maps names such as "servo_left" to their descriptions."""

    name: str
    title: str
    board: str
    body: Body
    device: dict[str, AnyDevice]
    scheme: Scheme = "kit"
    """of a robot without a board; "arsim": as the notes' simulator computes it, with R / 2 in the speeds of the motors'
    axes, each step of the odometer laid off at the heading after it, and the damping of ARSim 1.2."""
    pin_map: str = ""  # of the board's firmware
    firmware: Literal["kit", "none"] = "kit"
    """what its board runs; "none": programs of one's own, on whatever pins it is wired to, and nothing of the kit's"""
    supply: Supply | None = None  # of the board; a robot without a board has none
    unit: Annotated[int, msgspec.Meta(ge=0, lt=1 << 32)] | None = None
    """serial number of a simulated robot: what its parts are like is drawn by it and stays from run to run, whatever
    the seed; 0: nominal. Without one each seed draws another robot."""
    imperfections: dict[str, float] = {}
    """magnitudes of a simulated robot that are not as usual, by name (docs/reference/imperfections.md)"""

    @property
    def has_board(self) -> bool:
        """Whether a board drives it; otherwise motor signals do, in the simulated world only."""
        return self.board != NO_BOARD

    @property
    def takes_brain(self) -> bool:
        """Whether a brain can drive it: by the kit's firmware, or directly."""
        return self.firmware == "kit"

    @property
    def baud(self) -> int | None:
        """Bit rate of its serial line; None: it says none."""
        uart = self.device.get("uart")
        return uart.baud if isinstance(uart, Uart) else None

    def expect_kit(self) -> None:
        """Raises CallError where nothing of the kit's runs on its board."""
        if not self.takes_brain:
            raise CallError(
                f"robot {self.name!r} has no firmware of the kit, and so neither brain, image nor link; expected a "
                f"program of your own: boebot run FILE --robot {self.name}"
            )

    @property
    def encoder_gap_us(self) -> float:
        """Edges of one encoder line that follow faster are bounces (us): a quarter of the time between two edges at the
        wheel's top speed. 0: there are no encoders."""
        encoder = self.device.get("encoder_left")
        if not isinstance(encoder, WheelEncoder):
            return 0.0
        edge_m = encoder.LINES * encoder.metres_per_edge(self.body.wheel_radius_m)
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
    for place, fault in _faults(description, path):
        raise RobotError(f"{toml_files.where(table, path.name, place)}: {place}{fault}")
    return description


def _read(path: Path, seen: tuple[Path, ...]) -> dict[str, Any]:
    """The file's table, laid over the robot that it extends."""
    table = toml_files.read(path, RobotError)
    _add_scheme(table)
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
    devices = base.get("device", {})
    for name in removed:
        if name not in devices:
            hint = did_you_mean(name, devices)
            raise RobotError(f"{path.name} removes device {name!r}, which {base_name!r} does not have{hint}")
        del devices[name]
    for name, value in table.get("device", {}).items():
        if name not in devices and isinstance(value, dict) and "type" not in value:
            at = toml_files.where(table, path.name, f"device.{name}")
            raise RobotError(
                f"{at}: device.{name}: {base_name!r} has no such device; expected one of {', '.join(devices)}, or a "
                f"type for a new one{did_you_mean(name, devices)}"
            )
    return toml_files.overlaid(_overlay(base, table), table, base)


def _add_scheme(table: dict[str, Any]) -> None:
    """Gives a table that names a scheme the keys that come with it."""
    scheme, body = table.get("scheme"), table.get("body", {})
    if isinstance(scheme, str) and scheme in SCHEME_BODIES and isinstance(body, dict):
        table["body"] = SCHEME_BODIES[scheme] | body


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


Faults = Iterator[tuple[str, str]]
"""Place in the file ("": none that has a line), and the words behind it."""


def _faults(robot: RobotDescription, path: Path) -> Faults:
    """What its types do not say of a robot."""
    if robot.body.outline_m and (fault := polygon_fault(robot.body.outline_m, OUTLINE_CORNERS_MAXIMUM)):
        index = fault.partition(" ")[0].rstrip(":")
        yield f"body.outline_m{index}", fault.removeprefix(index)
    yield from _device_faults(robot)
    yield from _imperfection_faults(robot)
    if not robot.has_board:
        yield from _vehicle_faults(robot)
        return
    if robot.scheme != "kit":
        yield "scheme", f" is {robot.scheme!r}, which only a robot without a board can have"
    supply = robot.supply
    if supply is None:
        yield "", "supply is missing; expected the table of the pack that the board runs on"
    elif not supply.full_v > supply.empty_v:
        yield "supply.full_v", f" is {supply.full_v:g}; expected more than empty_v, {supply.empty_v:g} V"
    yield from _pin_faults(robot)
    yield from _wheel_faults(robot)
    if robot.takes_brain:
        yield from _kit_faults(robot)
        yield from _image_faults(robot, path)


def _device_faults(robot: RobotDescription) -> Faults:
    """Keys that do not fit each other, and names that a brain could not write."""
    for name, device in robot.device.items():
        if not name.isidentifier() or name[0] == "_" or (name in TAKEN and robot.takes_brain):
            yield f"device.{name}", ": a device cannot have this name; expected one that robot.NAME can have in a brain"
        if device.on and (fault := device.fault()):
            yield f"device.{name}.{fault[0]}", fault[1]
        for other in (device.carries or ()) if isinstance(device, PositionServo) else ():
            if other == name or not hasattr(robot.device.get(other), "position_m"):
                sensors = [each for each, one in robot.device.items() if each != name and hasattr(one, "position_m")]
                yield f"device.{name}.carries", f" names {other!r}; expected sensors, such as {', '.join(sensors)}"


def _imperfection_faults(robot: RobotDescription) -> Faults:
    """Names and magnitudes that are none, and what other keys of the file say."""
    known = imperfections()
    for name, value in robot.imperfections.items():
        if name not in known:
            yield f"imperfections.{name}", f": {unknown(name)}"
        elif (row := known[name]).key:
            said = f" is said elsewhere in a robot's file; expected {row.key} of {' or '.join(row.of)}"
            yield f"imperfections.{name}", said
        elif fault := row.fault(value):
            yield f"imperfections.{name}", fault


_OWN = '; or firmware = "none" for a robot that runs programs of your own'
"""Ends a sentence about what only the kit's firmware cannot do."""


def _pin_faults(robot: RobotDescription) -> Faults:
    """Pins that cannot do what is asked of them, and devices that cannot share one, both of which are named. A device
    that is off has its pins in the kit's images, too."""
    owners: dict[int, tuple[str, bool]] = {}
    for name, device in robot.device.items():
        if isinstance(device, VehicleDevice):
            yield f"device.{name}", f" is {device.__struct_config__.tag}, which only a robot without a board can have"
        for field in device.PINS:
            if getattr(device, field) is None:
                continue
            place = f"device.{name}.{field}"
            try:
                pin = pin_number(getattr(device, field))
            except ValueError as error:
                yield place, f": {error}"
                continue
            yield from _wrong_pin(place, pin, device.CHIP_PINS.get(field))
            if robot.takes_brain:
                yield from _wrong_pin(place, pin, device.ONLY_PINS.get(field), _OWN)
            elif not device.on:
                continue
            owner, owner_hears = owners.get(pin, ("", True))
            hears = field in device.HEARS
            if owner and (robot.takes_brain or not (hears or owner_hears)):
                both = device.on and robot.device[owner].on and not (hears or owner_hears)
                yield place, f": {owner} and {name} cannot share pin {pin_name(pin)}{'' if both else _OWN}"
            if not owner or owner_hears:
                owners[pin] = name, hears


def _wrong_pin(place: str, pin: int, allowed: Sequence[int] | None, remedy: str = "") -> Faults:
    if allowed is not None and pin not in allowed:
        expected = ", ".join(pin_name(number) for number in allowed)
        yield place, f" is pin {pin_name(pin)}, which cannot do that; expected {expected}{remedy}"


def _kit_faults(robot: RobotDescription) -> Faults:
    """What the kit's firmware cannot do: devices that it does not know, or two on one unit of the chip (ATmega328P data
    sheet), which are both named."""
    unit_owner: dict[str, tuple[str, str]] = {}
    for name, device in robot.device.items():
        kind = device.__struct_config__.tag
        if name not in device.NAMES:
            known = f"expected the name {' or '.join(device.NAMES)}, which the firmware knows"
            unknown = "which the kit's firmware does not know; expected another type"
            yield f"device.{name}", f" is {kind}{f'; {known}' if device.NAMES else f', {unknown}'}{_OWN}"
        for unit, group in device.NEEDS.items():
            owner, owner_group = unit_owner.setdefault(unit, (name, group))
            if owner != name and (group == "" or group != owner_group):
                yield f"device.{name}", f": {owner} and {name} cannot share {unit}{_OWN}"


def _vehicle_faults(robot: RobotDescription) -> Faults:
    """Without a board: pins, a supply, a drive that is none, a second battery (its devices empty one energy)."""
    if robot.supply is not None:
        yield "supply", " is given, but a robot without a board has none; its devices say their voltages"
    if robot.pin_map:
        yield "pin_map", f" is {robot.pin_map!r}, but a robot without a board has no pins"
    if not robot.takes_brain:
        yield "firmware", f" is {robot.firmware!r}, but a robot without a board runs none"
    if robot.unit is not None:
        yield "unit", f" is {robot.unit}, but nothing of a robot without a board is drawn by it"
    for name, device in robot.device.items():
        if not isinstance(device, VehicleDevice):
            kind = device.__struct_config__.tag
            yield f"device.{name}", f" is {kind}, which needs a board's pins, but board is {NO_BOARD!r}"
        elif not device.plugged:
            yield f"device.{name}.plugged", " is false, but a robot without a board has no plugs"
    for name in ("motor_left", "motor_right"):
        if not (robot.has(name) and isinstance(robot.device[name], Motor)):
            needs = "a robot without a board needs a dc_motor or regulated_motor"
            yield f"device.{name}", f" is missing or off; {needs}"
    left, right = (robot.device[name].__struct_config__.tag for name in ("motor_left", "motor_right"))
    if left != right:
        yield "device.motor_right", f" is {right}, device.motor_left {left}; expected the same type"
    batteries = [name for name, device in robot.device.items() if isinstance(device, Energy) and device.on]
    if len(batteries) > 1:
        yield f"device.{batteries[1]}", " is a second energy; expected one"


def _wheel_faults(robot: RobotDescription) -> Faults:
    """Two drives of one wheel: which one a drive turns says the end of its name."""
    owners: dict[str, str] = {}
    for name, device in robot.device.items():
        if isinstance(device, ContinuousServo | HBridge) and device.on:
            side = "right" if name.endswith("right") else "left"
            owner = owners.setdefault(side, name)
            if owner != name:
                both = f"{owner} and {name} both turn the {side} wheel"
                yield f"device.{name}", f": {both}; expected one name that ends in left and one that ends in right"


_ALWAYS = ("servo_left", "servo_right", "uart")  # in every firmware image


def _image_faults(robot: RobotDescription, path: Path) -> Faults:
    """What the firmware of the robot's pin map cannot do: other pins or devices than it was built with."""
    for name in _ALWAYS:
        if not robot.has(name):
            yield f"device.{name}", f" is missing or off; the kit's firmware needs it{_OWN}"
    owner = resources.folder("robots") / f"{robot.pin_map}.toml"
    if not owner.is_file() or owner.samefile(path):
        return  # the robot has its own pin map, and so its own image
    image = load_robot(owner)
    for name, device in robot.device.items():
        built = image.device.get(name)
        if type(built) is not type(device) or (built is not None and built.pins() != device.pins()):
            there = "not there" if built is None else f"{built.__struct_config__.tag} on {built.wired_to}"
            yield (
                f"device.{name}",
                f" is {device.__struct_config__.tag} on {device.wired_to}, but in the firmware for pin map "
                f"{robot.pin_map!r} it is {there}; expected the same, or a pin_map of the robot's own{_OWN}",
            )


def owners(row: Imperfection, robot: RobotDescription) -> list[Any]:
    """The tables and devices of a robot's description, switched on, that an imperfection belongs to."""
    tables = {"body": robot.body, "supply": robot.supply}
    devices = [one for one in robot.device.values() if one.on and one.__struct_config__.tag in row.of]
    return [*filter(None, (tables.get(name) for name in row.of)), *devices]


def magnitude(row: Imperfection, robot: RobotDescription) -> float | None:
    """What a robot's description gives for an imperfection, or else the table; None: it has nothing of the kind."""
    if not row.key:
        return robot.imperfections.get(row.name, row.value)
    given = next((getattr(owner, row.key) for owner in owners(row, robot)), None)
    if row.key == "tyre_slip" and given is None:
        return float(robot.has_board)
    return row.value if given is None else float(given)


def idle(name: str, robot: RobotDescription, *, noise: bool = True) -> str:
    """Why a magnitude of that name changes nothing of this robot, as a clause; "": it does. `noise`: of the run."""
    row = imperfections()[name]
    if not owners(row, robot):
        return f"robot {robot.name!r} has no {' or '.join(row.of)} that is on"
    if row.drawn == "unit" and robot.unit == 0:
        return f"robot {robot.name!r} is nominal, as its unit is 0"
    if row.drawn and not noise:
        return "the run is without noise"
    if row.needs and not magnitude(imperfections()[row.needs], robot):
        return f"{row.needs} of robot {robot.name!r} is 0"
    return ""


def notices(robot: RobotDescription, without: Sequence[str]) -> list[str]:
    """A sentence for each of a robot's own magnitudes, and of what is switched off, that changes nothing of it."""
    asked = {f"imperfections.{name} of its file": [name] for name in robot.imperfections}
    if robot.body.tyre_grip is not None:
        asked["body.tyre_grip of its file"] = ["tyre_grip"]
    asked |= {f"without {name}": list(switched_off([name])) for name in without}
    found = [(what, [idle(name, robot) for name in names]) for what, names in asked.items()]
    return [f"{what} changes nothing: {faults[0]}" for what, faults in found if all(faults)]
