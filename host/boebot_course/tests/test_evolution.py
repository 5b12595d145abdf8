"""The toy of utility functions found by evolution."""

from __future__ import annotations

import numpy as np
import pytest

from boebot_course.experiments import (
    evolution,
)


def test_toy_has_the_utility_of_the_notes() -> None:
    """(8.4) by the trapezoid rule, on what the robot saw, while the energy falls and rises."""
    genes = evolution.BY_HAND
    lives = evolution.live(np.array([genes]), traced=True, seconds=60)
    energy = np.concatenate(([1.0], lives.trace["energy"][:-1, 0]))
    on = np.concatenate(([0.0], lives.trace["place"][:-1, 0] <= 1e-9))
    settled, tau = np.tanh(genes.b + genes.w_energy * energy + genes.w_on * on), float(np.exp(genes.log_tau))
    fine, u, expected = 100, settled[0], []
    for level in settled:
        for _ in range(fine):
            rate = evolution.STEP / fine / tau
            u += rate * (level - u) / (1 + rate / 2)
        expected.append(u)
    assert lives.trace["utility"][:, 0] == pytest.approx(np.array(expected), abs=1e-6)
    assert lives.switches[0] == 2, "to the charger and back"


def test_evolution_repeats_itself_and_keeps_its_best() -> None:
    first, again, other = (evolution.evolve(seed, generations=3, seconds=60) for seed in (1, 1, 2))
    assert np.array_equal(first.best, again.best) and np.array_equal(first.genes, again.genes)
    assert not np.array_equal(first.genes, other.genes)
    assert (np.diff(first.best, axis=0) >= -1e-9).all()


def test_offspring_are_rather_those_of_the_better() -> None:
    genes = np.repeat(np.arange(30.0)[:, None], 4, axis=1)
    children = evolution.offspring(genes, np.arange(30.0), np.random.default_rng(1))
    assert (children[0, :3] == 29).all(), "the best as it is"
    # of two drawn, the better with 0.75: mean rank (0.75 · 2/3 + 0.25 · 1/3) · 29 = 16.9; its error is 8 / sqrt(30)
    assert 16.9 - 4.5 < children[1:, :3].mean() < 16.9 + 4.5
