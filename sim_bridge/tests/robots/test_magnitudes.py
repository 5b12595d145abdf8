"""Imperfections by name and magnitude: each reaches the simulated robot by every way that gives it, or is refused."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import boebot
from boebot import Member
from boebot.boards import BoardRequest, open_board
from boebot.cli.ending import Detail, print_run
from boebot.cli.options import magnitudes
from boebot.description.robots import RobotDescription, load_robot, magnitude, owners, robot_names
from boebot.devices.accelerometer import Accelerometer
from boebot.devices.display import Display
from boebot.devices.input import Button, Potentiometer
from boebot.devices.led import Led
from boebot.devices.light import Phototransistor
from boebot.devices.line import ReflectanceSensor
from boebot.devices.ultrasonic import UltrasonicSensor
from boebot.errors import BoebotError, RobotError
from boebot.imperfections import Imperfection, checked, imperfections
from boebot.result import RunResult, read_run
from boebot.running.again import again, recorded
from sim_bridge.compiled import lib
from sim_bridge.devices.battery import battery_parameters
from sim_bridge.devices.catalogue import At, part_of
from sim_bridge.robots.imperfections import Draw, applied, body_parameters
from sim_bridge.tests.simulated import scripted

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

LEFT, RIGHT = 13, 12
TABLE = imperfections()
WIRED = {  # parts that no bundled robot has
    "led": Led(pin=6),
    "start": Button(pin=2),
    "dial": Potentiometer(pin="A0"),
    "display": Display(rs_pin=12, enable_pin=11, d4_pin=3, d5_pin=4, d6_pin=5, d7_pin=9),
    "sonar": UltrasonicSensor(trigger_pin=7, echo_pin=8, position_m=(0.05, 0.0)),
}
ROBOTS = [
    *(load_robot(name) for name in robot_names()),
    msgspec.structs.replace(load_robot("shieldbot"), firmware="none", device=WIRED),
]
SHIELDBOT, ARSIM = load_robot("shieldbot"), load_robot("arsim")
EXAMPLE = {"servo_lag_s": 0.2, "tyre_grip": 0.3}


def own(tmp_path: Path, text: str, base: str = "shieldbot") -> Path:
    file = tmp_path / "mine.toml"
    file.write_text(f'extends = "{base}"\nname = "mine"\n{text}\n', encoding="utf-8")
    return file


def truth(**asked: Any) -> bytes:
    result = boebot.run("wander", seconds=1, **asked)
    assert result.truth is not None
    return bytes(np.stack([result.truth.x, result.truth.y, result.truth.heading]).tobytes())


def test_a_servo_has_the_lag_that_it_was_given() -> None:
    """What is missing at steady speed dies out as exp(-t / lag), once the regulator's loop of 10 ms has settled."""
    robot = scripted(imperfections={"servo_lag_s": 0.2})
    robot.pulses(0.6, {LEFT: 1700, RIGHT: 1300})
    robot.run(0.6)
    seen = robot.robot.truth()
    steady = 51.25 * 2 * math.pi / 60 * math.tanh(200 / 78.5) * 0.0331
    speed = seen["speed"][(seen["time"] > 0.2) & (seen["time"] < 0.5)]
    gain, alpha = 2 * lib.body_a(body_parameters(SHIELDBOT.body)) * 1.2, SHIELDBOT.body.linear_damping_n_s_m
    missing = steady * gain / (gain + alpha) - speed
    assert missing[1:] / missing[:-1] == pytest.approx(math.exp(-0.01 / 0.2), rel=0.01)


def test_every_way_gives_the_same_robot(tmp_path: Path) -> None:
    """Option, argument, and a robot's file, where the tyres' grip is a key of the body."""
    file = own(tmp_path, "[body]\ntyre_grip = 0.3\n[imperfections]\nservo_lag_s = 0.2")
    option = magnitudes(["servo_lag_s=200ms", "tyre_grip=30%"])
    assert option == EXAMPLE
    assert truth(imperfections=option) == truth(robot=file) != truth()
    assert truth(robot=file, imperfections={"servo_lag_s": 0.055}, without=["slip"]) == truth(without=["slip"])


def test_a_run_after_another_has_its_own() -> None:
    usual = truth()
    assert truth(imperfections=EXAMPLE) != usual == truth()


def test_the_record_has_what_was_asked(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    result = boebot.run("wander", seconds=1, imperfections=dict(reversed(EXAMPLE.items())), out=folder)
    kept = read_run(folder)
    assert isinstance(kept, RunResult)
    assert result.imperfections == kept.imperfections == EXAMPLE
    assert result.table()["imperfections"] == kept.table()["imperfections"] == "servo_lag_s 0.2, tyre_grip 0.3"
    repetition = again(recorded(folder))
    assert repetition.is_equal and repetition.steps == result.steps


def test_one_robot_of_several(capsys: pytest.CaptureFixture[str]) -> None:
    members = [Member(pose=(0, y, 0), imperfections=given) for y, given in ((0, EXAMPLE), (2, None))]
    result = boebot.run_together(members, arena="empty", seconds=0.5)
    one, other = result.robots
    assert (one.imperfections, other.imperfections) == (EXAMPLE, {})
    print_run(result, Detail.FEW)
    assert " ".join(capsys.readouterr().out.split()).count(", with servo_lag_s 0.2, tyre_grip 0.3") == 1


class Asked(Draw):
    """Notes the names that parts ask for."""

    def __init__(self) -> None:
        super().__init__(1, True)
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> float:
        self.names.add(name)
        return super().__getitem__(name)


def test_the_parts_ask_for_each_name_of_the_table() -> None:
    """Of those that are no key of a robot's file: none is documented and does nothing."""
    draw = Asked()
    for robot in ROBOTS:
        counts: Counter[type] = Counter()
        body_parameters(robot.body, draw)
        if robot.supply is not None:
            battery_parameters(robot.supply, draw=draw)
        for name, device in robot.device.items():
            part_of(device, At(int(name.endswith("right")), counts[type(device)], robot.body, draw))
            counts[type(device)] += 1
    assert draw.names == {row.name for row in TABLE.values() if not row.key}


@pytest.mark.parametrize("name", [name for name, row in TABLE.items() if row.key])
def test_a_key_of_the_robot_gets_the_magnitude(name: str) -> None:
    row = TABLE[name]
    value = row.most if row.most < 10 else 2.0
    robot = robot_with(row)
    extra = {row.needs: 1.0} if row.needs else {}
    assert magnitude(row, applied(robot, given={name: value} | extra)) == value
    if row.switch:
        assert magnitude(row, applied(robot, [row.name])) == row.neutral


def robot_with(row: Imperfection) -> RobotDescription:
    """The bundled robot, or arsim with a device of the kind."""
    for robot in ROBOTS:
        if owners(row, robot):
            return robot
    extra = {
        "accelerometer": Accelerometer(),
        "phototransistor": Phototransistor(position_m=(0.0, 0.0), heading_rad=0.0),
        "reflectance_sensor": ReflectanceSensor(position_m=(0.0, 0.0)),
    }[row.of[0]]
    return msgspec.structs.replace(ARSIM, device=ARSIM.device | {"extra": extra})


WRONG: list[tuple[dict[Any, Any], str]] = [
    (
        {"servo_lagg_s": 0.1},
        "there is no imperfection 'servo_lagg_s'; .*list imperfections.*; did you mean 'servo_lag_s'",
    ),
    (
        {"SERVO_LAG_S": 0.1},
        "there is no imperfection 'SERVO_LAG_S'; .*list imperfections.*; did you mean 'servo_lag_s'",
    ),
    ({"servo_lag_s": -0.1}, r"servo_lag_s is -0.1; expected a finite number \(s\), at least 0"),
    ({"servo_lag_s": math.nan}, "servo_lag_s is nan; expected a finite number"),
    ({"servo_lag_s": 10**400}, "servo_lag_s is 1000"),
    ({"servo_lag_s": "80ms"}, "servo_lag_s is '80ms'; expected a finite number"),
    ({"servo_lag_s": True}, "servo_lag_s is True; expected a finite number"),
    ({"ping_miss": 1.5}, "ping_miss is 1.5; expected a finite number, at least 0, at most 1"),
    ({"ping_rays": 2.5}, "ping_rays is 2.5; expected a whole number, at least 1, at most 32"),
    ({3: 1.0}, "{3: 1.0}; expected magnitudes by name"),
    ({"sonar_miss": 0.1}, "sonar_miss changes nothing: robot 'shieldbot' has no sonar that is on; expected ping_miss"),
    ({"compass_iron": 0.1}, "compass_iron changes nothing: robot 'shieldbot' has no compass that is on"),
    ({"encoder_bounce_s": 1e-3}, "encoder_bounce_s changes nothing: encoder_bounces of robot 'shieldbot' is 0"),
]


@pytest.mark.parametrize(("given", "sentence"), WRONG, ids=[str(next(iter(given))) for given, _ in WRONG])
def test_wrong_magnitudes_get_a_sentence(given: dict[Any, Any], sentence: str) -> None:
    with pytest.raises(BoebotError, match=f"^imperfections(: | is ).*{sentence}"):
        boebot.run("wander", seconds=1, imperfections=given)


def test_what_changes_nothing_of_this_robot_is_refused() -> None:
    with pytest.raises(BoebotError, match="tyre_grip changes nothing: tyre_slip of robot 'arsim' is 0"):
        applied(ARSIM, given={"tyre_grip": 0.1})
    assert applied(ARSIM, given={"tyre_grip": 0.1, "tyre_slip": 1}).body.tyre_grip == 0.1
    nominal = msgspec.structs.replace(SHIELDBOT, unit=0)
    with pytest.raises(BoebotError, match="servo_top_spread changes nothing: robot 'shieldbot' is nominal"):
        applied(nominal, given={"servo_top_spread": 0.1})
    with pytest.raises(BoebotError, match="ping_miss changes nothing: the run is without noise"):
        applied(SHIELDBOT, given={"ping_miss": 0.1}, noise=False)
    with pytest.raises(BoebotError, match="as it is built: imperfections are for simulated runs"):
        open_board("/dev/nowhere", BoardRequest(robot=SHIELDBOT, imperfections={"servo_lag_s": 0.1}))


@pytest.mark.parametrize("off", ["lag", "servo_lag_s"])
def test_a_magnitude_and_its_switch_contradict_each_other(off: str) -> None:
    with pytest.raises(BoebotError, match=f"servo_lag_s is 0.08, but without {off} makes it 0; expected one of them"):
        boebot.run("wander", seconds=1, imperfections={"servo_lag_s": 0.08}, without=[off])


def test_a_switch_without_effect_is_told(tmp_path: Path) -> None:
    file = own(tmp_path, "[imperfections]\ncompass_iron = 0.1")
    result = boebot.run("wander", robot=file, seconds=0.1, without=["laser_noise", "lag"])
    assert [notice for notice in result.notices if "changes nothing" in notice] == [
        "imperfections.compass_iron of its file changes nothing: robot 'mine' has no compass that is on",
        "without laser_noise changes nothing: robot 'mine' has no laser_range_finder that is on",
    ]


def test_a_grip_without_slip_is_told(tmp_path: Path) -> None:
    file = own(tmp_path, "[body]\ntyre_grip = 0.1", "arsim")
    result = boebot.run("wander", robot=file, seconds=0.1)
    assert "body.tyre_grip of its file changes nothing: tyre_slip of robot 'mine' is 0" in result.notices


FILES: list[tuple[str, str, str]] = [
    ("shieldbot", "[imperfections]\nservo_lag = 0.1", "mine.toml:4: imperfections.servo_lag: there is no imperfection"),
    ("shieldbot", "[imperfections]\n\nping_miss = 2", "mine.toml:5: imperfections.ping_miss is 2.0; expected a finite"),
    ("shieldbot", "[imperfections]\nping_miss = '2'", "mine.toml:4: imperfections.ping_miss: expected float, got str"),
    ("shieldbot", "[imperfections]\ntyre_grip = 1.0", "said elsewhere in a robot's file; expected tyre_grip of body"),
    ("arsim", "unit = 7", "unit is 7, but nothing of a robot without a board is drawn by it"),
    ("arsim", "[device.odometer]\nperiod_s = 0.5", "device.odometer.period_s is 0.5; expected none"),
]


@pytest.mark.parametrize(("base", "text", "sentence"), FILES, ids=[sentence[:40] for _, _, sentence in FILES])
def test_wrong_lines_of_a_file_get_a_sentence(tmp_path: Path, base: str, text: str, sentence: str) -> None:
    with pytest.raises(RobotError) as caught:
        load_robot(own(tmp_path, text, base))
    assert sentence in str(caught.value)


def test_options_say_what_is_wrong() -> None:
    for given, sentence in (
        (["servo_lag_s"], "--imperfection has 'servo_lag_s' without a value; expected NAME=VALUE"),
        (["servo_lag_s=1", "servo_lag_s=2"], "--imperfection has 'servo_lag_s' twice"),
        (["servo_lg_s=80ms"], "there is no imperfection 'servo_lg_s'; .*did you mean 'servo_lag_s'"),
        (["servo_lag_s=1m"], "--imperfection servo_lag_s: '1m' is no time; expected a number, in s"),
        (["ping_miss=much"], "--imperfection ping_miss: 'much' is no share or number; expected a number"),
    ):
        with pytest.raises(BoebotError, match=sentence):
            magnitudes(given)


def test_magnitudes_compare_whatever_their_order() -> None:
    assert list(checked(dict(reversed(EXAMPLE.items()))).items()) == list(EXAMPLE.items())
