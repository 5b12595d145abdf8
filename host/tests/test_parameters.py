"""Parameters from the robot's description: the same sources as in messages.toml."""

from __future__ import annotations

import tomllib
from pathlib import Path

from boebot.link import messages
from boebot.link.session import Link
from boebot.parameters import FROM_ROBOT, configure, parameters_of
from boebot.robots import load_robot
from peer import InProcess, Peer

SCHEMA = tomllib.loads((Path(__file__).resolve().parents[2] / "protocol" / "messages.toml").read_text(encoding="utf-8"))


def test_sources_are_those_of_the_schema() -> None:
    assert {p["name"]: p["default_from"] for p in SCHEMA["parameter"] if "default_from" in p} == FROM_ROBOT


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
    assert len(told) == len(FROM_ROBOT) + 1
