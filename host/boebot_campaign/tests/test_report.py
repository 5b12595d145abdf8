"""Figures of a report, against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from boebot_campaign.report import cliffs_delta


def test_cliffs_delta_is_counted_over_all_pairs() -> None:
    one, other = np.array([1.0, 2.0, 2.0, 5.0]), np.array([2.0, 3.0, 0.0])
    pairs = [np.sign(a - b) for a in one for b in other]
    assert cliffs_delta(one, other) == pytest.approx(sum(pairs) / len(pairs))
    assert cliffs_delta(other + 10, one) == 1.0
