"""Robots between something that moves and something that does not: walls hold, movers wait; shapely measures.

After each step the distance of every body's core (outline.h) from edges, discs, movers and other bodies is measured,
and the way of its middle since the step before may cross no edge.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from boebot.arenas import Arena, ArenaDescription, Moving, Waypoint, load_arena
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.tests.world.bodies import ARSIM, CHASSIS, RADIUS, Body, Points, World
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel

DEPTH = 1e-6  # m that a body may be in something
BOX = [(-0.08, -0.05), (0.06, -0.05), (0.06, 0.05), (-0.08, 0.05)]
TRIANGLE = [(-0.06, -0.07), (0.09, 0.0), (-0.06, 0.07)]
BODIES: list[Points | None] = [None, BOX, CHASSIS]


class Watch:
    """Looks after every step whether robots, walls and movers are where they may be."""

    def __init__(self, world: World, discs: Sequence[tuple[float, float, float]] = ()) -> None:
        self.world, self.discs = world, discs
        self.edges = shapely.union_all([shapely.LinearRing(ring) for ring in world.arena.outlines])
        self.movers = [world.scene.movers[i] for i in range(world.scene.movers_count)]
        self.middles = [robot.pose[:2] for robot in world.robots]

    def look(self) -> None:
        bodies = [robot.core() for robot in self.world.robots]
        for (core, rounding), robot, before in zip(bodies, self.world.robots, self.middles, strict=True):
            assert self.edges.is_empty or rounding - shapely.distance(core, self.edges) < DEPTH
            assert not shapely.LineString([before, robot.pose[:2]]).crosses(self.edges)
            for x, y, radius in self.discs:
                assert rounding + radius - shapely.distance(core, shapely.Point(x, y)) < DEPTH
            for shape, its in map(shape_of, self.movers):
                assert rounding + its - shapely.distance(core, shape) < DEPTH
        for (core, rounding), (other, its) in itertools.combinations(bodies, 2):
            assert rounding + its - shapely.distance(core, other) < DEPTH
        self.middles = [robot.pose[:2] for robot in self.world.robots]


def shape_of(mover: Any) -> tuple[Any, float]:
    """A mover as it stands: its polygon or middle, and the rounding around it."""
    if mover.outline == ffi.NULL:
        return shapely.Point(mover.x, mover.y), mover.radius
    xy = np.array([(mover.outline[2 * i], mover.outline[2 * i + 1]) for i in range(mover.corners)])
    turn = np.array([[mover.cosine, mover.sine], [-mover.sine, mover.cosine]])
    return shapely.Polygon(xy @ turn + (mover.x, mover.y)), 0.0


def step(world: World, dt: float, torques: Sequence[tuple[float, float]] | None = None, **more: Any) -> None:
    world.step([(0.0, 0.0)] * len(world.robots) if torques is None else torques, dt, **more)


# ---- one mover, one wall ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [0.001, 0.01])
@pytest.mark.parametrize("speed", [0.05, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("corners", BODIES)
def test_a_mover_does_not_push_a_robot_through_a_wall(corners: Points | None, speed: float, dt: float) -> None:
    """A wall of no thickness. The mover pushes the robot up to it, then waits; the robot is at rest, its wheels too."""
    arena = arena_of([(1.0, -3.0), (1.0, 3.0), (1.000001, 3.0), (1.000001, -3.0)])
    robot = Body(arena, corners=corners)
    robot.place(0.9, 0, 0.3)
    world = World([robot], arena)
    mover = world.mover(0.68, 0, speed, 0.0, corners=square(0, 0, 0.2))
    watch = Watch(world)
    for _ in range(round(0.12 / speed / dt) + 1):
        step(world, dt)
        watch.look()
    for _ in range(100):
        if robot.energy < 1e-12:
            break
        energy = robot.energy
        step(world, dt)
        watch.look()
        assert robot.energy <= energy or mover.stops > 0, "a mover that waits gives no energy"
    stuck, wheels, waited = robot.pose, (robot.state.wheel_left, robot.state.wheel_right), mover.waited
    assert robot.energy < 1e-12
    assert 0.8 < mover.x + 0.1 < 0.95
    for _ in range(20):
        step(world, dt)
    assert robot.pose == pytest.approx(stuck, abs=1e-6)
    assert (robot.state.wheel_left, robot.state.wheel_right) == pytest.approx(wheels, abs=1e-4)
    assert mover.waits
    assert mover.waited - waited == pytest.approx(20 * dt, abs=0.1 * dt)


@pytest.mark.parametrize("speed", [0.5, 3.0])
@pytest.mark.parametrize("corners", [None, CHASSIS])
def test_a_row_of_robots_in_a_corridor(corners: Points | None, speed: float) -> None:
    """Mover, three robots, the corridor's end: they are pushed together, and in whatever order they are given."""
    arena = arena_of(outline=[(-2.0, -0.08), (0.5, -0.08), (0.5, 0.08), (-2.0, 0.08)])

    def run(order: Sequence[int]) -> tuple[bytes, float]:
        robots = [Body(arena, corners=corners, robot=5 - i) for i in range(3)]
        for i, robot in enumerate(robots):
            robot.place(0.3 - 0.25 * i, 0.002 * i, 0.05 * i)
        world = World(robots, arena)
        mover = world.mover(-0.4, 0.0, speed, 0.0, corners=square(0, 0, 0.1))
        watch = Watch(world)
        for _ in range(round(0.9 / speed / 0.005)):
            step(world, 0.005, order=order)
            watch.look()
        assert mover.waits
        assert max(robot.energy for robot in robots) < 1e-6
        return world.bits(), mover.waited

    assert run((0, 1, 2)) == run((2, 0, 1))


def test_it_goes_on_when_the_robot_gives_way() -> None:
    """The clock of its path stands still meanwhile: from then on it is late by as much."""
    arena = arena_of(square(0.6, 0.0, 0.4))
    robot = Body(arena)
    robot.place(0.2, 0.0, 0.5 * math.pi)
    world = World([robot], arena)
    mover = world.mover(-0.2, 0.0, 0.2, 0.0, corners=square(0, 0, 0.1))
    watch = Watch(world)
    for _ in range(300):
        step(world, 0.01)
        watch.look()
    assert mover.waited == pytest.approx(3.0 - (0.4 - 2 * RADIUS + 0.2 - 0.05) / 0.2, abs=0.011)
    for _ in range(200):
        step(world, 0.01, [(0.05, 0.05)])  # it drives out sideways
        watch.look()
    assert robot.state.y > 0.3
    late = mover.waited
    for _ in range(50):
        step(world, 0.01)
    assert mover.waited == late
    assert mover.x == pytest.approx(-0.2 + 0.2 * (5.5 - late), abs=1e-9)


def test_two_movers_that_close_on_a_robot_both_wait() -> None:
    robot = Body(corners=BOX)
    world = World([robot])
    left = world.mover(-0.3, 0.0, 0.5, 0.0, corners=square(0, 0, 0.2))
    right = world.mover(0.4, 0.0, -1.5, 0.0, corners=square(0, 0, 0.2))
    watch = Watch(world)
    for _ in range(100):
        step(world, 0.01)
        watch.look()
    assert left.waits and right.waits
    assert right.x - left.x == pytest.approx(0.2 + 0.14, abs=1e-5)


def test_another_mover_goes_on_while_one_waits() -> None:
    """Robots that touch the same mover share its fate; one that pushes a robot which can go is not stopped."""
    arena = arena_of(square(1.0, 0.0, 1.0))
    pinched, free = Body(arena, robot=1), Body(arena, robot=2)
    pinched.place(0.4, 0.0, 0.0)
    free.place(0.3, 0.3, 0.5 * math.pi)
    world = World([pinched, free], arena)
    waits = world.mover(0.0, 0.0, 0.4, 0.0, corners=square(0, 0, 0.2))
    goes = world.mover(0.3, 0.12, 0.0, 0.3, radius=0.05)
    watch = Watch(world)
    for _ in range(300):
        step(world, 0.005)
        watch.look()
    assert waits.waited > 0.5
    assert goes.waited == 0.0
    assert free.state.y > 0.6


# ---- anything at all -------------------------------------------------------------------------------------------------

starts = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-math.pi, math.pi))
wheels = st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))
movers = st.tuples(
    st.floats(-math.pi, math.pi),  # from where
    st.floats(-0.4, 0.4),  # past the middle
    st.floats(math.log(0.05), math.log(3.0)).map(math.exp),
    st.sampled_from([0.0, 0.0, -3.0, 8.0]),
    st.sampled_from([None, square(0, 0, 0.2), [(-0.3, -0.02), (0.3, -0.02), (0.3, 0.02), (-0.3, 0.02)]]),
)
DISC = (0.3, -0.25, 0.08)


@settings(max_examples=40)
@given(
    st.lists(st.tuples(starts, wheels, st.sampled_from([*BODIES, TRIANGLE])), min_size=1, max_size=4),
    st.lists(movers, max_size=2),
    st.sampled_from([0.001, 0.01]),
    st.sampled_from([0, 1]),
    st.floats(0.4, 1.2),
)
def test_nothing_gets_into_anything(
    robots: list[tuple[Any, tuple[float, float], Points | None]],
    things: list[tuple[float, float, float, float, Points | None]],
    dt: float,
    slip: int,
    width: float,
) -> None:
    """Robots that drive, in a room with corners, a block and a pillar, and what moves through all of it."""
    room = [(-0.6, -width / 2), (0.6, -width / 2), (0.6, width / 2), (-0.6, width / 2)]
    arena = arena_of(square(-0.3, 0.25, 0.1), outline=room)
    assert lib.arena_add_disc(arena.handle, *DISC, ffi.NULL) >= 0
    lib.arena_build(arena.handle)
    world = World(
        [Body(arena, corners=corners, robot=i + 1, slip=slip) for i, (_, _, corners) in enumerate(robots)], arena
    )
    for (angle, aside, speed, turn_rate, corners), ahead in zip(things, (0.5, 0.7), strict=False):
        c, s = math.cos(angle), math.sin(angle)
        shape = {"radius": 0.1} if corners is None else {"corners": corners}
        at = -ahead - 0.4
        world.mover(at * c - aside * s, at * s + aside * c, speed * c, speed * s, turn_rate=turn_rate, **shape)
    for robot, ((x, y, heading), _, _) in zip(world.robots, robots, strict=True):
        robot.place(x, y, heading)
    assume(apart(world))
    watch = Watch(world, [DISC])
    torques = [torque for _, torque, _ in robots]
    seconds = min(1.6 / max([0.5, *(speed for _, _, speed, _, _ in things)]), 60 * dt + 0.1)
    for _ in range(round(seconds / dt)):
        step(world, dt, torques)
        watch.look()


def apart(world: World) -> bool:
    """Whether a test may start so: no body reaches into anything."""
    try:
        Watch(world, [DISC]).look()
    except AssertionError:
        return False
    return True


# ---- worlds with paths -----------------------------------------------------------------------------------------------


def shuttle(speed: float) -> Arena:
    """A block that goes to and fro between x = -1 and x = 0.5 before a wall at x = 1; the turn falls within a step."""
    way = [Waypoint(time_s=0, x_m=-1, y_m=0), Waypoint(time_s=1.5 / speed + 0.0007, x_m=0.5, y_m=0)]
    block = Moving(path=way, corners_m=square(0, 0, 0.4), repeat="back_and_forth")
    walls = arena_of(square(2.0, 0.0, 2.0)).description.obstacle
    return Arena(ArenaDescription(name="shuttle", obstacle=walls, moving=[block]))


def reach_of(vehicle: Vehicle, speed: float, late: float) -> float:
    """Distance of the robot's circle from the block, which is where a triangle wave of its clock says."""
    period = 1.5 / speed + 0.0007
    phase = ((vehicle.time - late) / period) % 2
    x = -1 + 1.5 * (phase if phase <= 1 else 2 - phase)
    return (
        float(shapely.distance(shapely.box(x - 0.2, -0.2, x + 0.2, 0.2), shapely.Point(vehicle.true_pose[:2]))) - RADIUS
    )


@pytest.mark.parametrize("speed", [0.5, 3.0])
def test_a_path_that_turns_within_a_step_enters_nobody(speed: float) -> None:
    """Velocities are those over the step: the block stands where its path says, and is nowhere in the robot."""
    model = VehicleModel(ARSIM_BODY | {"radius": RADIUS}, ends_at_collision=False)
    model.dc_motors()
    for start in (0.72, 0.78, 0.85):
        vehicle = Vehicle(model, shuttle(speed), pose=(start, 0.01, 0.5 * math.pi))
        for _ in range(round(4.5 / speed / model.dt)):
            vehicle.step(0.0, 0.0)
            assert reach_of(vehicle, speed, 0.0) > -DEPTH
            assert vehicle.true_pose[0] < 1.0 - RADIUS + DEPTH


def test_a_world_waits_for_a_robot_that_it_pinches() -> None:
    """The block would go to within 0.05 m of the wall: it waits for the robot, and then goes to its path's end."""
    description = shuttle(0.5).description
    way = [Waypoint(time_s=0, x_m=-0.5, y_m=0), Waypoint(time_s=2.5, x_m=0.75, y_m=0)]
    block = Moving(path=way, corners_m=square(0, 0, 0.4), repeat="once")
    arena = Arena(ArenaDescription(name="press", obstacle=description.obstacle, moving=[block]))
    model = VehicleModel(ARSIM_BODY | {"radius": RADIUS}, ends_at_collision=False)
    model.dc_motors()
    vehicle = Vehicle(model, arena, pose=(0.6, 0.0, 0.5 * math.pi))
    for _ in range(400):
        vehicle.step(0.0, 0.0)
    assert vehicle.true_pose[0] == pytest.approx(1.0 - RADIUS, abs=1e-6)
    assert vehicle.movers[0].waited > 0.5
    for _ in range(200):
        vehicle.step(0.3, 0.3)  # out sideways
    assert vehicle.true_pose[1] > 0.3
    assert vehicle.movers[0].x == pytest.approx(0.75)


def test_where_a_body_looked_last_changes_no_bit() -> None:
    """One of two forgets which edges are near; both go on alike bit for bit, at walls and at full speed."""
    for seed in range(40):
        torques = np.random.default_rng(seed).uniform(-0.6, 1.0, (16, 2))
        here, there = (Body(load_arena("arsim"), ARSIM) for _ in range(2))
        for body in (here, there):
            body.place(0.0, 0.0, 0.1 * seed)
        for left, right in torques:
            for body in (here, there):
                body.advance(left, right, 0.01, steps=50)
            saved = ffi.new("body_state *", there.state)
            there.place(*there.pose)
            there.body.state = saved[0]
            assert bytes(ffi.buffer(ffi.addressof(here.body, "state"))) == bytes(
                ffi.buffer(ffi.addressof(there.body, "state"))
            )


def test_the_charger_ends_at_its_rim() -> None:
    """One answer for worlds with and without boards."""
    arena = arena_of()
    assert not lib.arena_is_at_charger(arena.handle, 0.0, 0.0)
    lib.arena_set_charger(arena.handle, 1.0, 0.0, 0.25)
    for x, expected in ((1.0, 1), (1.25, 1), (1.2501, 0), (0.75, 1), (0.7499, 0)):
        assert lib.arena_is_at_charger(arena.handle, x, 0.0) == expected
