"""Figures of a report, against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from boebot_campaign.report import cliffs_delta, mean_of


def test_cliffs_delta_is_counted_over_all_pairs() -> None:
    one, other = np.array([1.0, 2.0, 2.0, 5.0]), np.array([2.0, 3.0, 0.0])
    pairs = [np.sign(a - b) for a in one for b in other]
    assert cliffs_delta(one, other) == pytest.approx(sum(pairs) / len(pairs))
    assert cliffs_delta(other + 10, one) == 1.0


@pytest.mark.parametrize("count", [20, 5000])
def test_interval_of_a_mean_holds_it_about_as_often_as_it_says(count: int) -> None:
    random = np.random.default_rng(7)
    trials = 200
    held = sum(
        mean.least <= 1.0 <= mean.most for mean in (mean_of(random.exponential(size=count)) for _ in range(trials))
    )
    assert 0.85 <= held / trials <= 0.99  # of 20 skewed values bootstrap's is a little too narrow
