"""Parameters from the robot's description."""

from __future__ import annotations

from boebot.description.board_parameters import adapted, configure, parameters_of
from boebot.description.robots import load_robot
from boebot.link import messages
from boebot.link.link import Link
from peer import InProcess, Peer, name_of


def test_values_come_from_the_robot() -> None:
    values = parameters_of(load_robot("shieldbot"))
    assert values["servo_right_gain"] == -200.0
    assert values["wheel_speed_maximum"] == 0.17
    devices = messages.Devices(int(values["devices"]))
    assert devices == (
        messages.Devices.SERVO
        | messages.Devices.ENCODER
        | messages.Devices.WHISKER
        | messages.Devices.INFRARED
        | messages.Devices.PING
    )


def test_board_gets_all_of_them() -> None:
    peer = Peer()
    link = Link(InProcess(peer))
    link.open()
    robot = load_robot("shieldbot")
    configure(link, robot)
    values = {
        name_of(message.parameter): message.value
        for _, message in peer.carried_out
        if isinstance(message, messages.SetParameter)
    }
    assert values["servo_left_centre"] == 24000
    assert values["wheel_speed_maximum"] == 1700
    owners = {name: spec.default_from.partition(".")[0] for name, spec in messages.PARAMETERS.items()}
    described = {name for name, owner in owners.items() if owner in ("robot", "body") or robot.has(owner)} | {
        "devices",
        "infrared_sweep",
    }
    assert {"turret_centre", "turret_gain"}.isdisjoint(described), "its turret is off"
    assert set(values) == described - {"baud_rate"}, "the rate at which it is heard is the right one"


def test_description_gives_way_to_what_the_board_has_saved() -> None:
    robot = load_robot("shieldbot")
    without_encoders = messages.Devices.SERVO | messages.Devices.WHISKER
    real = adapted(robot, {"servo_left_centre": 1512.25, "devices": float(without_encoders), "wheel_radius": 0.034})
    assert real.device["servo_left"].centre_us == 1512.25  # type: ignore[attr-defined]
    assert real.device["servo_right"].centre_us == 1500.0  # type: ignore[attr-defined]
    assert real.body.wheel_radius_m == 0.034 and real.body.track_width_m == robot.body.track_width_m
    assert [name for name in robot.device if robot.has(name) and not real.has(name)] == [
        "encoder_left", "encoder_right", "infrared_left", "infrared_right", "ping",
    ]  # fmt: skip
