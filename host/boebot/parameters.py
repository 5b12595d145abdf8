"""What a robot's description says about the firmware's run-time parameters.

One image serves every robot with its pin map; what differs (servo centres, periods, devices on or off) the
host sets after the handshake, and again after each reset.
"""

from __future__ import annotations

from boebot.link.messages import Devices
from boebot.link.session import Link
from boebot.robots import RobotDescription

# parameter -> where the robot's description says it; the same as `default_from` in protocol/messages.toml
FROM_ROBOT = {
    "servo_left_centre": "servo_left.centre_us",
    "servo_right_centre": "servo_right.centre_us",
    "servo_left_gain": "servo_left.gain_us",
    "servo_right_gain": "servo_right.gain_us",
    "wheel_speed_maximum": "body.wheel_speed_maximum_m_s",
    "infrared_period": "infrared.period_ticks",
    "ping_period": "ping.period_ticks",
}

# bit of the parameter `devices` -> the device that is on when the bit is set
DEVICE_OF_BIT = {
    Devices.SERVOS: "servo_left",
    Devices.ENCODERS: "encoder_left",
    Devices.WHISKERS: "whisker_left",
    Devices.INFRARED: "infrared_left",
    Devices.PING: "ping",
    Devices.BATTERY: "battery",
    Devices.LIGHT: "light_left",
    Devices.ANALOG_INFRARED: "analog_infrared",
    Devices.COMPASS: "compass",
    Devices.TURRET: "turret",
    Devices.BUZZER: "buzzer",
}


def parameters_of(robot: RobotDescription) -> dict[str, float]:
    """The parameters that the robot's description settles, in their units."""
    values: dict[str, float] = {"devices": sum(int(bit) for bit, device in DEVICE_OF_BIT.items() if robot.has(device))}
    for parameter, source in FROM_ROBOT.items():
        owner, key = source.split(".")
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
