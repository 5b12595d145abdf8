"""Homing by a snapshot of the laser."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.navigation import Scan
from boebot_course.experiments import snapshot


def test_neighbouring_points_are_joined_but_not_across_a_gap_or_where_nothing_was_seen() -> None:
    distances = np.array([1.0, 1.0, 3.0, 3.0, -1.0, 1.0, 1.0, 1.0])
    seen = Scan(distances, (-math.pi, 3 * math.pi / 4), 4.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(snapshot, "GAP", 2.5)  # neighbours at 3 m are 2.3 m apart
        found = snapshot.lines_of(seen).segments
    lengths = sorted(float(np.hypot(*(end - begin))) for begin, end in found)
    chord = 2 * math.sin(math.pi / 8)
    across = math.sqrt(1 + 9 - 6 * math.cos(math.pi / 4))  # from 1 m to 3 m
    assert lengths == pytest.approx(sorted([chord] * 4 + [across, 3 * chord]))


def test_the_robot_comes_home() -> None:
    home, start = snapshot.home_and_start(5)
    assert math.hypot(start[0] - home[0], start[1] - home[1]) == pytest.approx(snapshot.AWAY)
    trial, distance = snapshot.way_home(home, start, 5)
    assert distance[0] == pytest.approx(snapshot.AWAY) and distance[-1] <= snapshot.NEAR_HOME
    assert not trial.has_collided
