"""Intervals of rates that were counted, and of means."""

from __future__ import annotations

from collections.abc import Callable

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


def test_students_table_is_scipys() -> None:
    freedom = np.arange(1, rates.BY_BOOTSTRAP.start - 1)
    assert np.abs(rates.T_95 - stats.t.ppf(0.975, freedom)).max() < 0.005


@pytest.mark.parametrize(
    ("count", "draw", "truth", "least"),
    [
        *((count, np.random.Generator.normal, 0.0, 0.93) for count in (2, 3, 6, 10, 19)),
        (20, np.random.Generator.normal, 0.0, 0.9),
        *((count, np.random.Generator.exponential, 1.0, 0.85) for count in (2, 3, 6, 20, 5000)),
    ],
)
def test_interval_of_a_mean_holds_it_about_as_often_as_it_says(
    count: int, draw: Callable[..., np.ndarray], truth: float, least: float
) -> None:
    random, trials = np.random.default_rng(7), 200 if count >= 20 else 2000
    means = [rates.mean_of(draw(random, size=count)) for _ in range(trials)]
    assert least <= sum(mean.least <= truth <= mean.most for mean in means) / trials <= 0.99


@pytest.mark.parametrize("values", [[2.0], [2.0] * 2, [2.0] * 5])
def test_values_that_show_no_spread_have_no_interval(values: list[float]) -> None:
    assert rates.mean_of(np.array(values)) == (2.0, -np.inf, np.inf)
    assert np.isfinite(rates.mean_of(np.array([*values, 2.1]))).all()
