"""Readings of robots without a board: descriptions, views, ages, arrays."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.description.robots import load_robot
from boebot.devices.infrared import Infrared
from boebot.devices.ping import Ping
from boebot.devices.readings import Readings, ages
from boebot.errors import BrainError, RobotError
from boebot.record.truth import touch_indices
from boebot.robot import Equipment, Observation, Robot

ARSIM = load_robot("arsim")
LAYOUT = {
    "infrared_left": slice(0, 1),
    "infrared_right": slice(1, 2),
    "odometer": slice(2, 5),
    "compass": slice(5, 6),
}


def robot_reading(*values: float) -> Robot:
    robot = Robot("arsim", 0.05)
    sample = Readings(7, 1, (0.0,) * len(values), values)
    robot.observation = Observation(sample, Equipment(ARSIM, 0.01, LAYOUT), 0.07, slow=sample)
    return robot


@pytest.mark.parametrize(("reading", "detected"), [(0.0, False), (0.2999, False), (0.3, True), (1.0, True)])
def test_infrared_reading_becomes_a_detection_at_its_threshold(reading: float, detected: bool) -> None:
    robot = robot_reading(reading, 0.1, 0, 0, 0, 0)
    assert robot.infrared_left == Infrared(detected, 0.0, True, None, reading)
    assert not robot.infrared_right.detected and robot.infrared_right.valid and robot.infrared_right.age == 0.0


def test_names_of_the_notes_sensors() -> None:
    robot = robot_reading(0, 0, 1.5, -0.5, 0.25, -3.0)
    assert (robot.odometer.x, robot.odometer.y, robot.odometer.heading) == (1.5, -0.5, 0.25)
    assert robot.compass.heading == -3.0
    assert robot.tick == 7 and robot.has("infrared") and not robot.has("whiskers")
    with pytest.raises(BrainError, match="'arsim' has no ping"):
        _ = robot.ping
    assert Equipment(ARSIM, 1.0).missing(["whiskers", "infrared"]) == ["whisker_left", "whisker_right"]


def test_any_declared_name_is_read(tmp_path: Path) -> None:
    text = "[device.sonar_behind]\ntype = 'sonar'\nposition_m = [-0.1, 0]\nheading_rad = 3.1"
    description = load_robot(variant(tmp_path, text))
    robot = Robot("variant", 0.05)
    sample = Readings(7, 1, (0.25,), (0.5,))
    equipment = Equipment(description, 0.01, {"sonar_behind": slice(0, 1)})
    robot.observation = Observation(sample, equipment, 0.07, slow=sample)
    assert robot.has("sonar_behind") and robot.device("sonar_behind", Ping).distance == 0.5
    with pytest.raises(BrainError, match="device 'sonar_behind' gives Ping, not Infrared"):
        robot.device("sonar_behind", Infrared)
    assert not hasattr(robot, "sonar_ahead")


@pytest.mark.parametrize("name", ["drive", "time", "front-left", "_seed"])
def test_names_that_a_brain_could_not_read_are_refused(tmp_path: Path, name: str) -> None:
    text = f"[device.{name}]\ntype = 'touch_whisker'\nroot_m = [0.1, 0]\ntip_m = [0.2, 0]"
    with pytest.raises(RobotError, match=f"device.{name}: a device cannot have this name; expected one that robot"):
        load_robot(variant(tmp_path, text))


@given(st.floats(0.011, 0.5), st.integers(0, 2000))
def test_age_of_a_held_reading(period_s: float, tick: int) -> None:
    """Against the definition: it was sampled in the first step at or after the last due multiple of its period."""
    tick_s = 0.01
    due = [math.ceil(round(k * period_s / tick_s, 6)) for k in range(int(tick * tick_s / period_s) + 2)]
    sampled = max(step for step in due if step <= tick)
    (age,) = ages((period_s,), tick * tick_s, tick_s)
    assert age == pytest.approx((tick - sampled) * tick_s, abs=1e-9) or abs(round(age / period_s, 6) % 1) < 1e-6
    assert 0.0 <= age < period_s + tick_s


def variant(folder: Path, text: str) -> Path:
    path = folder / "variant.toml"
    path.write_text(f'extends = "arsim"\n{text}\n')
    return path


def test_the_range_of_a_ping_has_two_ends(tmp_path: Path) -> None:
    path = tmp_path / "near.toml"
    path.write_text('extends = "shieldbot"\n[device.ping]\nrange_min_m = 3.0\n')
    sentence = r"near\.toml:3: device\.ping\.range_min_m is 3; expected less than range_max_m, 3$"
    with pytest.raises(RobotError, match=sentence):
        load_robot(path)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("remove = ['motor_left']", "device.motor_left is missing or off; a robot without a board needs a dc_motor"),
        ("pin_map = 'shieldbot'", r"variant\.toml:2: pin_map is 'shieldbot', but a robot without a board has no pins"),
        (
            "[device.compass]\nplugged = false",
            r"variant\.toml:3: device\.compass\.plugged is false, but a robot without a board has no plugs",
        ),
        ("[device.buzzer]\ntype = 'buzzer'\npin = 4", "device.buzzer is buzzer, which needs a board's pins"),
        ("[device.compass]\nsigma_rad = -1.0", "device.compass.sigma_rad: expected float >= 0.0"),
        ("[device.laser]\ntype = 'laser_range_finder'\nposition_m = [0, 0]\nrays = 0", "device.laser.rays: expected"),
        ("[device.infrared_left]\nthreshold = 1.5", "device.infrared_left.threshold: expected"),
        ("[device.infrared_left]\nrays = 33", r"variant\.toml:3: device\.infrared_left\.rays: expected int <= 32"),
        (
            "[device.infrared_left]\nbeam_rad = 3.2",
            r"variant\.toml:3: device\.infrared_left\.beam_rad: expected float <=",
        ),
        ("[device.infrared_left]\nheading_rad = 2e4", r"variant\.toml:3: device\.infrared_left\.heading_rad: expected"),
        ("[device.infrared_left]\nrange_m = 2e12", r"variant\.toml:3: device\.infrared_left\.range_m: expected"),
        ("[device.compass]\nbias_rad = 7", r"variant\.toml:3: device\.compass\.bias_rad: expected"),
        (
            "[device.sonar]\ntype = 'sonar'\nposition_m = [0, 0]\nheading_rad = 0\nrange_min_m = 3",
            r"variant\.toml:6: device\.sonar\.range_min_m is 3; expected less than range_max_m, 3$",
        ),
        (
            "[device.laser]\ntype = 'laser_range_finder'\nposition_m = [0, 0]\nstep_rad = 0.1",
            r"variant\.toml:5: device\.laser\.step_rad is 0\.1; expected a fan of 683 rays of less than a turn$",
        ),
        (
            "[device.w]\ntype = 'touch_whisker'\nroot_m = [0.1, 0]\ntip_m = [0.1, 0]",
            r"variant\.toml:5: device\.w\.tip_m is where root_m is; expected a whisker that has a length$",
        ),
        (
            "[device.e]\ntype = 'energy'\nempty_v = 7\nfull_v = 5",
            r"variant\.toml:5: device\.e\.full_v is 5; expected more than empty_v, 7 V$",
        ),
        (
            "".join(f"[device.e{i}]\ntype = 'energy'\n" for i in range(2)),
            r"variant\.toml:4: device\.e1 is a second energy; expected one$",
        ),
        (
            "scheme = 'arsmi'",
            r"variant\.toml:2: scheme is 'arsmi'; expected one of kit, arsim; did you mean 'arsim'\?$",
        ),
        ("scheme = 1", r"variant\.toml:2: scheme is 1; expected one of kit, arsim$"),
        ("schema = 'arsim'", r"variant\.toml:2: there is no key 'schema' here; .*did you mean 'scheme'\?$"),
        ("scheme = 'arsim'\nbody = 3", r"variant\.toml:3: body: expected object, got int$"),
    ],
)
def test_wrong_descriptions_get_a_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(RobotError, match=sentence):
        load_robot(variant(tmp_path, text))


def test_devices_of_vehicles_are_not_for_boards(tmp_path: Path) -> None:
    path = tmp_path / "mixed.toml"
    path.write_text('extends = "shieldbot"\n[device.odometer]\ntype = "odometer"\n')
    with pytest.raises(RobotError, match=r"device\.odometer is odometer, which only a robot without a board can have"):
        load_robot(path)


def test_touches_nearer_than_a_tenth_of_a_second_are_one() -> None:
    time = np.linspace(0.0, 0.99, 100)
    contact = np.zeros(100, dtype=np.bool_)
    contact[[0, 1, 5, 9, 30, 31, 42, 90]] = True
    assert touch_indices(time, contact).tolist() == [0, 30, 42, 90]
    assert touch_indices(time, np.zeros(100, dtype=np.bool_)).tolist() == []
