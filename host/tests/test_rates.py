"""Intervals of rates that were counted, and of means."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from boebot import rates


@pytest.mark.parametrize("trials", [1, 7, 100, 5000])
def test_interval_is_wilsons(trials: int) -> None:
    for count in {0, 1, trials // 3, trials // 2, trials - 1, trials}:
        expected = stats.binomtest(count, trials).proportion_ci(0.95, "wilson")
        assert rates.interval(count, trials) == pytest.approx((expected.low, expected.high), abs=1e-6)


def test_none_of_a_hundred_is_not_known_to_be_never() -> None:
    assert rates.in_words(0, 100) == "0 of 100, 0 to 4 %"
    assert rates.in_words(100, 100) == "100 of 100, 96 to 100 %"


@pytest.mark.parametrize(("count", "trials"), [(0, 0), (-1, 5), (6, 5)])
def test_what_is_no_rate_is_refused(count: int, trials: int) -> None:
    with pytest.raises(ValueError, match=rf"^{count} of {trials} is no rate"):
        rates.interval(count, trials)


@pytest.mark.parametrize("count", [20, 5000])
def test_interval_of_a_mean_holds_it_about_as_often_as_it_says(count: int) -> None:
    random = np.random.default_rng(7)
    trials = 200
    held = sum(
        mean.least <= 1.0 <= mean.most
        for mean in (rates.mean_of(random.exponential(size=count)) for _ in range(trials))
    )
    assert 0.85 <= held / trials <= 0.99  # of 20 skewed values bootstrap's is a little too narrow
