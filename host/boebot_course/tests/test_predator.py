"""Density of prey around a predator."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot_course.experiments import (
    predator,
)
from boebot_course.experiments.chemotaxis import Swarm


def test_prey_that_stays_with_the_predator_is_dense_and_left_behind_it_is_not() -> None:
    times = np.arange(201.0)
    with_it = np.repeat(predator.predators(times)[:, None], 10, axis=1)
    left = np.zeros_like(with_it)
    assert predator.density_ratio(Swarm(with_it, 1.0)) == pytest.approx(100 / (math.pi * 0.25))
    assert predator.density_ratio(Swarm(left, 1.0)) == 0, "0.75 m away at least"
