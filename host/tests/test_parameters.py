"""Parameters from the robot's description."""

from __future__ import annotations

from boebot.link import messages
from boebot.link.session import Link
from boebot.parameters import configure, parameters_of
from boebot.robots import load_robot
from peer import InProcess, Peer


def test_values_come_from_the_robot() -> None:
    values = parameters_of(load_robot("shieldbot"))
    assert values["servo_right_gain"] == -200.0
    assert values["wheel_speed_maximum"] == 0.17
    devices = messages.Devices(int(values["devices"]))
    assert devices == (
        messages.Devices.SERVOS
        | messages.Devices.ENCODERS
        | messages.Devices.WHISKERS
        | messages.Devices.INFRARED
        | messages.Devices.PING
    )


def test_board_is_told_all_of_them() -> None:
    peer = Peer()
    link = Link(InProcess(peer))
    link.handshake()
    robot = load_robot("shieldbot")
    configure(link, robot)
    told = {name: peer.parameters[messages.PARAMETERS[name].id] for name in parameters_of(robot)}
    assert told["servo_left_centre"] == 24000
    assert told["wheel_speed_maximum"] == 1700
    assert set(told) == {name for name, spec in messages.PARAMETERS.items() if spec.default_from} | {"devices"}
