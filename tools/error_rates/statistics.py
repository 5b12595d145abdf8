"""What a count of rare events says about their rate."""

from __future__ import annotations

import numpy as np

CONFIDENCE = 0.95
RATE_ALLOWED = 2.0**-20  # of wrong frames accepted, per damaged frame
LOST_ALLOWED = 0.005  # untouched frames lost, per damaged frame
LOST_ALLOWED_CUT = 0.02  # the same for frames whose end and delimiter are missing: the next may look like their rest


def upper_bound(events: int, trials: int, confidence: float = CONFIDENCE) -> float:
    """The one-sided bound of Clopper and Pearson (1934): the rate at which as few events as these, or fewer, would be
    seen only with a probability of 1 - confidence. Without an event it is nearly 3/trials (the rule of three).
    """
    if events >= trials:
        return 1.0
    # log of the binomial coefficients C(trials, 0..events)
    steps = np.arange(1, events + 1, dtype=float)
    logs = np.concatenate([[0.0], np.cumsum(np.log((trials - steps + 1.0) / steps))])
    low, high = events / trials, 1.0
    for _ in range(200):
        rate = (low + high) / 2.0
        hits = np.arange(events + 1)
        exponents = logs + hits * np.log(rate) + (trials - hits) * np.log1p(-rate)
        if np.exp(exponents).sum() > 1.0 - confidence:
            low = rate
        else:
            high = rate
        if high - low < 1e-6 * high:
            break
    return high


def trials_needed(events: int = 0, rate: float = RATE_ALLOWED, confidence: float = CONFIDENCE) -> int:
    """So many trials with so few events show a rate of at most `rate`."""
    low, high = events + 1, 2
    while upper_bound(events, high, confidence) > rate:
        high *= 2
    while low < high:
        middle = (low + high) // 2
        if upper_bound(events, middle, confidence) > rate:
            low = middle + 1
        else:
            high = middle
    return high
