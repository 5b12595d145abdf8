"""Potential fields: gradients against differences, the fields of Figs. 6.12 and 6.13, and the behavior in them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import boebot
from boebot.brain import Brain
from boebot.cognition import Odometry
from boebot.errors import BrainError
from boebot.experiments.variants import varied
from boebot.navigation import FollowField, Lattice, LineMap, LockDetector, Potential, PotentialField
from boebot.navigation.potential_field import check_goal, of_walls, waypoints

GOAL = Potential(-1.3, 1.3, -1.0, 3.0, 3.0)


def room(height: float = 0.4, width: float = 0.2) -> list[Potential]:
    """Fig. 6.12: four walls and four pillars."""
    walls = [Potential(0, y, height, 2.2, width) for y in (-1.8, 1.8)]
    walls += [Potential(x, 0, height, width, 2.2) for x in (-1.8, 1.8)]
    return walls + [Potential(x, y, 0.5, 0.3, 0.3) for x in (-0.7, 0.7) for y in (-0.7, 0.7)]


WEDGE = [Potential(1.0, 0.0, 0.45, 0.25, 0.25)] + [Potential(0.8, y, 0.45, 0.3, 0.2) for y in (-0.35, 0.35)]
"""Fig. 6.13, with a goal at (2, 0)"""
BEHIND = Potential(2.0, 0.0, -1.0, 2.0, 2.0)


def test_gradient_agrees_with_differences_also_of_rotated_potentials() -> None:
    random = np.random.default_rng(1)
    terms = random.uniform((-2, -2, -1, 0.3, 0.3, -math.pi), (2, 2, 1, 2, 2, math.pi), (7, 6))
    field = PotentialField.of(Potential(*row) for row in terms)
    points, h = random.uniform(-3, 3, (1000, 2)), 1e-6
    steps = [(field.value(points + d) - field.value(points - d)) / (2 * h) for d in ((h, 0), (0, h))]
    assert np.abs(field.gradient(points) - np.stack(steps, axis=-1)).max() < 1e-8


def test_rotated_potential_is_that_of_turned_points() -> None:
    upright, turned = Potential(0, 0, 1.0, 2.0, 0.5), Potential(0, 0, 1.0, 2.0, 0.5, math.pi / 2)
    points = np.random.default_rng(2).uniform(-2, 2, (50, 2))
    field, other = PotentialField.of([turned]), PotentialField.of([upright])
    assert field.value(points) == pytest.approx(other.value(np.column_stack((points[:, 1], -points[:, 0]))))


def test_minimum_of_the_wedge_is_a_trap() -> None:
    """On the axis the slopes of goal and hills cancel at x = 0.567, and the second derivatives are positive."""
    field = PotentialField.of([BEHIND, *WEDGE])
    found = field.minimum_near(0.5, 0.05)
    assert found is not None and found == pytest.approx((0.5668, 0.0), abs=2e-4)
    assert field.value(found) == pytest.approx(-0.553, abs=1e-3)
    angles = np.linspace(0, 6, 20)
    around = np.array(found) + 0.05 * np.column_stack((np.cos(angles), np.sin(angles)))
    assert field.value(around).min() > field.value(found)
    assert field.minimum_near(30.0, 30.0) is None, "it is flat there"


def test_goal_that_hills_push_away_is_refused() -> None:
    check_goal(PotentialField.of([GOAL, *room()]), (GOAL.x, GOAL.y), 0.1)
    with pytest.raises(BrainError, match=r"minimum is at \(-1.221, 1.221\), 0.111 m off; expected 0.05 m at most"):
        check_goal(PotentialField.of([GOAL, *room(0.5, 0.25)]), (GOAL.x, GOAL.y), 0.1)
    with pytest.raises(BrainError, match="minimum is at"):
        FollowField(goal=GOAL, hills=room(0.5, 0.25))
    with pytest.raises(BrainError, match="expected a valley, below 0"):
        FollowField(goal=Potential(0, 0, 1, 1, 1))
    with pytest.raises(BrainError, match="beta and gamma above 0"):
        Potential(0, 0, 1, 0, 1)


def test_walls_of_a_map_are_hills() -> None:
    plan = LineMap.from_lines([[(0, 0), (2, 2)]])
    (hill,) = of_walls(plan, 0.15)
    assert (hill.x, hill.y, hill.alpha) == (1.0, 1.0, 0.4)
    assert hill.heading == pytest.approx(math.pi / 4)
    assert (hill.beta, hill.gamma) == pytest.approx((1.2 * math.sqrt(2), 0.35))
    assert [(one.x, one.y) for one in waypoints([(0, 0), (1, 0), (1, 1), (2, 1)])] == [(1, 0), (1, 1)]


def drive(behavior: FollowField, start: tuple[float, float], seconds: float, *others: LockDetector) -> boebot.RunResult:
    """With an odometer that does not drift."""
    robot, pose = varied("roller", "exact", odometer={"sigma_step_m": 0.0}), (start[0], start[1], 0.0)
    return boebot.run(Brain([behavior, Odometry(), *others]), robot=robot, arena="empty", pose=pose, seconds=seconds)


@pytest.mark.parametrize("start", [(1.3, -1.3), (1.3, 1.3), (-1.3, -1.3), (0.0, -1.2)])
def test_robot_comes_to_the_goal_past_the_pillars(start: tuple[float, float]) -> None:
    behavior = FollowField(goal=GOAL, hills=room(), speed=0.2, turn_speed=0.1)
    result = drive(behavior, start, 40)
    assert behavior.arrived and result.true_pose is not None
    x, y = result.true_pose.x, result.true_pose.y
    assert math.dist((x[-1], y[-1]), (GOAL.x, GOAL.y)) < 0.12, "within 0.1 m by its odometry"
    assert min(np.hypot(x - px, y - py).min() for px in (-0.7, 0.7) for py in (-0.7, 0.7)) > 0.15 + 0.05


def test_robot_is_locked_in_the_wedge_and_a_way_around_frees_it() -> None:
    behavior = FollowField(goal=BEHIND, hills=WEDGE, speed=0.2, turn_speed=0.1)
    result = drive(behavior, (-1.0, 0.0), 60)
    assert result.true_pose is not None and not behavior.arrived
    assert result.true_pose.at(-1)[:2] == pytest.approx((0.567, 0.0), abs=0.03)
    plan = LineMap.from_lines(np.array([[(0.9, -0.5), (0.9, 0.5)], [(-2, -2), (-2, 2)], [(3, -2), (3, 2)]]))
    lattice = Lattice.of(plan, 0.15, 0.2, 0.1)
    detector = LockDetector(field=behavior, plan=plan, lattice=lattice, clearance=0.35)
    result = drive(behavior, (-1.0, 0.0), 60, detector)
    assert detector.locked and behavior.arrived


def test_flat_field_is_said_and_nothing_moves() -> None:
    behavior = FollowField(goal=Potential(0, 0, -1, 1, 1))
    result = drive(behavior, (30.0, 0.0), 1)
    assert behavior.lost and result.true_distance == pytest.approx(0.0, abs=1e-6)
