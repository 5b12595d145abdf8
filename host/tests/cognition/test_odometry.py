"""Dead reckoning: the midpoint rule against known figures, and the sign rule of single-channel encoders."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.odometry import DEAD_BAND, HOLD_S, Odometry, WheelDirection, dead_reckoning

TRACK_M = 0.105


def reckon(step_s: float, seconds: float = 20.0) -> tuple[float, float]:
    """A test with changing wheel speeds: 0.1 + 0.05 sin t and 0.1 + 0.05 cos 0.7 t."""
    estimate = Odometry(TRACK_M)
    times = np.arange(0, seconds, step_s)
    left = (0.1 * step_s) + 0.05 * (np.cos(times) - np.cos(times + step_s))
    right = (0.1 * step_s) + 0.05 / 0.7 * (np.sin(0.7 * (times + step_s)) - np.sin(0.7 * times))
    for left_m, right_m in zip(left, right, strict=True):
        estimate.update(float(left_m), float(right_m))
    return estimate.x, estimate.y


def test_midpoint_rule_is_as_exact_as_theory_says() -> None:
    exact = reckon(0.0005)
    assert math.dist(reckon(0.1), exact) < 0.0007
    assert math.dist(reckon(0.01), exact) < 0.00002


def test_full_turn_on_the_spot_and_circle() -> None:
    estimate = Odometry(TRACK_M, x=1.0, y=2.0, heading=3.0)
    for _ in range(100):
        estimate.update(-math.pi * TRACK_M / 100, math.pi * TRACK_M / 100)
    assert (estimate.x, estimate.y) == (1.0, 2.0)
    assert estimate.heading == pytest.approx(3.0)
    for _ in range(1000):
        estimate.update(2 * math.pi * (0.5 - TRACK_M / 2) / 1000, 2 * math.pi * (0.5 + TRACK_M / 2) / 1000)
    assert math.dist((estimate.x, estimate.y), (1.0, 2.0)) < 1e-9
    assert -math.pi < estimate.heading <= math.pi


def test_sign_follows_the_command_after_the_hold_time() -> None:
    wheel = WheelDirection()
    assert [wheel.update(0.5, 0.01) for _ in range(5)] == [1] * 5
    signs = [wheel.update(-0.5, 0.01) for _ in range(10)]
    assert signs == [1] * (round(HOLD_S / 0.01) - 1) + [-1] * (11 - round(HOLD_S / 0.01))


def test_stop_and_dead_band_keep_the_sign() -> None:
    wheel = WheelDirection()
    for signal in (0.0, -DEAD_BAND / 2):
        assert {wheel.update(signal, 0.01) for _ in range(50)} == {1}
    for _ in range(3):  # reversals that are undone in time
        assert {wheel.update(-0.5, 0.01) for _ in range(4)} == {1}
        assert wheel.update(0.5, 0.01) == 1


def test_many_updates_at_once_are_those_one_by_one() -> None:
    chance = np.random.default_rng(1)
    left, right = chance.normal(0.0, 0.002, (2, 500))
    estimate = Odometry(TRACK_M)
    one_by_one = []
    for left_m, right_m in zip(left, right, strict=True):
        estimate.update(float(left_m), float(right_m))
        one_by_one.append((estimate.x, estimate.y, estimate.heading))
    assert np.column_stack(dead_reckoning(left, right, TRACK_M)) == pytest.approx(np.array(one_by_one), abs=1e-9)


@pytest.mark.parametrize("low", [-1.0, -0.04, 0.0])
def test_signs_of_many_ticks_are_those_one_by_one(low: float) -> None:
    signals = np.repeat(np.random.default_rng(2).uniform(low, 1.0, 60), 8)
    steps = np.full(len(signals), 0.01)
    one, other = WheelDirection(), WheelDirection()
    signs = [one.update(float(signal), 0.01) for signal in signals]
    parts = [other.update_all(signals[at : at + 100], steps[at : at + 100]) for at in range(0, len(signals), 100)]
    assert np.concatenate(parts).tolist() == signs
