"""Following a line: what three line sensors say, and what the motors get; whole runs around the bundled track."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import boebot
from boebot.arenas import load_arena
from boebot.behaviors import FollowLine
from boebot.brain import Brain
from boebot.description.robots import load_robot
from boebot.devices.equipment import Equipment
from boebot.devices.latest import Latest, without_readings
from boebot.devices.line import LineSensor
from boebot.link.messages import LineTelemetry, Telemetry
from boebot.robot import Observation, Robot
from reading import read

ROBOT = load_robot("shieldbot-line")
NOTHING = without_readings(LineTelemetry)
TELEMETRY = Telemetry(*(0,) * len(Telemetry._fields))
WHITE, BLACK = 250, 3500


class Over:
    """A robot whose sensors are over what a test says."""

    def __init__(self, behavior: FollowLine) -> None:
        self.robot = Robot("shieldbot-line", 0.05)
        self.brain = Brain([behavior])
        self.steps = 0
        self._equipment = Equipment(ROBOT, 0.01)

    def step(self, left: int, middle: int, right: int) -> tuple[float, float]:
        """One step over these decay times (us); the motor signals."""
        message = LineTelemetry(0, left, middle, right, 1)
        time = 0.05 * self.steps
        latest = Latest({LineTelemetry: message}, 0)
        self.robot.observation = Observation(TELEMETRY, self._equipment, time, slow=latest)
        self.brain.step(self.robot)
        self.steps += 1
        return self.robot.command[1:]


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
    left, right = Over(FollowLine(signal=0.4, gain=0.2)).step(*over)
    assert (left, right) == pytest.approx((0.4 + 0.2 * turn, 0.4 - 0.2 * turn))


def test_a_lost_line_is_looked_for_where_it_was_seen_last_and_then_given_up() -> None:
    one = Over(FollowLine(signal=0.4, gain=0.2, patience=0.2))
    one.step(WHITE, BLACK, BLACK)
    assert one.step(WHITE, WHITE, WHITE) == pytest.approx((0.8, 0.0)), "to the right, twice as sharply"
    for _ in range(4):
        signals = one.step(WHITE, WHITE, WHITE)
    assert signals == (0.0, 0.0)
    assert one.step(WHITE, BLACK, WHITE) == pytest.approx((0.4, 0.4)), "found again"


def test_a_sensor_that_was_not_read_is_not_over_a_line() -> None:
    sensor = LineSensor(pin=7, position_m=(0.05, 0.0), dark_us=1000)
    assert read(sensor, "line_left", NOTHING._replace(line_left=1001, line_age=1)).dark
    assert not read(sensor, "line_left", NOTHING._replace(line_left=1000, line_age=1)).dark
    for silent in (NOTHING, NOTHING._replace(line_left=0, line_age=1), NOTHING._replace(line_left=5000, line_age=7)):
        assert not read(sensor, "line_left", silent).valid
    assert math.isinf(read(sensor, "line_left", NOTHING).age)


@pytest.mark.parametrize("board", ["native", "avr"])
def test_a_robot_goes_around_the_track(board: str) -> None:
    """All of its middle's way is near the line: its sensors, 5 cm ahead, are over or beside it."""
    result = boebot.run(Brain([FollowLine()]), "shieldbot-line", arena="track", on=board, seconds=45)
    assert result.truth is not None and result.contacts == 0
    (line,) = load_arena("track").description.line
    points = np.array(line.points_m)
    way = np.vstack([a + np.linspace(0, 1, 50)[:, None] * (b - a) for a, b in pairwise(points)])
    path = np.column_stack((result.truth.x, result.truth.y))[::20]
    off = np.array([np.hypot(*(way - place).T).min() for place in path])
    assert off.max() < 0.04, "m"
    assert result.distance > 4.5
