"""Moving shapes that waited for a robot are drawn where they really were: after runs, in logs and in a view."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from boebot.arenas import Arena, ArenaDescription, Start, Waypoint, description
from boebot.arenas.floor_plan import Lateness, Moving, Solid, floor_plan
from boebot.boards import Truth
from boebot.description.robots import load_robot
from boebot.record.record import Record
from boebot.record.truth import lateness
from boebot_course.recorder import Recorder
from boebot_course.vehicle_view import View
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.sessions.session import DirectSession
from sim_bridge.sim import Sim, SimRobot
from sim_bridge.tests.simulated import MS, add_scripted, arena_of, happened, square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

SIDE = 0.4  # of the block
PINCHED_S, FREE_S = 3.0, 4.0


def press(*, disc: bool = False) -> Arena:
    """A block or disc that goes to and fro, turning a little at first, up to 2 cm from a wall at x = 1.

    It would turn back at 2.5007 s, between two steps.
    """
    way = [
        Waypoint(time_s=0, x_m=-0.4, y_m=0, heading_rad=0.3),
        Waypoint(time_s=1.2003, x_m=0.2, y_m=0),
        Waypoint(time_s=2.5007, x_m=0.78, y_m=0),
    ]
    shape: dict[str, Any] = {"radius_m": SIDE / 2} if disc else {"corners_m": square(0, 0, SIDE)}
    moving = description.Moving(path=way, repeat="back_and_forth", **shape)
    walls = arena_of(square(2.0, 0.0, 2.0)).description.obstacle
    start = Start(x_m=0.7, y_m=0.0, heading_rad=math.pi / 2)
    return Arena(ArenaDescription(name="press", start=start, obstacle=walls, moving=[moving]))


def shape_of(solid: Solid) -> shapely.Polygon:
    return shapely.Point(solid.points[0]).buffer(solid.radius) if solid.radius else shapely.Polygon(solid.points)


def pose_of(mover: Any) -> tuple[float, float, float]:
    return mover.x, mover.y, math.atan2(mover.sine, mover.cosine)


def apart(here: tuple[float, float, float], there: tuple[float, float, float]) -> float:
    """The greatest distance between the block at one pose and at another, m."""
    at = [shape_of(Solid(kind="obstacle", points=np.array(square(0, 0, SIDE))).placed(*pose)) for pose in (here, there)]
    return float(shapely.hausdorff_distance(*at))


def poses_in(sim: Sim) -> tuple[float, tuple[float, float, float]]:
    """The world's time and its one moving shape's pose, from the core itself."""
    (mover,) = sim.movers()
    return sim.handle.world_at / CLOCK_HZ, pose_of(mover)


def run(sim: Sim, seconds: float) -> Iterator[tuple[float, tuple[float, float, float]]]:
    """What the world says every 7 ms."""
    for _ in range(round(seconds / 0.007)):
        sim.run(7 * MS)
        yield poses_in(sim)


def check(truth: Truth | None, arena: Arena, seen: list[tuple[float, tuple[float, float, float]]]) -> Moving:
    """The plan has the shape where the world had it, and by its path alone it would be elsewhere."""
    assert truth is not None
    (shape,) = truth.plan.moving
    seen = [(time, pose) for time, pose in seen if time <= truth.time[-1]]
    assert max(apart(shape.pose(time), pose) for time, pose in seen) < 1e-6
    (path,) = floor_plan(arena, float(truth.time[0]), float(truth.time[-1])).moving
    assert max(apart(path.pose(time), pose) for time, pose in seen) > 0.3
    return shape


OF_LOG = ("time", "true_x", "true_y")  # columns of a Recorder


def deepest(shape: Moving, columns: Any, radius: float, names: Sequence[str] = ("time", "x", "y")) -> float:
    """How far a robot's circle is in the shape at most, m; negative: it never touches."""
    rows = zip(*(columns[name].tolist() for name in names), strict=True)
    return max(radius - float(shapely.distance(shape_of(shape.at(t)), shapely.Point(x, y))) for t, x, y in rows)


def test_a_robot_without_a_board_is_pinched_and_leaves() -> None:
    arena, robot = press(), load_robot("arsim")
    sim = Sim(arena)
    pinched = sim.add(None, robot)
    seen = list(run(sim, PINCHED_S))
    (late,) = sim.lateness()
    assert 0.5 < late.waited[-1] < PINCHED_S
    pinched.signals(1.0, 1.0)
    seen += run(sim, FREE_S)
    shape = check(happened(pinched), arena, seen)
    assert abs(deepest(shape, pinched.truth(), robot.body.radius_m)) < 2e-6, "it was touched, never entered"
    (late,) = sim.lateness()
    assert len(late.time) < 100, "rows only where something changes"


@pytest.mark.parametrize("disc", [False, True])
def test_a_robot_with_a_board_is_pinched_and_taken_away(disc: bool) -> None:
    """Beside it stands another one, so that the world solves several bodies."""
    arena = press(disc=disc)
    sim = Sim(arena)
    robot = add_scripted(sim)
    add_scripted(sim, pose=(0.0, 3.0, 0.0))
    seen = list(run(sim, PINCHED_S))
    robot.robot.place(0.0, 1.0, 0.0)
    seen += run(sim, FREE_S)
    check(happened(robot.robot), arena, seen)


def test_without_a_record_it_is_told_by_the_path() -> None:
    sim = Sim(press(), record=False)
    sim.add(None, load_robot("arsim"))
    sim.run(1000 * MS)
    assert sim.lateness() == [] and happened(sim.robot(0)) is None


def test_a_session_tells_it() -> None:
    sim = Sim(press())
    session = DirectSession(sim.add(None, load_robot("arsim")), SimRobot.wait)
    seen = []
    for step in range(700):
        session.step(*((1.0, 1.0) if step > 300 else (0.0, 0.0)))
        seen.append(poses_in(sim))
    check(happened(session.robot), sim.arena, seen)


def test_record_does_not_depend_on_how_often_it_is_brought_up_to_date() -> None:
    """A person who looks has it done more often. What comes of a run that broke off is drawn, too."""
    records = []
    for often in (True, False):
        sim = Sim(press())
        session, record = DirectSession(sim.add(None, load_robot("arsim")), SimRobot.wait), Record()
        for step in range(700):
            session.step(*((1.0, 1.0) if step > 300 else (0.0, 0.0)))
            if often:
                record.put(session.drain())
        broken_off = lateness(record)
        record.put(session.drain(ended=True))
        records.append(record)
    rows = records[0].rows("waits")
    assert rows == records[1].rows("waits") and 2 < len(rows) < 100
    assert lateness(records[0])[0].waited[-1] > 0.5
    assert broken_off == [] and len(floor_plan(press(), 0.0, 7.0, broken_off).moving) == 1


def test_view_and_recorder_have_the_vehicles_own() -> None:
    """At every step of a vehicle that is pinched, then drives away."""
    radius = 0.07
    model = VehicleModel(ARSIM_BODY | {"radius": radius}, ends_at_collision=False)
    model.dc_motors()
    vehicle = Vehicle(model, press())
    log, view = Recorder(vehicle), View(vehicle)
    with pytest.raises(Exception, match=r"recorder: it has no row"):
        log.floor_plan()
    for step in range(700):
        vehicle.step(*((1.0, 1.0) if step > 300 else (0.0, 0.0)))
        log.append()
        if step % 50 == 0:
            view.update()
            drawn = shapely.Polygon(view._moving[0].get_xy())
            body = shapely.Point(vehicle.true_pose[:2]).buffer(radius, 64)
            assert drawn.intersection(body).area < 1e-8
            (mover,) = vehicle.movers
            where = shape_of(Solid(kind="obstacle", points=np.array(square(0, 0, SIDE))).placed(*pose_of(mover)))
            assert shapely.hausdorff_distance(drawn, where) < 1e-9
    assert vehicle.movers[0].waited > 0.5
    (shape,) = log.floor_plan().moving
    assert abs(deepest(shape, log, radius, OF_LOG)) < 2e-6, "it was touched, never entered"
    path = floor_plan(vehicle.arena, 0.0, vehicle.time).moving[0]
    assert deepest(path, log, radius, OF_LOG) > 0.05
    vehicle.place((0.7, 0.0, 0.0))
    log.append()
    vehicle.step(0.0, 0.0)
    log.append()
    assert log.floor_plan().moving[0].time.tolist() == [0.0, 0.01]


# ---- any path, any waits ---------------------------------------------------------------------------------------------

waypoints = st.lists(
    st.tuples(st.floats(0.05, 3.0), st.floats(-1, 1), st.floats(-1, 1), st.floats(-1.5, 1.5)), min_size=2, max_size=5
)
waits = st.lists(st.tuples(st.floats(0.01, 2.0), st.floats(0.0, 1.0)), max_size=5)  # going on for s, then s of waiting


@given(waypoints, waits, st.sampled_from(["once", "back_and_forth"]), st.floats(0.0, 3.0), st.floats(0.1, 20.0))
def test_poses_are_those_of_the_path_by_its_own_clock(
    way: list[tuple[float, float, float, float]],
    stops: list[tuple[float, float]],
    repeat: str,
    begin: float,
    seconds: float,
) -> None:
    """Numpy interpolates the waypoints, the clock and its fold at the turns."""
    times = np.cumsum([0.0, *(duration for duration, *_ in way[1:])])
    path = [Waypoint(float(t), x, y, turn) for t, (_, x, y, turn) in zip(times, way, strict=True)]
    moving = description.Moving(corners_m=square(0, 0, SIDE), path=path, repeat=repeat)  # type: ignore[arg-type]
    rows = [(0.0, 0.0)]
    for goes, waits in stops:
        time, late = rows[-1]
        rows += [(time + goes, late), (time + goes + waits, late + waits)]
    clock = Lateness(time=np.array([t for t, _ in rows]), waited=np.array([late for _, late in rows]))
    arena = Arena(ArenaDescription(name="any", moving=[moving]))
    (shape,) = floor_plan(arena, begin, begin + seconds, [clock]).moving
    asked = np.linspace(begin, begin + seconds, 101)
    own = asked - np.interp(asked, clock.time, clock.waited)
    phase = own % (2 * times[-1])
    folded = own if repeat == "once" else np.where(phase > times[-1], 2 * times[-1] - phase, phase)
    for found, column in ((shape.x, 1), (shape.y, 2)):
        values = np.interp(folded, times, [point[column] for point in way])
        assert np.allclose(np.interp(asked, shape.time, found), values, atol=1e-8 / times[1:].min())
