"""The error of a home vector, and the circle of a compass."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot_course.experiments import (
    homing,
)


def test_a_home_vector_that_points_elsewhere_has_that_error() -> None:
    x, y = np.array([0.0, 3.0, 0.05]), np.array([0.0, 4.0, 0.0])
    vector = np.array([[0.0, 0.0], [-3.0, -4.0], [-0.05, 0.6]])
    one = homing.Journey(x, y, vector, 1, 2)
    assert one.error == pytest.approx(0.6) and one.distance == pytest.approx(0.05)
    lost = homing.Journey(x, y, vector, 1, None)
    assert lost.error == lost.distance == lost.nearest == math.inf


def test_the_compass_circle_has_its_middle() -> None:
    angles = np.linspace(0, 4.0, 30)  # not even a whole turn
    circle = np.column_stack((7 + 20 * np.cos(angles), -3 + 20 * np.sin(angles)))
    assert homing.middle(circle) == pytest.approx((7.0, -3.0))
