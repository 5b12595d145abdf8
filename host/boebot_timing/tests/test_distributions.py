"""Distributions of jitter and latency: their figures and the table."""

from __future__ import annotations

import json

import numpy as np
import pytest

from boebot_timing.distributions import Distribution, JitterReport, Losses
from boebot_timing.shown import show_jitter


def distribution(
    values: list[int], least: int | None = None, most: int | None = None, quantity: str = "width"
) -> Distribution:
    return Distribution(quantity, "of a pulse", "figures", np.array(values, dtype=np.int64), least, most)


def test_figures_of_the_numbers_from_1_to_1000() -> None:
    """By definition: of 1000 values in order, 990 do not exceed the 990th."""
    numbers = list(range(1000, 0, -1))
    one = distribution(numbers, 11, 900)
    assert (one.minimum, one.percentile(50), one.percentile(99), one.maximum) == (1.0, 500.0, 990.0, 1000.0)
    assert (one.count, one.broken) == (1000, 10 + 100)
    summary = one.summary()
    assert summary["p99_s"] == 990 / 16e6 and summary["max_ticks"] == 1000 / 160_000


def test_no_values_are_no_numbers_and_break_nothing() -> None:
    none = distribution([], -2, 2)
    assert np.isnan(none.maximum) and none.broken == 0
    assert none.summary()["max_cycles"] is None
    report = JitterReport((none,), (Losses("figures", 0, 0, 0, 0, 0, 0, 0),))
    assert json.loads(json.dumps(report.as_json(), allow_nan=False))["distributions"][0]["count"] == 0


def test_each_kind_of_loss_counts() -> None:
    names = ("frames", "bytes", "edges", "ticks", "late_ticks", "masked", "resets")
    assert not Losses("saturated", *(0 for _ in names)).anything
    for number in range(len(names)):
        assert Losses("saturated", *(int(other == number) for other in range(len(names)))).anything


def test_table_says_cycles_or_milliseconds_and_broken_limits(capsys: pytest.CaptureFixture[str]) -> None:
    found = (distribution([0, 3], -2, 2), distribution([16_000, 32_000], quantity="delay"), distribution([]))
    show_jitter(JitterReport(found, (Losses("figures", 0, 0, 2, 0, 0, 0, 0),)))
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["width", "2", "cycles", "0", "0", "3", "3", "-2", "..", "2"] in lines
    assert ["delay", "2", "ms", "1.00", "1.00", "2.00", "2.00"] in lines
    assert ["width", "0", "cycles", "-", "-", "-", "-"] in lines
    assert [
        "broken:",
        "width,",
        "figures:",
        "1",
        "of",
        "2",
        "values",
        "are",
        "not",
        "from",
        "-2",
        "to",
        "2",
        "cycles",
    ] in lines
    assert ["figures:", "2", "edges"] in lines
