"""The devices of one robot, ready to be read by their names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from boebot.devices.device import Place, Reader, kinds
from boebot.devices.latest import MESSAGE_TICKS
from boebot.devices.led import BOARD_LED_PIN, Led
from boebot.devices.readings import Layout
from boebot.devices.whisker import Whisker
from boebot.errors import BoebotError, BrainError, did_you_mean, expected_one

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription


class NoDeviceError(BrainError, AttributeError):
    """A brain reads a device that the robot does not have."""


class Dimensions(NamedTuple):
    """Measures of a robot by its description; those of the one at hand may be a little different."""

    track_width: float
    """m, between the wheels' middles"""
    wheel_radius: float
    """m"""
    radius: float
    """m, of the circle about the body"""
    speed: float
    """m/s along the ground at motor signal 1"""


class Equipment:
    """The devices of one robot, ready to be read.

    Attributes:
        readers: by the device's name, what makes its reading of an observation's `sample` and `slow`.
        dimensions: lengths and speed of the robot.
        whiskers: names of those among them.
        needs_messages: the board sends messages of slow devices.
    """

    def __init__(
        self,
        robot: RobotDescription,
        tick_s: float,
        layout: Layout | None = None,
        message_ticks: int = MESSAGE_TICKS,
    ) -> None:
        """`layout`: where the readings of a robot without a board stand, once that is known. `message_ticks`: from one
        message of a board's slow devices to the next."""
        self.robot_name = robot.name
        body = robot.body
        self.dimensions = Dimensions(
            body.track_width_m, body.wheel_radius_m, body.radius_m, body.wheel_speed_maximum_m_s
        )
        found = places(robot, tick_s, layout, message_ticks)
        self.readers: dict[str, Reader] = {name: robot.device[name].reader(place) for name, place in found.items()}
        self.whiskers = [name for name in found if robot.device[name].READING is Whisker]
        self.needs_messages = robot.has_board and needs_messages(robot)

    def has(self, name: str) -> bool:
        """Whether the robot has the device ("ping", "infrared_left"), or all of that group ("whiskers", "infrared")."""
        return name in self.readers or (name in groups() and not self.missing([name]))

    def missing(self, needs: Iterable[str]) -> list[str]:
        """Which of the needed devices the robot lacks; a group such as "whiskers" needs all of its devices.

        Raises:
            BrainError: a need is no device at all.
        """
        lacking = []
        for need in needs:
            if need in self.readers:
                continue
            if need not in groups() and need not in usual_names():
                known = list(dict.fromkeys((*groups(), *usual_names(), *self.readers)))
                raise BrainError(f"a brain cannot need {need!r}; {expected_one(need, known)}")
            lacking += [name for name in groups().get(need, (need,)) if name not in self.readers]
        return lacking

    def no_device(self, name: str, known: Iterable[str]) -> NoDeviceError:
        """The error of a brain that reads `name`, which the robot does not have; `known`: all names it has."""
        if name in usual_names():
            return NoDeviceError(f"robot {self.robot_name!r} has no {name}")
        there = [other for other in known if other[0] != "_"]
        hint = f"its devices are {', '.join(self.readers) or 'none'}{did_you_mean(name, there)}"
        return NoDeviceError(f"robot {self.robot_name!r} has no attribute {name!r}; {hint}")


def places(
    robot: RobotDescription, tick_s: float, layout: Layout | None = None, message_ticks: int = MESSAGE_TICKS
) -> dict[str, Place]:
    """Where each device is that a brain can read, or that is in the layout; arguments as of `Equipment`."""
    found = {}
    for name, device in robot.device.items():
        if not device.on or (device.READING is None if layout is None else name not in layout):
            continue
        where = slice(0, 1) if layout is None else layout[name]
        found[name] = Place(name, robot.device, robot.body.wheel_radius_m, tick_s, message_ticks, where)
    return found


def with_board_led(robot: RobotDescription) -> RobotDescription:
    """The robot with the LED "L" that an Uno itself has at pin 13, if no other device of it has that name, or is an LED
    there."""
    there = [one for one in robot.device.values() if isinstance(one, Led) and one.pin == BOARD_LED_PIN]
    if robot.board != "uno" or there or "L" in robot.device:
        return robot
    return msgspec.structs.replace(robot, device={**robot.device, "L": Led(pin=BOARD_LED_PIN, colour="yellow")})


def check_setting(robot: RobotDescription, name: str, value: float) -> None:
    """Raises BoebotError where no person can work that device of the robot so: see `Device.CONTROL`."""
    there = [other for other, device in robot.device.items() if device.on and device.CONTROL]
    if name not in there:
        expected = expected_one(name, there) if there else "it has none"
        raise BoebotError(f"{name} of robot {robot.name!r} is no button, switch or knob; {expected}")
    is_slider = robot.device[name].CONTROL == "slider"
    if not (0 <= value <= 1 if is_slider else value in (0, 1)):
        raise BoebotError(f"{name} cannot be set to {value:g}; expected {'0 to 1' if is_slider else '0 or 1'}")


def needs_messages(robot: RobotDescription) -> bool:
    """Whether one of the robot's devices speaks in messages besides telemetry."""
    return any(device.on and device.has_messages(robot.device) for device in robot.device.values())


@cache
def groups() -> Mapping[str, tuple[str, ...]]:
    """What a brain may need besides a single device: all of a kind."""
    return {kind.GROUP: kind.NAMES for kind in kinds() if kind.GROUP and kind.NAMES}


@cache
def usual_names() -> tuple[str, ...]:
    """All usual names of devices that a brain can read."""
    return tuple(dict.fromkeys(name for kind in kinds() if kind.READING is not None for name in kind.NAMES))
