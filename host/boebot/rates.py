"""How well a rate is known that was counted, k of n runs collided, and a mean of n values."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

NORMAL_95 = 1.959964  # 95 % of a normal distribution lie within so many standard deviations
RESAMPLES = 1000
BY_NORMAL = 2000  # values; with as many or more a mean is normally distributed, and needs no bootstrap


class Mean(NamedTuple):
    """Of some values, with its interval."""

    mean: float
    least: float
    most: float


def interval(count: int, trials: int) -> tuple[float, float]:
    """The least and the greatest rate, 0 to 1, that `count` of `trials` independent events agree with at 95 %
    confidence: Wilson's interval (Journal of the American Statistical Association 22, 1927, p. 209-212). Of 0 of 100 it
    is 0 to 0.037, where the usual standard error says 0 to 0.

    Raises:
        ValueError: there are no trials, or not 0 to `trials` events.
    """
    if not 0 <= count <= trials or trials < 1:
        raise ValueError(f"{count} of {trials} is no rate; expected 0 to n of n, and n at least 1")
    rate, squared = count / trials, NORMAL_95**2
    middle = (rate + squared / (2 * trials)) / (1 + squared / trials)
    half = NORMAL_95 / (1 + squared / trials) * math.sqrt(rate * (1 - rate) / trials + squared / (4 * trials**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def in_words(count: int, trials: int) -> str:
    """The rate and its interval: "0 of 100, 0 to 4 %"."""
    least, most = interval(count, trials)
    return f"{count} of {trials}, {math.floor(100 * least)} to {math.ceil(100 * most)} %"


def mean_of(values: NDArray[np.float64]) -> Mean:
    """The mean and its interval at 95 % confidence: by bootstrap (Efron, Annals of Statistics 7, 1979), the percentiles
    of means of samples drawn anew, the same each time."""
    mean, count = float(values.mean()), len(values)
    if count >= BY_NORMAL:
        half = NORMAL_95 * float(values.std(ddof=1)) / count**0.5
        return Mean(mean, mean - half, mean + half)
    drawn = np.random.default_rng(1).integers(count, size=(RESAMPLES, count))
    least, most = np.percentile(values[drawn].mean(axis=1), [2.5, 97.5])
    return Mean(mean, float(least), float(most))
