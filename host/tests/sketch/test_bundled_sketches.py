"""The bundled sketches do in the world what they say, by the true path; what they print is not asked.

`make test` drives each once and briefly, `make soak` longer and with other seeds.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.arenas import load_arena
from boebot.description.robots import load_robot
from boebot.result import RunResult
from boebot.sketches import FOLDER, NAMES, sketch

SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in (2, 3, 4, 5))]


def path(name: str) -> Path:
    return FOLDER / name / f"{name}.ino"


def drive(name: str, seconds: float, seed: int = 1, **options: Any) -> RunResult:
    """A run of the sketch with the robot and in the arena that it names."""
    found = sketch(name)
    options = {"robot": found.robot, "arena": found.arena} | options
    result = boebot.run(path(name), seconds=seconds, seed=seed, **options)
    assert result.error is None and result.truth is not None
    return result


def has_stood(result: RunResult, seconds: float) -> bool:
    """Whether it has neither moved nor turned in the last seconds."""
    truth = result.truth
    assert truth is not None
    last = truth.time > truth.time[-1] - seconds
    moved = np.hypot(np.ptp(truth.x[last]), np.ptp(truth.y[last]))
    return bool(moved < 0.002 and np.ptp(np.unwrap(truth.heading[last])) < 0.02)


def test_all_are_listed_for_robots_and_arenas_that_there_are() -> None:
    assert {folder.name for folder in FOLDER.iterdir() if folder.is_dir() and folder.name[0] != "_"} == set(NAMES)
    for found in map(sketch, NAMES):
        load_robot(found.robot)
        load_arena(found.arena)


@pytest.mark.parametrize(("letters", "stands"), [("", False), ("L" * 30 + "R" * 5 + "r" * 5, True)])
def test_centring_finds_the_pulse_of_a_servo_that_is_not_centred(letters: str, stands: bool, tmp_path: Path) -> None:
    """The left servo of this robot stands still at 1,530 us."""
    robot = tmp_path / "crooked.toml"
    robot.write_text('extends = "shieldbot-basic"\nname = "crooked"\n[device.servo_left]\ncentre_us = 1530.0\n')
    result = drive("centring", 3.0, robot=robot, without=["servo_centre"], typed=[(letters, 0.1)] if letters else [])
    assert has_stood(result, 1.0) == stands


def test_dance_ends_where_it_began() -> None:
    """With servos that are all alike: four legs of a second, each followed by half a turn, two of them to the left."""
    truth = (result := drive("dance", 9.5, without=["servo_spread", "servo_asymmetry", "servo_centre"])).truth
    assert truth is not None
    heading = np.unwrap(truth.heading)
    assert np.ptp(heading) == pytest.approx(math.pi, abs=0.3)
    assert result.true_distance == pytest.approx(4 * 0.16, rel=0.15)
    assert math.hypot(truth.x[-1] - truth.x[0], truth.y[-1] - truth.y[0]) < 0.05
    assert heading[-1] == pytest.approx(heading[0], abs=0.1)
    assert has_stood(result, 1.0)


# Sketches that drive about, and how fast at least, stops and turns included (m/s). The avoider stops to look.
ABOUT = pytest.mark.parametrize(
    ("name", "pace"), [("whiskers", 0.1), ("infrared", 0.1), ("states", 0.1), ("avoider", 0.03)]
)


@ABOUT
def test_they_turn_away_from_a_wall_and_drive_on(name: str, pace: float) -> None:
    """The wall is 0.6 m away; a robot that goes on straight ahead bumps into it."""
    result = drive(name, 8.0, pose=(0.9, -0.2, 0.3))
    truth = result.truth
    assert truth is not None and result.true_contacts == 0
    assert result.true_distance is not None and result.true_distance > pace * result.run_time
    assert np.ptp(np.unwrap(truth.heading)) > 1.0


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
@ABOUT
def test_they_never_stay_where_they_are(name: str, pace: float, seed: int) -> None:
    """What a sensor does not see they may brush against, but less than 1 % of the time; in any 20 s they get about."""
    result = drive(name, 180.0, seed)
    truth = result.truth
    assert truth is not None and np.mean(truth.contact) < 0.01
    for begin in range(0, 180, 20):
        some = (truth.time >= begin) & (truth.time < begin + 20)
        assert np.hypot(np.ptp(truth.x[some]), np.ptp(truth.y[some])) > 3.0 * pace


@pytest.mark.parametrize("seed", SEEDS)
def test_light_stops_at_the_lamp(seed: int) -> None:
    result = drive("light", 14.0, seed)
    assert result.truth is not None and result.true_contacts == 0
    (lamp,) = load_arena("station").description.light
    assert math.hypot(result.truth.x[-1] - lamp.x_m, result.truth.y[-1] - lamp.y_m) < 0.4
    assert has_stood(result, 2.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_distance_stops_before_the_wall(seed: int) -> None:
    """The wall is at 1.5 m, the Ping))) 6 cm before the axle."""
    result = drive("distance", 8.0, seed, pose=(0.7, 0.0, 0.0))
    assert result.truth is not None and result.true_contacts == 0
    assert 1.5 - (result.truth.x[-1] + 0.06) == pytest.approx(0.20, abs=0.02)
    assert has_stood(result, 1.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_line_stays_on_the_tape(seed: int) -> None:
    """In a minute once round; the sensor in the middle is 5 cm before the axle."""
    result = drive("line", 10.0 if seed == 1 else 120.0, seed)
    truth, (tape,) = result.truth, load_arena("track").description.line
    assert truth is not None
    x, y = truth.x + 0.05 * np.cos(truth.heading), truth.y + 0.05 * np.sin(truth.heading)
    begin = np.array(tape.points_m)
    along = np.diff(begin, axis=0)
    beside = np.stack([x, y], axis=1)[:, None] - begin[:-1]
    share = np.clip((beside * along).sum(axis=2) / (along**2).sum(axis=1), 0, 1)
    off = np.linalg.norm(beside - share[..., None] * along, axis=2).min(axis=1)
    assert off.max() < 0.025
    assert result.true_distance is not None and result.true_distance > 0.1 * result.run_time
