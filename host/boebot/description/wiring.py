"""The wiring of a robot with a board: its devices' wires, joined to the pins that its description gives them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from boebot.devices.device import FIVE_VOLTS, PACK, SERVO_POWER, pin_name, pin_number

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription
    from boebot.devices.device import Device

PINS = 20  # of an Arduino Uno: 0..13, A0..A5


class Connection(NamedTuple):
    """One wire of a robot."""

    device: str
    """Its name in the description."""
    on: bool
    """False: the description reserves its pins and leaves it switched off."""
    pin: str
    """On the board, as its print names it: "13", "A0"; or "5 V", "ground", "pack +"."""
    colour: str
    """In the device's own cable; empty: any."""
    part: str
    """What is in the wire, such as "220 Ω"; empty: nothing."""
    to: str
    """The device's terminal."""
    connector: str
    """Where the device is plugged in on the board."""


def connections(robot: RobotDescription) -> list[Connection]:
    """All wires of a robot, device by device; none without a board."""
    servo_power = PACK if robot.supply is not None and robot.supply.servos == "pack" else FIVE_VOLTS
    found = []
    for name, device in robot.device.items():
        for wire in device.wires():
            pin = servo_power if wire.pin == SERVO_POWER else _pin(device, wire.pin)
            found.append(Connection(name, device.on, pin, wire.colour, wire.part, wire.to, device.connector))
    return found


def _pin(device: Device, key: str) -> str:
    return pin_name(pin_number(getattr(device, key))) if key in device.PINS else key


def free_pins(robot: RobotDescription) -> list[str]:
    """Pins that no device of the description has; none without a board."""
    if not robot.has_board:
        return []
    taken = {pin for device in robot.device.values() for pin in device.pins().values()}
    return [pin_name(number) for number in range(PINS) if number not in taken]


def users_of_pins(robot: RobotDescription) -> dict[int, list[str]]:
    """Arduino number of each pin that devices of the robot use, and their names."""
    users: dict[int, list[str]] = {}
    for name, device in robot.device.items():
        for pin in device.pins().values() if device.on else ():
            users.setdefault(pin, []).append(name)
    return users


def named_pins(robot: RobotDescription) -> list[str]:
    """Of each pin of an Arduino Uno its name on the board's print, and the devices there."""
    users = users_of_pins(robot)
    return [" ".join([pin_name(pin), *users.get(pin, [])]).replace("_", " ") for pin in range(PINS)]
