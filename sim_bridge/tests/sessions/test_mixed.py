"""Robots without boards in one world, among themselves and beside robots with boards: they sense and bump each other.

Truth: the same vehicle alone in a world (sim_bridge.vehicle), closed forms, and equality of runs bit for bit.
"""

from __future__ import annotations

import itertools
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot import Member
from boebot.arenas import Arena
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, BoardError, BoebotError, BrainError
from boebot.result import RunResult
from boebot.robot import Robot
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import native_board, native_library
from sim_bridge.sim import TICK_CYCLES, Sim, SimRobot
from sim_bridge.tests.simulated import MS, add_scripted, arena_of, square
from sim_bridge.vehicle import Vehicle
from sim_bridge.vehicles.model_file import vehicle_model

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

ARSIM, SHIELDBOT = load_robot("arsim"), load_robot("shieldbot")


def field(side: float = 8.0) -> Arena:
    return arena_of(outline=square(0, 0, side))


def ahead(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


def stand(robot: Robot) -> None:
    robot.drive(0.0, 0.0)


def path(result: RunResult) -> bytes:
    """Of the true path and of all that the brain sensed and did."""
    assert result.error is None and result.truth is not None
    columns = (result.truth.x, result.truth.y, result.truth.heading, result.truth.contact)
    sensed = repr((result.record.rows("readings"), result.record.steps, _received(result))).encode()
    return b"".join(column.tobytes() for column in columns) + sensed


def _received(result: RunResult) -> bytes:
    return b"".join(data for _, data in result.record.rows("to_host"))


# ---- the same vehicle as alone in a world --------------------------------------------------------------------------


def test_alone_in_a_shared_world_it_is_the_vehicle_of_its_own_world() -> None:
    """Bit for bit: noise, readings, bumps into the wall."""
    arena = field(2.5)
    sim = Sim(arena, seed=5, step_cycles=TICK_CYCLES)
    robot = sim.add(None, ARSIM, pose=(0.2, 0.1, 0.7))
    vehicle = Vehicle(vehicle_model(ARSIM), arena, seed=5, pose=(0.2, 0.1, 0.7))
    touched = False
    for step in range(400):
        assert robot.readings() == tuple(vehicle.readings)
        left, right = math.sin(0.02 * step), 0.6
        robot.signals(left, right)
        sim.run(TICK_CYCLES)
        vehicle.step(left, right)
        here, there = robot.body(), vehicle.body
        for name in ("x", "y", "heading", "speed", "turn_rate", "wheel_left", "wheel_right", "distance", "touching"):
            assert getattr(here, name) == getattr(there, name)
        touched |= bool(there.touching)
    assert touched and robot.true_contacts > 0


def test_step_of_a_world_with_boards_changes_little() -> None:
    """1 ms in place of 10 ms: Euler's method errs by its step, here by less than 2 % of the way."""
    ends = []
    for cycles in (TICK_CYCLES, MS):
        sim = Sim(field(), noise=False, step_cycles=cycles)
        robot = sim.add(None, ARSIM, pose=(-2.0, 0.0, 0.0))
        robot.signals(0.5, 0.55)
        sim.run(3 * CLOCK_HZ)
        ends.append((robot.body().x, robot.body().y))
    assert math.dist(*ends) < 0.02 * math.dist(ends[0], (-2.0, 0.0))


# ---- they sense and bump each other ----------------------------------------------------------------------------------


def pair(distance: float, heading: float) -> tuple[Sim, SimRobot, SimRobot]:
    sim = Sim(field(), noise=False, step_cycles=TICK_CYCLES)
    return sim, sim.add(None, ARSIM, pose=(0.0, 0.0, 0.0)), sim.add(None, ARSIM, pose=(distance, 0.0, heading))


def test_infrared_sees_the_other_one_where_it_is() -> None:
    """The left sensor looks to 0.7854 rad, where the other robot stands."""
    for distance in (0.6, 0.9):
        at = (distance * math.cos(0.7854), distance * math.sin(0.7854), 0.0)
        readings = []
        for others in (True, False):
            sim = Sim(field(), noise=False, step_cycles=TICK_CYCLES)
            robot = sim.add(None, ARSIM, pose=(0.0, 0.0, 0.0))
            if others:
                sim.add(None, ARSIM, pose=at)
            readings.append(robot.readings()[robot.layout["infrared_left"]][0])
        # the middle ray meets the disc of 0.2 m at distance - 0.4 from the sensor on the rim; (3.12): c1 / d^2 + c2,
        # averaged over rays that meet it a little farther away, or not at all
        nearest = min(1.0, 0.03 / (distance - 0.4) ** 2 + 0.1)
        assert 0.2 * nearest < readings[0] <= nearest and readings[1] == 0.0


def test_head_on_neither_enters_the_other() -> None:
    sim, left, right = pair(1.0, math.pi)
    for robot in (left, right):
        robot.signals(0.5, 0.5)
    for _ in range(300):
        sim.run(TICK_CYCLES)
        assert right.body().x - left.body().x >= 0.4 - 1e-6
    assert left.body().touching and right.body().touching and left.true_contacts == right.true_contacts == 1
    assert left.body().x == pytest.approx(1.0 - right.body().x, abs=1e-9), "equal robots meet in the middle"


def test_a_heavy_robot_pushes_a_light_one_with_a_board() -> None:
    sim = Sim(field(), noise=False)
    pusher = sim.add(None, ARSIM, pose=(-0.6, 0.0, 0.0))
    pushed = add_scripted(sim, pose=(0.0, 0.0, 0.0))
    pusher.signals(0.3, 0.3)
    sim.run(4 * CLOCK_HZ)
    gap = pushed.robot.body().x - pusher.body().x
    assert pushed.robot.body().x > 0.3
    assert gap == pytest.approx(ARSIM.body.radius_m + SHIELDBOT.body.radius_m, abs=1e-3)


def test_ping_of_a_board_hears_a_robot_without() -> None:
    """2 d / c by the closed form, d from the Ping to the rim of arsim."""
    sim = Sim(field(), noise=False)
    seer = add_scripted(sim, pose=(0.0, 0.0, 0.0))
    sim.add(None, ARSIM, pose=(1.0, 0.0, 0.0))
    seer.edge(MS, 8, 1)
    seer.edge(MS + 80, 8, 2)
    seer.run(0.03)
    rise, fall = seer.inputs(8)[-3:-1]
    assert (fall[0] - rise[0]) / 16 == pytest.approx(2 * (1.0 - 0.2 - 0.06) / 343.5 * 1e6, abs=0.1)


# ---- what does not matter --------------------------------------------------------------------------------------------


def crowd(order: tuple[int, ...]) -> tuple[int, list[tuple[float, ...]]]:
    """Three robots without boards and one with, near each other, added in that order."""
    sim = Sim(field(4.0), seed=9)
    poses = {0: (0.0, 0.0, 0.0), 2: (0.6, 0.1, math.pi), 5: (0.1, 0.7, -1.5), 6: (-0.4, 0.0, 0.2)}
    for number in order:
        if number == 6:
            sim.add(native_board(native_library(SHIELDBOT.pin_map)), SHIELDBOT, pose=poses[number], number=number)
        else:
            sim.add(None, ARSIM, pose=poses[number], number=number)
    for number in (0, 2, 5):
        sim.robot(number).signals(0.4, 0.3 + 0.02 * number)
    sim.run(2 * CLOCK_HZ)
    return sim.hash(), [sim.robot(number).readings() for number in (0, 2, 5)]


def test_order_of_adding_changes_no_bit() -> None:
    outcomes = [crowd(order) for order in itertools.islice(itertools.permutations((0, 2, 5, 6)), 0, 24, 3)]
    assert all(outcome == outcomes[0] for outcome in outcomes)


def test_way_a_run_is_cut_changes_no_bit() -> None:
    def outcome(cuts: list[int]) -> tuple[int, tuple[float, ...]]:
        sim = Sim(field(), seed=2)
        robot = sim.add(None, ARSIM, pose=(0.0, 0.0, 0.0))
        sim.add(None, ARSIM, pose=(0.7, 0.0, 2.0))
        robot.signals(0.5, 0.2)
        for cut in cuts:
            sim.run(cut)
        return sim.hash(), robot.readings()

    assert outcome([CLOCK_HZ]) == outcome([1, 15_999, 777_777, CLOCK_HZ - 793_777])


@pytest.mark.parametrize("robots", [("arsim", "arsim"), ("shieldbot", "arsim")])
def test_far_robot_changes_no_bit_of_the_first_ones_run(robots: tuple[str, str]) -> None:
    first, other = robots
    alone = path(boebot.run("wander", robot=first, arena="empty", seconds=5, seed=4))
    members = [Member(robot=first), Member(brain=ahead, robot=other, pose=(50.0, 0.0, 0.0), period=0.03)]
    assert path(boebot.run_together(members, "empty", 5.0, seed=4).robots[0]) == alone


def test_near_robot_does_change_it() -> None:
    def first(x: float) -> bytes:
        members = [Member(robot="arsim"), Member(brain=stand, robot="arsim", pose=(x, 0.3, 0.0))]
        return path(boebot.run_together(members, "empty", 5.0).robots[0])

    assert first(0.7) != first(50.0)


# ---- runs ------------------------------------------------------------------------------------------------------------


@pytest.mark.unsanitized
def test_a_run_of_both_kinds_is_told_and_saved(tmp_path: Path) -> None:
    members = [Member(robot="arsim"), Member(), Member(brain=ahead, robot="arsim", period=0.02)]
    result = boebot.run_together(members, "room", 4.0, out=tmp_path)
    assert [robot.board for robot in result.robots] == ["direct", "native", "direct"]
    assert [robot.seed for robot in result.robots] == [1, 2, 3]
    for robot in result.robots:
        assert (
            robot.run_time == pytest.approx(4.0, abs=0.02)
            and (robot.true_distance or 0.0) > 0.05
            and robot.true_pose is not None
        )
    assert (tmp_path / "run.png").is_file()
    assert all((tmp_path / f"robot-{number}" / "summary.json").is_file() for number in (1, 2, 3))


def test_one_that_is_done_stands_still() -> None:
    """Its run ends with the board's hello still to come for the other: nobody drives it from there on."""
    members = [Member(brain=ahead, robot="arsim"), Member(brain=stand, pose=(0.0, 5.0, 0.0))]
    truth = boebot.run_together(members, "empty", 2.0).robots[0].truth
    assert truth is not None and truth.time[-1] == pytest.approx(2.0)


def test_wander_of_three_bumps_nobody_through() -> None:
    result = boebot.run_together([Member(robot="arsim")] * 3, "arsim", 20.0)
    paths = [np.stack((r.truth.x, r.truth.y)) for r in result.robots if r.truth is not None]
    assert len(paths) == 3
    for one, two in itertools.combinations(paths, 2):
        assert np.hypot(*(one - two)).min() >= 0.4 - 1e-6


@pytest.mark.unsanitized
def test_command_line_runs_three_without_boards() -> None:
    command = [sys.executable, "-m", "boebot", "run", "wander", "--robots", "3", "--robot", "arsim", "--arena", "arsim"]
    done = subprocess.run([*command, "--seconds", "3", "--json"], capture_output=True, text=True, check=True)
    robots = json.loads(done.stdout)["robots"]
    assert [robot["robot"] for robot in robots] == ["arsim"] * 3
    assert all(robot["run_time_s"] == 3.0 and robot["true_distance_m"] > 0 for robot in robots)


@pytest.mark.unsanitized
@pytest.mark.parametrize("robot", ["arsim", pytest.param("shieldbot", marks=pytest.mark.soak)])
def test_one_robot_starts_where_it_is_told(robot: str) -> None:
    pose = (0.3, -0.4, 1.25)
    result = boebot.run(stand, robot=robot, arena="empty", seconds=1, pose=pose)
    assert result.truth is not None
    assert (result.truth.x[0], result.truth.y[0], result.truth.heading[0]) == pose
    command = [sys.executable, "-m", "boebot", "run", "wander", "--robot", robot, "--arena", "empty", "--seconds", "1"]
    done = subprocess.run([*command, "--pose", "0.3,-0.4,90deg", "--json"], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["robot"] == robot, "the table of one robot"


# ---- what is refused -------------------------------------------------------------------------------------------------


def test_wrong_wishes_are_refused() -> None:
    with pytest.raises(ArenaError, match="no free space"):
        boebot.run(stand, robot="arsim", arena="arsim", seconds=1, pose=(90.0, 0.0, 0.0))
    with pytest.raises(BoebotError, match="pose is 'here'"):
        boebot.run(stand, seconds=1, pose="here")  # type: ignore[arg-type]
    with pytest.raises(BoardError, match="starts where it stands"):
        boebot.run(stand, on="/dev/ttyACM0", seconds=1, pose=(0.0, 0.0, 0.0))
    sim, robot, _ = pair(1.0, 0.0)
    with pytest.raises(BrainError, match="finite"):
        robot.signals(math.nan, 0.0)
    with pytest.raises(BoardError, match="has no board"):
        _ = robot.board
    with pytest.raises(ArenaError, match="no free space"):
        sim.add(None, ARSIM, pose=(0.3, 0.0, 0.0))
    with pytest.raises(BoardError, match="'shieldbot' has a board"):
        sim.add(None, SHIELDBOT, pose=(3.0, 0.0, 0.0))
    sim.run(TICK_CYCLES)
    with pytest.raises(BoardError, match="runs already"):
        sim.add(None, ARSIM, pose=(3.0, 0.0, 0.0))
