"""Potential fields: potentials, minima, and what is refused. Gradients and robots in fields: experiments E47 to E51."""

from __future__ import annotations

import math

import numpy as np
import pytest

import boebot
from boebot.brain import Brain, CognitiveProcess
from boebot.cognition import Odometry
from boebot.errors import BrainError
from boebot.navigation import FollowField, Lattice, LineMap, LockDetector, Potential, PotentialField
from boebot.navigation.potential_field import check_goal, waypoints
from boebot_course.experiments.potential_fields import WEDGE

GOAL = Potential(-1.3, 1.3, -1.0, 3.0, 3.0)


def room(height: float = 0.4, width: float = 0.2) -> list[Potential]:
    """Fig. 6.12: four walls and four pillars."""
    walls = [Potential(0, y, height, 2.2, width) for y in (-1.8, 1.8)]
    walls += [Potential(x, 0, height, width, 2.2) for x in (-1.8, 1.8)]
    return walls + [Potential(x, y, 0.5, 0.3, 0.3) for x in (-0.7, 0.7) for y in (-0.7, 0.7)]


def test_rotated_potential_is_that_of_turned_points() -> None:
    upright, turned = Potential(0, 0, 1.0, 2.0, 0.5), Potential(0, 0, 1.0, 2.0, 0.5, math.pi / 2)
    points = np.random.default_rng(2).uniform(-2, 2, (50, 2))
    field, other = PotentialField.of([turned]), PotentialField.of([upright])
    assert field.value(points) == pytest.approx(other.value(np.column_stack((points[:, 1], -points[:, 0]))))


def test_where_it_is_flat_there_is_no_minimum() -> None:
    assert PotentialField.of([GOAL]).minimum_near(30.0, 30.0) is None


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


def test_corners_of_a_path_are_valleys() -> None:
    assert [(one.x, one.y) for one in waypoints([(0, 0), (1, 0), (1, 1), (2, 1)])] == [(1, 0), (1, 1)]


def test_flat_field_is_said_and_nothing_moves() -> None:
    behavior = FollowField(goal=Potential(0, 0, -1, 1, 1))
    brain = Brain([behavior, Odometry()])
    result = boebot.run(brain, robot="roller", arena="empty", pose=(30.0, 0.0, 0.0), seconds=1)
    assert behavior.lost and result.true_distance == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("is_seen", [True, False])
def test_what_moves_is_gone_around(is_seen: bool) -> None:
    """Something comes along the way to the goal, 0.2 m beside the robot's middle."""
    gaps: list[float] = []

    def moving(robot: boebot.Robot) -> list[Potential]:
        hill = Potential(2.0 - 0.1 * robot.time, 0.2, 0.4, 0.35, 0.35)
        gaps.append(math.dist(behavior.pose[:2], (hill.x, hill.y)))
        return [hill] if is_seen else []

    behavior = FollowField(goal=Potential(2.5, 0, -1, 2.5, 2.5), moving=moving)
    boebot.run(Brain([behavior, Odometry()]), robot="roller", arena="empty", seconds=30)
    assert behavior.arrived and (min(gaps) > 0.3) == is_seen


def test_no_way_around_is_said_and_it_stands_until_there_is_one() -> None:
    """A wall with a door that is closed on the map that the lock detector has, until its author gives it another."""
    opened = LineMap.of("wedge")
    door = [[(1.4, -1.8), (1.4, 1.8)]]
    closed = LineMap.from_lines(np.concatenate((opened.segments, door)))
    start, opens_s = (-1.0, 0.0, 0.0), 30.0
    follow = FollowField(goal=Potential(2.0, 0.0, -1.0, 2.0, 2.0), hills=WEDGE, speed=0.2, turn_speed=0.1)
    detector = LockDetector(field=follow, plan=closed, lattice=Lattice.of(closed, 0.15, 0.2), clearance=0.35)

    class Author(CognitiveProcess):
        def step(self, robot: boebot.Robot) -> None:
            if robot.time > opens_s:
                detector.plan, detector.lattice = opened, Lattice.of(opened, 0.15, 0.2)

    brain = Brain([follow, detector, Author(), Odometry(start=start)])
    result = boebot.run(brain, robot="roller", arena="wedge", pose=start, seconds=70)
    assert result.true_pose is not None
    before = (result.series.time > 20.0) & (result.series.time < opens_s)
    assert set(result.shown.at(result.series.time[before]).texts["follow_field_state"]) == {"no path"}
    assert np.ptp(result.true_pose.x[before]) < 1e-3 and len(detector.locked) == 1
    assert follow.arrived and follow.state == "arrived"
