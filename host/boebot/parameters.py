"""What a robot's description says about the firmware's run-time parameters.

One image serves every robot with its pin map; what differs (servo centres, periods, devices on or off) the
host sets after the handshake, and again after each reset.
"""

from __future__ import annotations

from boebot.link.messages import DEVICE_OF_BIT, PARAMETERS
from boebot.link.session import Link
from boebot.robots import RobotDescription


def parameters_of(robot: RobotDescription) -> dict[str, float]:
    """The parameters that the robot's description settles, in their units."""
    values: dict[str, float] = {"devices": sum(int(bit) for bit, device in DEVICE_OF_BIT.items() if robot.has(device))}
    for parameter, spec in PARAMETERS.items():
        owner, _, key = spec.default_from.partition(".")
        if owner == "body":
            values[parameter] = float(getattr(robot.body, key))
        elif robot.has(owner):
            values[parameter] = float(getattr(robot.device[owner], key))
    return values


def configure(link: Link, robot: RobotDescription) -> None:
    """Sets the board's parameters to what the robot's description says.

    Raises:
        BoardError: the board does not answer, or refuses one.
    """
    for parameter, value in parameters_of(robot).items():
        link.set_parameter(parameter, value)
