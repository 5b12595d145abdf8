"""The chequered floor."""

from __future__ import annotations

import numpy as np
import pytest

from boebot_course.experiments import (
    kinesis,
)


def test_half_of_the_floor_is_humid() -> None:
    places = np.random.default_rng(1).uniform(-40, 40, (2, 20_000))
    assert kinesis.humid_share(*places) == pytest.approx(0.5, abs=0.02)
    assert kinesis.humid_share(*places[:, :1]) == kinesis.humidity(*places[:, 0])
