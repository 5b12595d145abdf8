"""Distributions of jitter and latency: their figures, the table, the picture."""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from boebot.errors import BoebotError
from boebot_timing.distributions import Distribution, JitterReport, Losses, rows
from boebot_timing.histograms import draw


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
    assert rows([none])[1][4:8] == ("-", "-", "-", "-")


def test_each_kind_of_loss_counts() -> None:
    names = ("frames", "bytes", "edges", "ticks", "late_ticks", "masked", "resets")
    assert not Losses("saturated", *(0 for _ in names)).anything
    for number in range(len(names)):
        assert Losses("saturated", *(int(other == number) for other in range(len(names)))).anything


def test_table_says_cycles_or_milliseconds_and_broken_limits() -> None:
    table = rows([distribution([0, 3], -2, 2), distribution([16_000, 32_000])])
    assert table[1] == ("width", "figures", "2", "cycles", "0", "0", "3", "3", "-2 .. 2", "1 broken")
    assert table[2][3:] == ("ms", "1.00", "1.00", "2.00", "2.00", "", "")


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_picture_shows_every_quantity(tmp_path: Path, ending: str) -> None:
    found = [distribution([0, 1, 2], -2, 2), distribution(list(range(0, 90_000, 7)), quantity="latency")]
    path = draw(found, tmp_path / f"jitter.{ending}")
    if ending == "png":
        assert matplotlib.image.imread(path).shape[1] > 1000
    else:
        text = path.read_text(encoding="utf-8")
        assert text.count("<!-- width -->") == text.count("<!-- latency -->") == 1
        assert draw(found, tmp_path / "again.svg").read_text(encoding="utf-8") == text


def test_picture_that_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BoebotError, match="expected one value"):
        draw([distribution([])], tmp_path / "jitter.png")
    with pytest.raises(BoebotError, match=r"\.svg"):
        draw([distribution([1])], tmp_path / "jitter.bmp")
    with pytest.raises(BoebotError, match="cannot be written"):
        draw([distribution([1])], tmp_path / "nowhere" / "jitter.png")
