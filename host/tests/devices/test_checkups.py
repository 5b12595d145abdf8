"""What `boebot doctor` says of each device's readings: which are as they should be, and what it advises of others."""

from __future__ import annotations

from typing import Any

import pytest

from boebot import load_robot
from boebot.devices.analog_infrared import AnalogInfrared
from boebot.devices.battery import Battery
from boebot.devices.buzzer import Buzzer
from boebot.devices.compass import Compass
from boebot.devices.encoder import Encoder
from boebot.devices.infrared import Infrared
from boebot.devices.light import Light
from boebot.devices.line import Line
from boebot.devices.ping import Ping
from boebot.devices.servo import Servo
from boebot.devices.turret import Turret
from boebot.devices.whisker import Whisker
from boebot.link.messages import CompassStatus, PingStatus


def encoder(count: int, valid: bool = True) -> Encoder:
    return Encoder(count, 0.0, 0.0, False, 0.0, valid)


def compass(microtesla: float) -> Compass:
    return Compass(0.5, (microtesla * 1e-6, 0.0, 0.0), CompassStatus.OK, 0.0, True)


FREE, PRESSED = Whisker(False, 0.0, True), Whisker(True, 0.0, True)
SEEN, UNSEEN = Infrared(True, 0.0, True), Infrared(False, 0.0, True)


@pytest.mark.parametrize(
    ("robot", "device", "readings", "reads", "hint"),
    [
        ("boebot", "whisker_left", [FREE, FREE], "free", ""),
        ("boebot", "whisker_left", [FREE, PRESSED, FREE], "pressed", "pin 5 has contact with ground"),
        ("boebot", "infrared_left", [UNSEEN, SEEN], "nothing", ""),
        ("boebot", "infrared_left", [SEEN, SEEN, UNSEEN], "something", "pins 9 and 10"),
        ("boebot", "ping", [Ping(0.5, 0.0, True, PingStatus.OK)], "0.500 m", ""),
        ("boebot", "ping", [Ping(None, 0.0, True, PingStatus.NOTHING_NEAR)], "nothing near", ""),
        ("boebot", "ping", [Ping(None, 0.0, False, PingStatus.ABSENT)], "no answer", "its signal to pin 8?"),
        ("boebot", "ping", [Ping(None, 0.0, False, PingStatus.TOO_NEAR)], "too near", "take away what is before it"),
        ("shieldbot", "encoder_left", [encoder(7), encoder(8)], "8 edges", ""),
        ("shieldbot", "encoder_left", [encoder(7), encoder(19)], "12 new edges", "look at the sensor"),
        ("shieldbot", "encoder_left", [encoder(7, False)], "too many edges", "fires by itself"),
        ("boebot", "servo_left", [Servo(None, 0.0, 0.0, True)], "no pulses", ""),
        ("boebot", "servo_left", [Servo(1520.0, 0.1, 0.0, True)], "1520 µs", "something drives"),
        ("boebot", "turret", [Turret(None, None, 0.0, True)], "no pulses", ""),
        ("boebot", "turret", [Turret(0.1, 1557.0, 0.0, True)], "1557 µs", "something turns it"),
        ("boebot", "buzzer", [Buzzer(0, 0.0, True)], "silent", ""),
        ("boebot", "battery", [Battery(5.9, 0.0, True)], "5.90 V", ""),
        ("boebot", "battery", [Battery(4.1, 0.0, True)], "4.10 V", "charge or change the battery"),
        ("boebot", "light_left", [Light(0.0015, 667.0, False, 0.0, True)], "1.500 ms", ""),
        ("boebot", "light_left", [Light(0.014, 71.4, True, 0.0, True)], "dark, 14 ms or longer", ""),
        ("boebot", "light_left", [Light(None, None, False, 0.0, False)], "not measured", "is its capacitor"),
        ("boebot", "analog_infrared", [AnalogInfrared(0.2, 1.37, 0.0, True)], "0.20 m, 1.37 V", ""),
        (
            "boebot",
            "analog_infrared",
            [AnalogInfrared(0.1, 4.9, 0.0, True)],
            "0.10 m, 4.90 V",
            "is its output",
        ),
        ("boebot", "compass", [compass(48.0)], "29°, 48 µT", ""),
        ("boebot", "compass", [compass(180.0)], "29°, 180 µT", "is iron, a magnet or a motor near it?"),
        (
            "boebot",
            "compass",
            [Compass(None, None, CompassStatus.NO_ANSWER, 0.0, False)],
            "no answer",
            "pins A4 and A5?",
        ),
        ("boebot", "compass", [Compass(None, None, CompassStatus.BUS_STUCK, 0.0, False)], "bus stuck", "holds a wire"),
        ("boebot", "compass", [Compass(None, None, CompassStatus.FAILED, 0.0, False)], "failed", "look at its wires"),
        ("shieldbot-line", "line_left", [Line(0.0002, None, False, 0.0, True)], "0.200 ms, bright", ""),
        ("shieldbot-line", "line_left", [Line(0.004, None, True, 0.0, True)], "4.000 ms, dark", ""),
        ("shieldbot-line", "line_left", [Line(None, None, False, 0.0, False)], "not measured", "is it plugged in"),
    ],
)
def test_readings_are_judged(robot: str, device: str, readings: list[Any], reads: str, hint: str) -> None:
    found = load_robot(robot).device[device].checkup(readings)
    assert found.reads == reads and found.expected
    assert hint in found.hint and bool(hint) == bool(found.hint)
