"""Robots and moving obstacles that meet: momentum, energy, order, pushing."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.tests.world.bodies import BOE_BOT, CHASSIS, RADIUS, Body, World, constant

FREE: dict[str, Any] = {"linear_damping": 0.0, "angular_damping": 0.0}
ICE: dict[str, Any] = {**FREE, "grip": 0.0}

poses = st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(-math.pi, math.pi))
speeds = st.tuples(st.floats(-2, 2), st.floats(-6, 6))
shapes = st.sampled_from([None, CHASSIS, [(-0.08, -0.05), (0.06, -0.05), (0.06, 0.05), (-0.08, 0.05)]])


def overlap(a: Body, b: Body) -> float:
    """How deep two robots are in each other (m)."""
    return a.depth_in(*b.core())


def test_head_on_on_ice_they_share_their_momentum() -> None:
    """A perfectly inelastic collision: both go on with the mean of their speeds."""
    a, b = Body(robot=1, **ICE), Body(robot=2, **ICE, mass=1.2)
    a.place(-0.3, 0, 0, speed=0.5)
    b.place(0.3, 0, math.pi, speed=0.2)
    world = World([a, b])
    for _ in range(1500):
        world.step([(0, 0), (0, 0)], 0.001)
    expected = (0.66 * 0.5 - 1.26 * 0.2) / (0.66 + 1.26)
    assert a.velocity[0] == pytest.approx(expected, abs=1e-9)
    assert b.velocity[0] == pytest.approx(expected, abs=1e-9)
    assert b.state.x - a.state.x == pytest.approx(2 * RADIUS, abs=1e-6)


@given(poses, speeds, poses, speeds, shapes, shapes)
def test_momentum_is_kept_on_ice(
    pose: tuple[float, float, float],
    motion: tuple[float, float],
    other_pose: tuple[float, float, float],
    other_motion: tuple[float, float],
    corners: list[tuple[float, float]] | None,
    other_corners: list[tuple[float, float]] | None,
) -> None:
    """Linear and angular momentum of two robots without grip do not change, whatever they do to each other."""
    a = Body(corners=corners, robot=1, **ICE)
    b = Body(corners=other_corners, robot=2, **ICE, mass=1.1)
    a.place(pose[0] - 0.13, pose[1], pose[2], *motion)
    b.place(other_pose[0] + 0.13, other_pose[1], other_pose[2], *other_motion)
    for robot in (a, b):
        robot.state.slipping = 1
    assume(overlap(a, b) < 1e-6)  # a run refuses robots that begin in each other
    world = World([a, b])
    before = world.momentum()
    for _ in range(40):
        energy = world.energy
        world.step([(0, 0), (0, 0)], 0.006)
        assert world.energy <= energy * (1 + 1e-12) + 1e-15
        assert overlap(a, b) < 1e-6
    after = world.momentum()
    assert after[:2] == pytest.approx(before[:2], abs=1e-11)
    # A push out of each other moves the momentum's arm: by what they moved into each other, and times their speed.
    fastest = abs(motion[0]) + abs(other_motion[0]) + 0.1 * (abs(motion[1]) + abs(other_motion[1]))  # m/s, of corners
    assert after[2] == pytest.approx(before[2], abs=1e-3 * fastest**2 + 1e-11)


@given(st.permutations(range(4)), st.integers(0, 2**16), st.booleans())
def test_order_of_the_robots_changes_no_bit(order: list[int], seed: int, outlines: bool) -> None:
    """Four robots driven into each other in a small room."""

    def run(order: list[int] | None) -> bytes:
        arena = arena_of(outline=square(0, 0, 0.7))
        robots = [Body(arena, corners=CHASSIS if outlines else None, robot=7 * i + 3) for i in range(4)]
        for i, robot in enumerate(robots):
            angle = 0.5 * math.pi * i + 0.001 * (seed % 97)
            robot.place(0.2 * math.cos(angle), 0.2 * math.sin(angle), angle + math.pi + 0.1 * (seed % 7 - 3))
        world = World(robots, arena)
        touched = False
        for step in range(200):
            torques = [(0.05 + 0.01 * ((seed >> i) & 3), 0.05 + 0.01 * ((step // 50 + i) & 3)) for i in range(4)]
            world.step(torques, 0.004, order)
            touched = touched or any(robot.state.touching for robot in robots)
        assert touched
        return world.bits()

    assert run(order) == run(None)


def test_more_robots_in_a_room_neither_sink_nor_gain() -> None:
    arena = arena_of(outline=square(0, 0, 0.8))
    robots = [Body(arena, robot=i + 1, corners=CHASSIS if i % 2 else None) for i in range(9)]
    for i, robot in enumerate(robots):
        robot.place(0.25 * (i % 3 - 1), 0.25 * (i // 3 - 1), 0.7 * i)
    world = World(robots, arena)
    for step in range(2000):
        world.step([(0.06, 0.05 + 0.02 * ((step // 300 + i) % 2)) for i in range(9)], 0.001)
        if step % 100:
            continue
        for a, b in itertools.combinations(robots, 2):
            assert overlap(a, b) < 1e-6
        for robot in robots:
            assert robot.is_free()
            assert robot.depth < 1e-6
    for _ in range(200):
        energy = world.energy
        world.step([(0.0, 0.0)] * 9, 0.001)
        assert world.energy <= energy * (1 + 1e-12) + 1e-15


def test_a_strong_robot_pushes_a_weak_one() -> None:
    """Motors that stand still hold by the tyres; the pushed one slides or rolls, and keeps in touch."""
    a, b = Body(robot=1), Body(robot=2)
    a.place(0, 0, 0)
    b.place(0.15, 0, 0)
    world = World([a, b])
    for _ in range(3000):
        world.step([(1.2 * (0.1 - a.state.rim_left), 1.2 * (0.1 - a.state.rim_right)), (0.0, 0.0)], 0.001)
    assert b.state.x > 0.3
    assert b.state.x - a.state.x == pytest.approx(2 * RADIUS, abs=2e-5)
    assert b.state.speed == pytest.approx(a.state.speed, abs=1e-3)
    assert b.state.wheel_left * BOE_BOT["wheel_radius"] == pytest.approx(b.state.x - 0.15, abs=1e-3)


# ---- moving obstacles ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("corners", [None, CHASSIS])
@pytest.mark.parametrize("speed", [0.05, 0.5, 3.0])
@pytest.mark.parametrize("dt", [0.001, 0.01])
def test_moving_obstacle_pushes_the_robot(corners: list[tuple[float, float]] | None, speed: float, dt: float) -> None:
    """It moves as if nothing were there; the robot goes before it."""
    robot = Body(corners=corners)
    front = 0.05 if corners is not None else RADIUS
    robot.place(0, 0, math.pi)
    world = World([robot])
    mover = world.mover(-0.3, 0, speed, 0.0, corners=square(0, 0, 0.2))
    for _ in range(round(0.5 / speed / dt)):
        world.step([(0, 0)], dt)
        assert mover.x + 0.1 - (robot.state.x - front) < 1e-6
    assert robot.state.x == pytest.approx(-0.3 + 0.5 + 0.1 + front, abs=2 * speed * dt + 1e-6)
    assert robot.velocity[0] == pytest.approx(speed, rel=0.02)


def test_moving_disc_pushes_the_robot_aside() -> None:
    robot = Body(grip=0.1)
    robot.place(0, 0.05, 0)
    world = World([robot])
    mover = world.mover(-0.4, 0, 0.2, 0.0, radius=0.1)
    for _ in range(4000):
        world.step([(0, 0)], 0.001)
        assert math.hypot(robot.state.x - mover.x, robot.state.y - mover.y) > RADIUS + 0.1 - 1e-6
    assert robot.state.y > 0.05


def test_turning_obstacle_turns_the_robot_away() -> None:
    robot = Body(corners=CHASSIS)
    robot.place(0.3, 0.1, 0)
    world = World([robot])
    world.mover(0, 0, corners=[(-0.5, -0.02), (0.5, -0.02), (0.5, 0.02), (-0.5, 0.02)], turn_rate=1.0)
    for _ in range(1500):
        world.step([(0, 0)], 0.001)
    assert robot.state.y > 0.2
    assert abs(robot.state.heading) > 0.2


def test_squeezed_between_obstacle_and_wall_it_stays_finite() -> None:
    arena = arena_of(square(1, 0, 1))
    robot = Body(arena)
    robot.place(0.3, 0, 0)
    world = World([robot], arena)
    world.mover(-0.5, 0, 0.5, 0.0, corners=square(0, 0, 0.4))
    for _ in range(4000):
        world.step([(0.01, 0.02)], 0.001)
    assert all(math.isfinite(value) for value in (*robot.pose, *robot.velocity))
    robot.place(-1.0, 0, 0)
    robot.regulate(constant(-0.1, -0.1), 1.2, 1.0, 0.001)
    assert robot.state.x < -1.05


def test_a_torque_that_is_no_number_moves_nothing() -> None:
    a, b = Body(robot=1), Body(robot=2)
    b.place(1, 0, 0, speed=1.0)
    world = World([a, b])
    before = world.bits()
    for wrong in (math.nan, math.inf, -math.inf):
        world.step([(0, 0), (0, wrong)], 0.01)
        b.advance(wrong, 0.0, 0.01)
    assert world.bits() == before
    World([]).step([], 0.01)


def test_as_a_mover_it_has_its_velocity() -> None:
    robot = Body(corners=CHASSIS, robot=9)
    robot.place(1, 2, 0.5 * math.pi, speed=0.3, turn_rate=0.1)
    mover = ffi.new("mover *")
    lib.body_as_mover(robot.body, mover)
    assert (mover.x, mover.y, mover.turn_rate, mover.id) == (1, 2, 0.1, 9)
    assert (mover.vx, mover.vy) == pytest.approx((0, 0.3), abs=1e-12)
    assert mover.corners == len(CHASSIS)
    assert mover.radius == pytest.approx(max(math.hypot(*corner) for corner in CHASSIS))
