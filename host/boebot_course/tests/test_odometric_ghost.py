"""The odometric ghost: its closed form, and wheel factors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.cognition import Odometry
from boebot.errors import BrainError
from boebot_course.experiments import (
    odometric_ghost,
    straight_line,
)
from boebot_course.tests.criteria import missed


@pytest.mark.soak
def test_an_odometer_without_error_has_no_ghost() -> None:
    trial = straight_line.drive(straight_line.runner(period=0.01), "arsim", 6.0, 1)
    assert "error of the estimate at the end" in missed(odometric_ghost.judge_notes(trial))


def test_the_closed_form_of_the_ghost_agrees_with_its_integral() -> None:
    """(2.7) to (2.9) summed by the midpoint rule along a straight line."""
    step, travelled = 1e-5, np.arange(0, 1, 1e-5) + 0.5e-5
    heading = (1 - 1.02) / 0.4 * travelled
    x, y = np.cumsum(1.01 * step * np.cos(heading)), np.cumsum(1.01 * step * np.sin(heading))
    last = int(np.argmax(np.hypot(x, y) >= 0.98))
    error = math.hypot(x[last] - travelled[last], y[last])
    assert odometric_ghost.arc_error(0.98, 0.4) == pytest.approx(error, abs=2e-5)


@pytest.mark.parametrize("factors", [(1.0,), (1.0, 0.0), (1.0, math.nan), (-1.0, 1.0)])
def test_wheel_factors_that_are_none_are_refused(factors: tuple[float, ...]) -> None:
    with pytest.raises(BrainError, match=r"factors are .* expected two numbers above 0"):
        Odometry(factors=factors)  # type: ignore[arg-type]
