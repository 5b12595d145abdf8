"""What a count of rare events says about their rate."""

from __future__ import annotations

from bisect import bisect_left

from scipy.stats import beta

CONFIDENCE = 0.95
RATE_ALLOWED = 2.0**-20  # of wrong frames accepted, per damaged frame
LOST_ALLOWED = 0.005  # untouched frames lost, per damaged frame
LOST_ALLOWED_CUT = 0.02  # the same for frames whose end and delimiter are missing: the next may look like their rest


def upper_bound(events: int, trials: int) -> float:
    """The one-sided bound of Clopper and Pearson (1934): at this rate there would be as few events as these, or fewer,
    only with a probability of 1 - CONFIDENCE. Without an event it is nearly 3/trials (the rule of three).
    """
    return 1.0 if events >= trials else float(beta.ppf(CONFIDENCE, events + 1, trials - events))


def trials_needed(events: int = 0) -> int:
    """The fewest trials which with that many events show a rate of at most RATE_ALLOWED."""
    return bisect_left(range(100_000_000), True, lo=events + 1, key=lambda n: upper_bound(events, n) <= RATE_ALLOWED)
