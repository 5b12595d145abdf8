"""Following a line: what three line sensors say, and what the motors get; whole runs around the bundled track."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.arenas import load_arena
from boebot.behaviors import FollowLine
from boebot.brain import Brain
from boebot.description.robots import load_robot
from boebot.devices.latest import NEVER, without_readings
from boebot.devices.line import LineSensor
from boebot.errors import BrainError
from boebot.link.messages import LineTelemetry
from reading import read
from steps import Stepped

NOTHING = without_readings(LineTelemetry)
WHITE, BLACK = 250, 3500


class Over(Stepped):
    """A robot whose sensors are over what a test says."""

    def __init__(self, behavior: FollowLine) -> None:
        super().__init__(0.05, description=load_robot("shieldbot-line"))
        self.brain = Brain([behavior])

    def drive(self, left: int, middle: int, right: int, age: int = 1) -> tuple[float, float]:
        """One step over these decay times (us), measured `age` ticks ago; the motor signals."""
        command = self.step(self.brain, line_left=left, line_middle=middle, line_right=right, line_age=age)
        return command[1:]


@pytest.mark.parametrize(
    ("over", "turn"),
    [
        ((WHITE, BLACK, WHITE), 0.0),
        ((BLACK, BLACK, WHITE), -0.5),
        ((BLACK, WHITE, WHITE), -1.0),
        ((WHITE, BLACK, BLACK), 0.5),
        ((WHITE, WHITE, BLACK), 1.0),
        ((BLACK, BLACK, BLACK), 0.0),
    ],
)
def test_it_steers_to_the_side_of_the_line(over: tuple[int, int, int], turn: float) -> None:
    left, right = Over(FollowLine(signal=0.4, gain=0.2)).drive(*over)
    assert (left, right) == pytest.approx((0.4 + 0.2 * turn, 0.4 - 0.2 * turn))


@pytest.mark.parametrize(
    ("last", "turning"),
    [
        ((WHITE, BLACK, BLACK), (0.8, 0.0)),
        ((BLACK, BLACK, WHITE), (0.0, 0.8)),
        ((WHITE, BLACK, WHITE), (0.4, 0.4)),
    ],
)
def test_a_lost_line_is_looked_for_where_it_was_seen_last_and_then_given_up(
    last: tuple[int, int, int], turning: tuple[float, float]
) -> None:
    one = Over(FollowLine(signal=0.4, gain=0.2, patience=0.2))
    one.drive(*last)
    for _ in range(4):  # 0.2 s
        assert one.drive(WHITE, WHITE, WHITE) == pytest.approx(turning), "to that side, twice as sharply"
    assert one.drive(WHITE, WHITE, WHITE) == (0.0, 0.0)
    assert one.drive(WHITE, BLACK, WHITE) == pytest.approx((0.4, 0.4)), "found again"


@pytest.mark.parametrize("age", [7, NEVER])
def test_sensors_without_fresh_readings_see_no_line(age: int) -> None:
    one = Over(FollowLine(signal=0.4, gain=0.2, patience=0.2))
    signals = [one.drive(BLACK, WHITE, WHITE, age) for _ in range(6)]
    assert signals[:5] == [(0.4, 0.4)] * 5 and signals[5] == (0.0, 0.0), "looks ahead, and then stops"


def test_brain_of_a_file_follows_a_line(tmp_path: Path) -> None:
    path = tmp_path / "tape.toml"
    path.write_text("[process.follow_line]\nsignal = 0.3\ngain = 0.1\n")
    result = boebot.run(path, "shieldbot-line", arena="track", on="native", seconds=10)
    assert (result.true_distance or 0.0) > 0.5 and result.true_contacts == 0
    with pytest.raises(BrainError, match="needs line_left and line_middle and line_right, which robot 'shieldbot' "):
        boebot.run(path, "shieldbot", on="native", seconds=1)


def test_a_sensor_that_was_not_read_is_not_over_a_line() -> None:
    sensor = LineSensor(pin=7, position_m=(0.05, 0.0), dark_s=0.001)
    assert read(sensor, "line_left", NOTHING._replace(line_left=1001, line_age=1)).dark
    assert not read(sensor, "line_left", NOTHING._replace(line_left=1000, line_age=1)).dark
    for silent in (NOTHING, NOTHING._replace(line_left=0, line_age=1), NOTHING._replace(line_left=5000, line_age=7)):
        assert not read(sensor, "line_left", silent).valid
    assert math.isinf(read(sensor, "line_left", NOTHING).age)


@pytest.mark.parametrize("board", ["native", pytest.param("avr", marks=pytest.mark.soak)])
def test_a_robot_goes_around_the_track(board: str) -> None:
    """All of its middle's way is near the line: its sensors, 5 cm ahead, are over or beside it."""
    result = boebot.run(Brain([FollowLine()]), "shieldbot-line", arena="track", on=board, seconds=45)
    assert result.truth is not None and result.true_contacts == 0
    (line,) = load_arena("track").description.line
    points = np.array(line.points_m)
    way = np.vstack([a + np.linspace(0, 1, 50)[:, None] * (b - a) for a, b in pairwise(points)])
    path = np.column_stack((result.truth.x, result.truth.y))[::20]
    off = np.array([np.hypot(*(way - place).T).min() for place in path])
    assert off.max() < 0.04, "m"
    assert (result.true_distance or 0.0) > 4.5
