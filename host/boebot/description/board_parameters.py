"""What a robot's description says about the firmware's parameters, and what a board's parameters say about the robot.

One image serves every robot with its pin map; what differs (servo centres, geometry, periods, devices on or off) are
parameters. Where the board has saved its own, they win: somebody has calibrated this very robot, and the description is
brought into line. Otherwise the host sets those of the description after each opening of a session.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from boebot.description.robots import RobotDescription
from boebot.devices.infrared import InfraredSchedule
from boebot.link.link import Link
from boebot.link.messages import DEVICE_OF_BIT, DEVICES_PARAMETERS, PARAMETERS

# parameter -> the keys of the description that it stands for besides its `default_from`
_ALSO = {"encoder_counts": ("encoder_right.edges_per_turn",), "infrared_sweep": ("infrared.sweep",)}


def parameters_of(robot: RobotDescription) -> dict[str, float]:
    """The parameters that the robot's description settles, in their units."""
    values = devices_values(sum(bit for bit, device in DEVICE_OF_BIT.items() if robot.has(device)))
    for parameter, spec in PARAMETERS.items():
        owner, _, key = spec.default_from.partition(".")
        if owner == "robot":
            values[parameter] = float(getattr(robot, key))
        elif owner == "body":
            values[parameter] = float(getattr(robot.body, key))
        elif robot.has(owner):
            values[parameter] = float(getattr(robot.device[owner], key))
    schedule = robot.device.get("infrared")
    if isinstance(schedule, InfraredSchedule) and robot.has("infrared_left"):
        values["infrared_sweep"] = float(schedule.sweep)
    return values


def devices_values(devices: int) -> dict[str, float]:
    """The parameters that switch these devices on, and no others."""
    return {name: float(devices >> first & 0xFFFF) for name, first in DEVICES_PARAMETERS.items()}


def configure(link: Link, robot: RobotDescription) -> RobotDescription:
    """Brings board and description into line, as the module says.

    Returns:
        The robot as it is: its description, with what the board has saved in its place.

    Raises:
        BoardError: the board does not answer, or refuses one.
    """
    hello = link.session.hello
    assert hello is not None
    wanted = {name: value for name, value in parameters_of(robot).items() if name in link.parameters.names}
    if hello.parameters_saved:
        return adapted(robot, {name: link.parameters.get(name) for name in wanted})
    for parameter, value in wanted.items():
        if parameter != "baud_rate":  # the board speaks at the right one, or nothing would come
            link.parameters.set(parameter, value)
    return robot


def adapted(robot: RobotDescription, values: Mapping[str, float]) -> RobotDescription:
    """The robot with these parameters, in their units, in place of what its description says."""
    body = robot.body
    devices = dict(robot.device)
    for parameter, value in values.items():
        for source in (PARAMETERS[parameter].default_from, *_ALSO.get(parameter, ())):
            owner, _, key = source.partition(".")
            if owner == "body":
                body = msgspec.structs.replace(body, **{key: round(value, 9)})
            elif owner in devices:
                kind = type(getattr(devices[owner], key))
                devices[owner] = msgspec.structs.replace(devices[owner], **{key: kind(round(value, 9))})
    for bit, left in DEVICE_OF_BIT.items():
        for owner in {left, left.replace("_left", "_right")} & set(devices):
            if not all(int(values.get(name, held)) & int(held) == held for name, held in devices_values(bit).items()):
                devices[owner] = msgspec.structs.replace(devices[owner], on=False)
    return msgspec.structs.replace(robot, body=body, device=devices)
