"""Runs without a board: the same brains, the same results, as far as the robot has what they need.

Truth: the notes' (2.31), (2.32) and (3.13) worked out by hand for their default robot, and closed forms.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

import msgspec
import numpy as np
import pytest

import boebot
from boebot.boards import BoardRequest, VehicleSession, open_board, open_world
from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.accelerometer import Accelerometer
from boebot.devices.compass import HeadingCompass
from boebot.devices.infrared import InfraredProximity
from boebot.devices.laser import Laser
from boebot.devices.line import ReflectanceSensor
from boebot.devices.whisker import TouchWhisker
from boebot.errors import BoardError, BrainError
from boebot.robot import Observation, Robot
from boebot.running.loop import execute
from boebot.running.tasks import Request

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

ARSIM = load_robot("arsim")


def changed(**devices: object) -> RobotDescription:
    return msgspec.structs.replace(ARSIM, device=ARSIM.device | devices)


def signals(left: float, right: float) -> object:
    return lambda robot: robot.drive(left, right)


@pytest.mark.parametrize(("signal", "speed"), [(0.5, 0.682), (1.0, 1.381), (-0.5, -0.682)])
def test_steady_speed_is_that_of_the_notes(signal: float, speed: float) -> None:
    result = boebot.run(signals(signal, signal), robot="arsim", arena="empty", seconds=3)
    assert result.error is None and result.truth is not None and result.truth.left_speed is not None
    assert result.truth.left_speed[-1] == pytest.approx(speed, abs=0.001)
    rise = np.flatnonzero(np.abs(result.truth.left_speed) >= 0.632 * abs(speed))[0] * result.tick
    assert rise == pytest.approx(0.15, abs=0.02 + 1e-9), "63 %, E05"


def test_in_place_turn_is_that_of_the_notes() -> None:
    result = boebot.run(signals(-0.7, 0.7), robot="arsim", arena="empty", seconds=3)
    assert result.truth is not None
    rate = np.diff(np.unwrap(result.truth.heading))[-1] / result.tick
    assert rate == pytest.approx(4.447, rel=0.001)


def test_speed_command_is_its_share_of_the_greatest_speed() -> None:
    most = ARSIM.body.wheel_speed_maximum_m_s
    by_speed = boebot.run(lambda r: r.drive_speed(most / 2, most / 4), robot="arsim", seconds=1)
    by_signal = boebot.run(signals(0.5, 0.25), robot="arsim", seconds=1)
    assert by_speed.truth is not None and by_signal.truth is not None
    assert by_speed.truth.x == pytest.approx(by_signal.truth.x, abs=1e-12)
    assert by_speed.truth.heading[-1] < -0.1


@pytest.mark.unsanitized
def test_same_brain_runs_with_and_without_a_board(tmp_path: Path) -> None:
    for robot in ("arsim", "shieldbot", "shieldbot-basic"):
        result = execute(Request.single("wander", robot=robot, seconds=20))
        assert result.error is None and (result.true_distance or 0.0) > 1.0 and result.steps == 400, robot
        assert result.robot.name == robot
        names = {path.name for path in result.save(tmp_path / robot, csv=True)}
        assert {"run.csv", "summary.json", "run.png", "replay.html"} <= names


def test_same_seed_same_run() -> None:
    one, two, other = (execute(Request.single("wander", robot="arsim", seconds=10, seed=seed)) for seed in (3, 3, 4))
    assert one.truth is not None and two.truth is not None and other.truth is not None
    assert np.array_equal(one.truth.x, two.truth.x) and np.array_equal(one.series.raw, two.series.raw)
    assert not np.array_equal(one.series.raw["values"], other.series.raw["values"])


def test_infrared_reads_the_notes_values_at_a_wall() -> None:
    """Straight at a flat wall from 0.30 m: 0.411 by (3.12) to (3.14)."""
    ahead = InfraredProximity(position_m=(0.2, 0.0), heading_rad=0.0)
    request = BoardRequest(robot=changed(infrared_left=ahead), arena="arsim", noise=False, pose=(1.3, 0.0, 0.0))
    session = cast(VehicleSession, open_world("direct", [request]).sessions[0])
    values = session.readings()
    assert values[session.layout["infrared_left"].start] == pytest.approx(0.411, abs=0.001)


def test_every_sensor_of_the_vocabulary_is_seen_by_its_name() -> None:
    robot = changed(
        laser=Laser(position_m=(0.1, 0.0), rays=5, step_rad=math.pi / 4, sigma=0.0, period_s=0.1),
        accelerometer=Accelerometer(sigma_m_s2=0.0),
        whisker_left=TouchWhisker(root_m=(0.2, 0.05), tip_m=(0.3, 0.1)),
        whisker_right=TouchWhisker(root_m=(0.2, -0.05), tip_m=(0.3, -0.1)),
        compass=HeadingCompass(sigma_rad=0.0),
    )
    seen: list[Observation] = []

    def step(robot: Robot) -> None:
        seen.append(robot.observation)
        robot.drive(0.3, 0.3)

    result = boebot.run(step, robot=robot, arena="arsim", seconds=0.3, period=0.03)
    assert result.error is None
    first = seen[0].laser
    assert first.angles[2] == 0.0 and first.angles[0] == pytest.approx(-math.pi / 2)
    assert first.distances[2] == pytest.approx(1.7), "from x = 0.1 m to the wall at 1.8 m"
    assert first.distances[0] == pytest.approx(1.8)
    assert [round(look.laser.age, 6) for look in seen[:5]] == [0.0, 0.03, 0.06, 0.09, 0.02]
    assert seen[1].laser.distances == first.distances, "held between two samples"
    assert seen[1].accelerometer.value > 0.5 and not seen[0].whisker_left.pressed
    assert seen[-1].compass.heading == 0.0


def test_latched_motors_and_errors_end_as_with_a_board() -> None:
    def step(robot: Robot) -> None:
        if robot.time < 0.5:
            robot.drive(0.5, 0.5)
        elif robot.time < 2.0:
            robot.emergency_stop()
        else:
            raise ValueError("enough")

    result = execute(Request.single(step, robot="arsim", arena="empty", seconds=5))
    assert isinstance(result.error, BrainError) and "ValueError: enough" in str(result.error)
    assert result.run_time == pytest.approx(2.0)
    assert result.truth is not None and result.truth.left_speed is not None
    assert abs(result.truth.left_speed[-1]) < 0.01
    assert not result.series.status[-1] & 1


def test_boards_and_robots_that_do_not_fit_are_refused() -> None:
    with pytest.raises(BoardError, match="robot 'arsim' has no board: it cannot run on 'native'; expected 'direct'"):
        boebot.run("wander", robot="arsim", on="native")
    with pytest.raises(BoardError, match="robot 'arsim' has no board"):
        open_board("avr", BoardRequest(robot=ARSIM))
    with pytest.raises(BoardError, match="robot 'shieldbot' is driven by its board: it cannot run 'direct'"):
        boebot.run("wander", on="direct")


def test_period_of_the_brain_is_a_multiple_of_the_step() -> None:
    with pytest.raises(boebot.BoebotError, match="period of 15 ms does not fit; expected a multiple of 10 ms"):
        boebot.run("wander", robot="arsim", period=0.015)
    for none in (0.0, -0.05, math.nan, math.inf):
        with pytest.raises(boebot.BoebotError, match=r"m?s is none; expected more than 0"):
            boebot.run("wander", robot="arsim", period=none)
    assert boebot.run("wander", robot="arsim", period=1.5, seconds=6).steps == 4, "no set-point has to outlive it"


def test_sensors_of_the_floor_stand_anywhere_under_any_name() -> None:
    """The track's tape is 19 mm wide with reflectance 0.05 on a floor of 0.8; a black hole would seem to have 0.01."""
    robot = changed(
        nose=ReflectanceSensor(position_m=(0.1, 0.0), sigma=0.0),
        wing=ReflectanceSensor(position_m=(0.1, 0.1), sigma=0.0),
    )
    seen: list[tuple[float | None, bool]] = []

    def step(robot: Robot) -> None:
        for name in ("nose", "wing"):
            line = getattr(robot, name)
            seen.append((line.reflectance, line.dark))

    boebot.run(step, robot, arena="track", on="direct", seconds=0.1)
    assert [dark for _, dark in seen[:2]] == [True, False]
    assert [reflectance for reflectance, _ in seen[:2]] == pytest.approx([0.06, 0.81])


def test_a_robot_may_have_several_lasers() -> None:
    """Each alone between the walls at 1.8 m; the second looks back."""
    robot = changed(
        ahead=Laser(position_m=(0.0, 0.0), rays=1, range_m=9.0, sigma=0.0),
        behind=Laser(position_m=(0.0, 0.0), rays=1, heading_rad=math.pi, range_m=9.0, sigma=0.0),
    )
    found: list[float | None] = []

    def step(robot: Robot) -> None:
        found.extend(getattr(robot, name).distances[0] for name in ("ahead", "behind"))

    boebot.run(step, robot, arena="arsim", on="direct", seconds=0.1, pose=(0.5, 0.0, 0.0))
    assert found[:2] == pytest.approx([1.3, 2.3])
