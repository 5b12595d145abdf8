"""Some of the office tasks of docs/reference/navigation-figures.md: all of them are in test_navigation_figures.py."""

from __future__ import annotations

import pytest

from tools.navigation_figures.tasks import tasks, tried


@pytest.mark.unsanitized
@pytest.mark.parametrize(("robot", "on"), [("roller", None), ("shieldbot-turret", "native")])
def test_robot_arrives_and_is_not_mistaken(robot: str, on: str | None) -> None:
    ended = [tried(task) for task in tasks(robot, 10, on)]
    assert not [one for one in ended if one.is_mistaken]
    assert sum(one.has_arrived for one in ended) >= 9
