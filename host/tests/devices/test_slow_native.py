"""Slow devices of robots whose board is emulated: what a brain reads is what the arena has.

Truth: the arena's lamp and walls, the robot's true heading, the battery's figures.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from boebot.boards import BoardRequest, board_kinds, open_board
from boebot.brains import LoadedBrain
from boebot.description.robots import load_robot
from boebot.record.run import Run
from boebot.robot import Observation, Robot
from boebot.running.board_driver import BoardDriver
from boebot.running.loop import about, execute
from boebot.running.tasks import Request, Task

pytestmark = pytest.mark.skipif("native" not in board_kinds(), reason="the simulator is not installed")

LAMP = (1.6, 1.2, 5.0)  # x, y (m), power (W) of the arena showcase
NEAR_M, AMBIENT, SCALE_S = 0.05, 1.0, 0.0015  # of the phototransistor and its capacitor
SENSORS = {"left": (0.05, 0.04, 0.5), "right": (0.05, -0.04, -0.5)}  # x, y (m), heading (rad) on the robot
Pose = tuple[float, float, float]


def watch(
    robot: str, arena: str, pose: Pose, step: Callable[[Robot], None], seconds: float = 1.0
) -> tuple[list[Observation], Run]:
    """What a robot that was put there sees, without noise."""
    seen: list[Observation] = []

    def brain(robot: Robot) -> None:
        seen.append(robot.observation)
        step(robot)

    request = BoardRequest(robot=load_robot(robot), arena=arena, noise=False, pose=pose)
    task = Task(
        request=Request.single(seconds=seconds),
        brain=LoadedBrain("watch", brain),
        board=request,
        on="native",
        period_s=0.05,
        seed=1,
    )
    session = open_board("native", request)
    try:
        driver = BoardDriver(session, task)
        driver.begin()
        for _ in driver.steps():
            brain(driver.robot)
        driver.end()
        return seen, Run(**about(driver, task), **driver.status()._asdict())
    finally:
        session.close()


def stay(robot: Robot) -> None:
    """Does nothing."""


def decay_time(pose: Pose, side: str) -> float:
    """L = ambient + P cos(theta) / (d0^2 + d^2) (sim_bridge/world/sensors/light.h); the capacitor needs SCALE_S / L."""
    x0, y0, heading = pose
    forward, aside, turn = SENSORS[side]
    x = x0 + forward * math.cos(heading) - aside * math.sin(heading)
    y = y0 + forward * math.sin(heading) + aside * math.cos(heading)
    dx, dy = LAMP[0] - x, LAMP[1] - y
    facing = math.cos(math.atan2(dy, dx) - heading - turn)
    return SCALE_S / (AMBIENT + max(0.0, facing) * LAMP[2] / (NEAR_M**2 + dx * dx + dy * dy))


@pytest.mark.parametrize("robot", ["shieldbot-basic", "boebot"])
@pytest.mark.parametrize("pose", [(1.25, 0.85, 1.2), (1.25, 0.85, 0.3), (1.25, 0.85, -2.0)])
def test_light_sensors_near_a_lamp(robot: str, pose: Pose) -> None:
    seen, result = watch(robot, "showcase", pose, stay)
    assert result.error is None
    for side, view in (("left", seen[-1].light_left), ("right", seen[-1].light_right)):
        assert view.valid and view.age <= 0.06
        assert view.decay_time == pytest.approx(decay_time(pose, side), rel=0.02, abs=3e-6), side


def test_screen_shades_the_lamp() -> None:
    """Between (-1.5, -1.0) and the lamp stands the showcase's screen: only the ambient light is left."""
    seen, _ = watch("shieldbot-basic", "showcase", (-1.5, -1.0, 0.3), stay)
    for view in (seen[-1].light_left, seen[-1].light_right):
        assert view.decay_time == pytest.approx(SCALE_S / AMBIENT, rel=0.01)


@pytest.mark.parametrize("heading", [0.3, 2.0, -2.8])
def test_compass_has_the_true_heading(heading: float) -> None:
    seen, _ = watch("boebot", "room", (0.0, 0.0, heading), stay)
    assert seen[-1].compass.valid and seen[-1].compass.heading is not None
    field_counts = 0.19 * 1090  # along the floor
    assert abs(math.remainder(seen[-1].compass.heading - heading, math.tau)) < 1.0 / field_counts


def test_battery_sags_under_load() -> None:
    """5.5 V behind 2.5 ohm: 0.08 A at rest (the board; servos without pulses draw none); running, 4.6 V as measured."""

    def step(robot: Robot) -> None:
        if robot.time > 0.5:
            robot.drive(1.0, 1.0)

    seen, _ = watch("boebot", "room", (0.0, 0.0, 0.0), step, seconds=1.5)
    volts = [look.battery.voltage for look in seen if look.time > 0.2]
    assert all(volt is not None for volt in volts)
    resting, running = volts[2], volts[-1]
    assert resting is not None and running is not None
    assert resting == pytest.approx(5.5 - 2.5 * 0.08, abs=0.03)
    assert running == pytest.approx(4.6, abs=0.15)


def test_turret_turns_the_range_finder() -> None:
    """The room's screen stands 0.6 m ahead of the robot, a wall 0.4 m to the left of it; the Ping))) sits 0.06 m ahead
    of the axle and 0.015 m ahead of the turret's axis."""
    wall_m = 0.4

    def step(robot: Robot) -> None:
        robot.turn_turret(0.0 if robot.time < 0.9 else math.pi / 2)

    seen, result = watch("boebot", "room", (0.0, 1.5 - wall_m, 0.0), step, seconds=2.5)
    ahead = next(look for look in seen if look.time >= 0.85)
    left = seen[-1]
    assert ahead.turret.angle == pytest.approx(0.0, abs=2e-4)
    assert left.turret.angle == pytest.approx(math.pi / 2, abs=3e-4)
    assert ahead.ping.distance == pytest.approx(0.6 - 0.06, abs=0.005)
    assert left.ping.distance == pytest.approx(wall_m - 0.015, abs=0.012)
    assert result.link["host"]["retransmitted"] == 0


def test_same_brain_on_robots_with_other_devices(tmp_path: Path) -> None:
    """It asks what there is, and uses it by the same names everywhere."""
    used: dict[str, set[str]] = {}

    def step(robot: Robot) -> None:
        robot.drive(0.3, 0.25)
        names = used.setdefault(robot.name, set())
        for name in ("lights", "compass", "battery", "analog_infrared", "turret", "buzzer"):
            if robot.has(name):
                names.add(name)
        if robot.time < 0.5:
            return
        if robot.has("lights"):
            assert robot.light_left.valid and robot.light_left.brightness is not None
        if robot.has("compass"):
            assert robot.compass.valid and robot.compass.heading is not None
        if robot.has("battery"):
            assert robot.battery.valid and 4.0 < (robot.battery.voltage or 0.0) < 8.0
        if robot.has("buzzer") and robot.tick % 50 == 0:
            robot.beep(440, 0.1)

    for name in ("shieldbot-basic", "shieldbot", "boebot", "arsim"):
        result = execute(Request.single(step, robot=name, arena="showcase", seconds=2))
        assert result.error is None, (name, result.error)
        assert (result.true_distance or 0.0) > 0.05
        result.save(tmp_path / name, csv=True)
    assert used == {
        "shieldbot-basic": {"lights", "buzzer"},
        "shieldbot": set(),
        "boebot": {"lights", "compass", "battery", "analog_infrared", "turret", "buzzer"},
        "arsim": {"compass"},
    }
    assert "light_left_decay_time_s" in (tmp_path / "shieldbot-basic" / "run.csv").read_text().splitlines()[0]
