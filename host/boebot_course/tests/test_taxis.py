"""Phototaxis from some starts."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from boebot_course.experiments import (
    taxis,
)
from boebot_course.tests.criteria import missed


@pytest.mark.soak
def test_a_robot_that_flees_the_light_fails_e27() -> None:
    fleeing = taxis.trials(replace(taxis.ARSIM, seconds=14.0), 1, flee=True, starts=6)
    times = [taxis.time_to_lamp(trial) for trial in fleeing]
    found = missed(taxis.judge(taxis.ARSIM, times, taxis.ARSIM.straight))
    assert found == ["starts that reach the lamp", "median time against the straight way's"]


def test_six_starts_of_e27_reach_the_lamp() -> None:
    seeking = taxis.trials(replace(taxis.ARSIM, seconds=20.0), 1, starts=6)
    assert all(taxis.time_to_lamp(trial) < math.inf for trial in seeking)
