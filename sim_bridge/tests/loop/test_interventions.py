"""Robots and moving shapes that somebody puts elsewhere while a run goes on: where they are then, what of it is in the
truth, what is refused, and that the same run with the same hands gives the same bits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot import Member
from boebot.arenas import Arena, ArenaDescription, Waypoint, description, load_arena
from boebot.arenas.floor_plan import floor_plan
from boebot.boards import (
    BoardRequest,
    BoardSession,
    LiveSession,
    VehicleSession,
    World,
    open_world,
)
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, BoardError
from boebot.record.truth import shifts, track_of
from boebot.result import RunResult
from boebot.robot import Robot
from boebot.running import loop
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import MS, add_scripted, arena_of, scripted, square

ARSIM, SHIELDBOT = load_robot("arsim"), load_robot("shieldbot")
CYCLE_S = 1 / CLOCK_HZ
SHAPE = "to and fro"


def street(*obstacles: list[tuple[float, float]], disc: bool = False) -> Arena:
    """A block or disc that goes to and fro along y = 1, turning, in an open field with those obstacles."""
    path = [
        Waypoint(time_s=0, x_m=-1, y_m=1, heading_rad=0.2),
        Waypoint(time_s=2, x_m=0, y_m=1, heading_rad=1.2),
        Waypoint(time_s=3, x_m=1, y_m=1, heading_rad=1.2),
    ]
    shape: dict[str, Any] = {"radius_m": 0.1} if disc else {"corners_m": square(0, 0, 0.2)}
    moving = description.Moving(path=path, repeat="back_and_forth", name=SHAPE, **shape)
    return Arena(ArenaDescription(name="street", obstacle=arena_of(*obstacles).description.obstacle, moving=[moving]))


def on_way(time: float) -> np.ndarray[Any, Any]:
    """Where its way has that shape: x, y, heading; of the first turn and the way back."""
    past = time if time <= 3 else 6 - time
    return np.array([np.interp(past, (0, 2, 3), row) for row in ((-1, 0, 1), (1, 1, 1), (0.2, 1.2, 1.2))])


def run(sim: Sim, seconds: float) -> None:
    sim.run(round(seconds * 1000) * MS)


# ---- a robot ---------------------------------------------------------------------------------------------------------


def test_a_robot_is_put_down_at_rest() -> None:
    """Its wheels have turned as far as before, its odometer goes on where it was, and its motors as they are told."""
    sim = Sim(load_arena("empty"), step_cycles=10 * MS, noise=False)
    robot = sim.add(None, ARSIM)
    robot.signals(0.5, 0.5)
    run(sim, 2.0)
    before, odometer = robot.body(), robot.readings()[robot.layout["odometer"]]
    robot.place(-1.0, 0.5, 3 * math.pi)
    here = robot.body()
    assert (here.x, here.y) == (-1.0, 0.5) and abs(here.heading) == pytest.approx(math.pi)
    assert (here.speed, here.turn_rate, here.lateral, here.rim_left, here.rim_right) == (0,) * 5
    for kept in ("wheel_left", "wheel_right", "distance"):
        assert getattr(here, kept) == getattr(before, kept) > 0
    run(sim, 0.01)
    goes_on = robot.readings()[robot.layout["odometer"]]
    assert np.allclose(goes_on, odometer, atol=0.682 * 0.01) and goes_on[0] > odometer[0]
    run(sim, 2.0)
    now = robot.body()
    assert now.speed == pytest.approx(before.speed, rel=1e-3) and now.y == pytest.approx(0.5)
    assert now.distance - before.distance == pytest.approx(-1.0 - now.x)


@pytest.mark.parametrize("x", [0.5, 0.9, 2.0])
def test_a_robot_is_not_put_into_anything(x: float) -> None:
    """A wall at 0.5, another robot at 0.9, a moving shape at 2; and nothing has changed."""
    moving = description.Moving(path=[Waypoint(time_s=0, x_m=2, y_m=0)], radius_m=0.1)
    walls = arena_of(square(0.5, 0, 0.1)).description.obstacle
    sim = Sim(Arena(ArenaDescription(name="full", obstacle=walls, moving=[moving])))
    robot, _ = add_scripted(sim, pose=(0, 0, 0)), add_scripted(sim, pose=(0.9, 0, 0))
    run(sim, 0.1)
    state = sim.hash()
    words = rf"a robot cannot stand at {x:.2f} m, 0.01 m: a wall, a moving shape or another robot is in the way"
    with pytest.raises(ArenaError, match=words):
        robot.robot.place(x, 0.01, 0)
    assert sim.hash() == state
    robot.robot.place(1.4, 0, 0)
    with pytest.raises(ArenaError, match="cannot stand"):
        Sim(load_arena("room")).add(None, ARSIM).place(50, 0, 0)


def test_the_truth_has_a_lift_as_two_rows_a_cycle_apart() -> None:
    """Also where a robot is lifted twice at once, with the record drained in between; times increase."""
    robot = scripted().robot
    sim = robot.sim
    run(sim, 0.0234)
    robot.place(1, 0, 0)
    parts = [robot.drain()["truth"]]
    robot.place(2, 0, 0)
    run(sim, 0.02)
    robot.place(3, 0, 0)
    run(sim, 0.02)
    parts.append(robot.drain()["truth"])
    time = np.concatenate([part.times for part in parts])
    x = np.concatenate([np.frombuffer(part.data).reshape(-1, 8)[:, 0] for part in parts])
    at, again = 0.023, 0.043
    rows = [(0, 0), (0.01, 0), (0.02, 0), (at - CYCLE_S, 0), (at, 1), (at + CYCLE_S, 2), (0.03, 2), (0.04, 2)]
    rows += [(again - CYCLE_S, 2), (again, 3), (0.05, 3), (0.06, 3)]
    assert list(zip(time.tolist(), x.tolist(), strict=True)) == [(pytest.approx(t, abs=1e-12), x) for t, x in rows]


def test_before_a_run_begins_and_without_a_record() -> None:
    robot = scripted().robot
    robot.place(1, 0, 0)
    run(robot.sim, 0.015)
    columns = robot.truth()
    assert columns["time"].tolist() == [0, 0.01] and columns["x"].tolist() == [1, 1]
    sim = Sim(street(), record=False)
    other = sim.add(None, ARSIM)
    other.place(1, 0, 0)
    sim.place_shape(0, (0, 2, 0))
    assert other.truth_now().pose == (1, 0, 0) and sim.shifts() == [] and sim.drain() == {}


# ---- a moving shape --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("disc", [False, True])
def test_a_shape_goes_on_along_its_way_shifted(disc: bool) -> None:
    sim = Sim(street(disc=disc))
    add_scripted(sim)
    offset = np.zeros(3)
    for until, pose in ((0.7, (-0.2, 1.5, 2.0)), (1.1, None), (2.6, (3.0, -2.0, -1.0)), (4.5, None)):
        run(sim, until - sim.cycle / CLOCK_HZ)
        (now,) = sim.shapes()
        apart = np.array(now) - on_way(until) - offset
        assert np.abs(np.remainder(apart + math.pi, 2 * math.pi) - math.pi).max() < 1e-9
        if pose is not None:
            sim.place_shape(0, pose)
            assert sim.shapes()[0] == pytest.approx(pose)
            offset = np.array(pose) - on_way(until)


def test_a_shape_is_not_put_onto_a_robot() -> None:
    """Nor where there is none; nothing has changed."""
    sim = Sim(street())
    add_scripted(sim, pose=(0.5, 0, 0))
    run(sim, 0.1)
    shapes = sim.shapes()
    with pytest.raises(ArenaError, match=r"moving shape 1 cannot stand at 0.45 m, 0.05 m: a robot is there"):
        sim.place_shape(0, (0.45, 0.05, 1))
    for index in (1, -1, "x"):
        with pytest.raises(ArenaError, match=r"place_shape: the moving shape is .*; expected a whole number"):
            sim.place_shape(index, (0, 0, 0))  # type: ignore[arg-type]
    with pytest.raises(ArenaError, match="expected 3 finite numbers"):
        sim.place_shape(0, (math.nan, 0, 0))
    with pytest.raises(ArenaError, match="arena test has no moving shape"):
        scripted().sim.place_shape(0, (0, 0, 0))
    assert sim.shapes() == shapes and sim.shifts() == []


def test_a_shape_pushes_where_it_is() -> None:
    """By its way it never comes to the robot; put onto the robot's line it pushes it along."""
    sim = Sim(street(disc=True))
    robot = sim.add(None, ARSIM, pose=(0, 0, 0))
    run(sim, 0.5)
    x, _, heading = sim.shapes()[0]
    sim.place_shape(0, (x, 0, heading))
    run(sim, 1.5)
    (now,) = sim.shapes()
    assert robot.true_contacts == 1
    assert robot.body().x - now[0] == pytest.approx(ARSIM.body.radius_m + 0.1, abs=1e-4)


def test_a_shape_that_waited_goes_on_elsewhere() -> None:
    """It pinches a robot at a wall and waits; put away it goes on at once, late by the time that it has waited."""
    sim = Sim(street(square(0.4, 1, 0.4), disc=True))
    sim.add(None, ARSIM, pose=(0.2 - ARSIM.body.radius_m - 0.001, 1, 0))
    run(sim, 2.5)
    (late,) = sim.lateness()
    waited = late.waited[-1]
    assert waited > 0.2
    x, y, heading = sim.shapes()[0]
    sim.place_shape(0, (x, y + 2, heading))
    run(sim, 0.4)
    assert sim.lateness()[0].waited[-1] == pytest.approx(waited)
    expected = on_way(2.9 - waited) + np.array((0, 2, 0))
    assert sim.shapes()[0] == pytest.approx(expected, abs=1e-6)


def test_the_plan_has_shapes_where_they_were() -> None:
    """Put elsewhere twice, and waiting in between; at every moment as the world itself has it."""
    arena = street(square(0.4, 1, 0.4), disc=True)
    sim = Sim(arena)
    robot = sim.add(None, ARSIM, pose=(0.2 - ARSIM.body.radius_m - 0.001, 1, 0))
    seen = []
    for step in range(500):
        if step == 240:
            sim.place_shape(0, (0.1, 2.0, 2.5))
        if step in (400, 401):
            sim.place_shape(0, (-2.0, 0.02 * step, -3.0))
        seen.append((sim.cycle / CLOCK_HZ, *sim.shapes()[0]))
        run(sim, 0.01)
    assert sim.lateness()[0].waited[-1] > 0.2
    (shape,) = floor_plan(arena, 0, 5, sim.lateness(), sim.shifts()).moving
    for time, *pose in seen:
        x, y, heading = shape.pose(time)
        assert (x, y) == pytest.approx(pose[:2], abs=1e-9)
        assert math.remainder(heading - pose[2], 2 * math.pi) == pytest.approx(0, abs=1e-9)
    (later,) = floor_plan(arena, 3, 3.5, sim.lateness(), sim.shifts()).moving
    assert later.pose(3.2) == pytest.approx(shape.pose(3.2), abs=1e-9)
    assert robot.truth()["time"][-1] > 4.9


# ---- whole runs ------------------------------------------------------------------------------------------------------

Deed = Callable[[BoardSession | VehicleSession], object]


@pytest.fixture
def sessions(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Of the run under way."""
    opened: list[Any] = []

    def world(url: str, requests: Sequence[BoardRequest]) -> World:
        shared = open_world(url, requests)
        opened[:] = shared.sessions
        return shared

    monkeypatch.setattr(loop, "open_world", world)
    return opened


def handled(sessions: list[Any], deeds: dict[int, Deed]) -> Callable[[Robot], None]:
    """A brain that drives on; at these of its steps somebody lays hands on its session."""
    steps = iter(range(10**9))

    def brain(robot: Robot) -> None:
        if deed := deeds.get(next(steps)):
            deed(sessions[0])
        robot.drive(0.4, 0.3)

    return brain


DEEDS: dict[int, Deed] = {
    30: lambda session: session.place(-1.5, -0.9, 1.0),
    50: lambda session: session.place_shape(0, 0.0, 0.9, 0.5),
    51: lambda session: session.place(-1.4, -0.9, -0.5),
    52: lambda session: session.place(-1.2, 0.7, -0.5),
}


def streams(result: RunResult) -> dict[str, Any]:
    names = ("truth", "waits", "shifts", "telemetry", "readings", "command", "to_host", "to_board")
    return {name: result.record.rows(name) for name in names}


@pytest.mark.parametrize("on", ["native", "direct", "avr"])
def test_the_same_hands_give_the_same_bits(on: str, sessions: list[Any]) -> None:
    robot = "arsim" if on == "direct" else "shieldbot"

    def once(deeds: dict[int, Deed]) -> RunResult:
        brain = handled(sessions, deeds)
        return boebot.run(brain, robot=robot, on=on, arena="showcase", seconds=1.5, seed=7, period=0.01)

    first, second, alone = once(DEEDS), once(DEEDS), once({})
    assert first.error is None
    ours = streams(first)
    assert ours == streams(second) and ours != streams(alone)
    assert len(ours["shifts"]) == 1 and len(track_of(first.record.block("truth")).lifts) == 3
    assert streams(alone)["shifts"] == []


def test_two_in_one_world(sessions: list[Any]) -> None:
    """One with a board, one without; each tells of itself, both see the shape, and no place is taken twice."""
    poses: list[Any] = []

    def deed(session: Any) -> None:
        with_board, without = sessions
        without.place(1.5, 0.9, 0)
        with pytest.raises(ArenaError, match="another robot is in the way"):
            with_board.place(1.5, 0.92, 0)
        without.place_shape(1, -1.0, 0.2, 0.0)
        poses[:] = [with_board.truth_now(), without.truth_now()]

    members = [
        Member(brain=handled(sessions, {10: deed}), robot="shieldbot", pose=(-1.5, -0.9, 0.0)),
        Member(brain=handled(sessions, {}), robot="arsim", pose=(1.5, -0.9, 1.0)),
    ]
    result = boebot.run_together(members, arena="showcase", seconds=1)
    one, other = result.robots
    assert other.truth is not None and one.truth is not None
    assert poses[1].pose == (1.5, 0.9, 0.0) and poses[0].shapes == poses[1].shapes
    assert poses[0].shapes[1][:2] == pytest.approx((-1.0, 0.2))
    assert len(track_of(one.record.block("truth")).lifts) == 0 and len(track_of(other.record.block("truth")).lifts) == 1
    for each in (one, other):
        assert [shift.shape for shift in shifts(each.record)] == [1]
        assert each.plan.moving[1].pose(1.0)[1] == pytest.approx(0.2)


@pytest.mark.parametrize("on", ["native", "direct"])
def test_what_is_made_of_a_run_with_lifts(on: str, sessions: list[Any], tmp_path: Path) -> None:
    """The way is what the wheels have rolled, and all places are numbers, which can be drawn."""
    counted: list[float] = []
    deeds = DEEDS | {148: lambda session: counted.append(session.counters()["true_distance_m"])}
    robot = "arsim" if on == "direct" else "shieldbot"
    brain, out = handled(sessions, deeds), tmp_path / "run"
    result = boebot.run(brain, robot=robot, on=on, arena="showcase", seconds=1.5, period=0.01, out=out)
    assert result.true_distance == pytest.approx(counted[0], abs=0.02)
    assert result.truth is not None and np.isfinite(result.truth.x).all()
    assert (np.diff(result.truth.time) > 0).all()
    assert result.overview.columns.true_pose is not None
    poses = [(each.x, each.y, each.heading) for each in result.plan.moving]
    path = result.overview.columns.true_pose
    assert all(np.isfinite(pose).all() for pose in [(path.x, path.y, path.heading), *poses])
    assert (out / "replay.html").exists() and (out / "run.png").exists()
    shape = result.plan.moving[0]
    moment = shifts(result.record)[0].time
    assert shape.pose(moment)[:2] == pytest.approx((0.0, 0.9))
    assert np.hypot(shape.pose(moment - 0.01)[0] - 1.0, shape.pose(moment - 0.01)[1] + 0.7) < 0.1


def test_a_robot_behind_a_port_is_lifted_by_hand() -> None:
    nothing: Any = None
    session = LiveSession(nothing, "board at /dev/ttyACM0")
    assert session.truth_now() is None
    with pytest.raises(BoardError, match="the board at /dev/ttyACM0 is put elsewhere by hand"):
        session.place(0, 0, 0)
    with pytest.raises(BoardError, match="what stands around the board at /dev/ttyACM0 is moved by hand"):
        session.place_shape(0, 0, 0, 0)
