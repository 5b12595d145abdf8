"""The devices of a robot's description as parts at its board's pins: which part, which pins, what parameters."""

from __future__ import annotations

from collections import Counter
from typing import Any

from boebot.description import robots
from boebot.devices.battery import BatteryDivider
from boebot.devices.device import pin_number
from boebot.devices.turret import PositionServo
from boebot.errors import BoardError
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices.battery import battery_parameters
from sim_bridge.devices.catalogue import At, Part, part_of
from sim_bridge.robots import imperfections

NO_PIN = 255
FIRST_ANALOG_PIN = 14


def join(robot: Any, description: robots.RobotDescription, draw: imperfections.Draw) -> dict[str, int]:
    """Joins battery and every device that is on to a robot of a simulation (C `robot *`). Returns the numbers of the
    parts that devices have there.

    Devices without a part in the world are left alone. Sensors that a turret carries turn with it.

    Raises:
        BoardError: a device cannot be joined; one sentence names it.
        MemoryError: there is none.
    """
    _join_supply(robot, description, draw)
    counts: Counter[type] = Counter()
    numbers = {}
    for name, device in description.device.items():
        if not device.on:
            continue
        side = int(name.endswith("right"))
        part = part_of(device, At(side, counts[type(device)], description.body, draw))
        counts[type(device)] += 1
        if part is not None:
            numbers[name] = int(robot.part_count)
            done(add_part(robot, part), f"device {name!r}")
    for device in description.device.values():
        if isinstance(device, PositionServo) and device.on:
            _mount(robot, device, description)
    for name, number in numbers.items():
        if not description.device[name].plugged:
            lib.robot_unplug(robot, number, 1)
    return numbers


def add_part(robot: Any, part: Part) -> int:
    """Joins a part to a robot of a simulation; a status of loop.h."""
    pins = [pin if pin == NO_PIN else pin_number(pin) for pin in part.pins]
    status: int = lib.robot_add_part(robot, ffi.addressof(getattr(lib, part.kind)), part.number, pins, part.parameters)
    return status


def done(status: int, what: str) -> None:
    """Raises what a status of loop.h means for `what` was to be joined.

    Raises:
        BoardError: a pin is taken, a parameter is out of its range, the board was built for another interface.
        MemoryError: there is none.
    """
    if status == lib.SIM_OK:
        return
    if status == lib.SIM_NO_MEMORY:
        raise MemoryError("simulation")
    why = {
        lib.SIM_PIN_TAKEN: "another device drives one of its pins, or too many listen there",
        lib.SIM_WRONG_BOARD: "it was built for another interface of boards",
    }
    raise BoardError(f"{what} cannot be joined to the simulation: {why.get(status, 'a value is out of its range')}")


def _join_supply(robot: Any, description: robots.RobotDescription, draw: imperfections.Draw) -> None:
    """The pack, and where the board measures it."""
    if description.supply is None:
        return
    gauges = [d for d in description.device.values() if isinstance(d, BatteryDivider) and d.on]
    channel = pin_number(gauges[0].pin) - FIRST_ANALOG_PIN if gauges else NO_PIN
    ratio = gauges[0].ratio if gauges else 2.0
    battery = battery_parameters(description.supply, ratio, draw)
    done(lib.robot_add_battery(robot, channel, battery), "the battery")


def _mount(robot: Any, turret: PositionServo, description: robots.RobotDescription) -> None:
    """What the turret carries turns with it."""
    for name in turret.carried(description.device):
        pins = description.device[name].pins().values()
        done(max(lib.robot_mount(robot, pin_number(turret.pin), pin) for pin in pins), f"device {name!r} on the turret")
