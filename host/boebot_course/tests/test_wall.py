"""Robots that do not follow walls."""

from __future__ import annotations

import pytest

from boebot.behaviors import FollowWall
from boebot.brain import Brain
from boebot_course.experiments import (
    all_experiments,
    wall,
)


@pytest.mark.soak
@pytest.mark.parametrize(
    "brain", [FollowWall(side="left"), FollowWall(signal=0.7, gain=0.0), FollowWall(reference=0.9)]
)
def test_robots_that_do_not_follow_walls_fail(brain: FollowWall, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wall, "follower", lambda: Brain([brain]))
    assert not all_experiments()["E35"].run(1).is_met
