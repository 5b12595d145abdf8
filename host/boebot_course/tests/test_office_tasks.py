"""Five of the office tasks and five of the paths of docs/reference/navigation-figures.md: all of them are in
test_navigation_figures.py."""

from __future__ import annotations

import numpy as np
import pytest

from boebot.navigation import Lattice, LineMap
from boebot_course.tests.navigation_figures import paths
from boebot_course.tests.navigation_figures.tasks import ARENA, tasks, tried


@pytest.mark.unsanitized
def test_robot_arrives_and_is_not_mistaken() -> None:
    ended = [tried(task) for task in tasks("roller", 5)]
    assert not [one for one in ended if one.is_mistaken]
    assert sum(one.has_arrived for one in ended) >= 4


def test_paths_are_nearly_the_shortest() -> None:
    """Against shapely's and scipy's along the visibility graph."""
    office = LineMap.of(ARENA)
    lattice = Lattice.of(office, paths.RADIUS_M, paths.MARGIN_M, paths.CELL_M)
    planned, shortest = np.array(paths.ways(office, lattice, np.random.default_rng(20), 5)).T
    assert np.median(planned / shortest) <= 1.05 and (planned >= shortest - 1e-3).all()
