"""Reflexes: closed forms, and what the criteria tell apart."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.behaviors.withdraw import ReflexIntensity
from boebot_course.experiments import (
    reflex,
)
from boebot_course.tests.criteria import missed


def test_without_fatigue_the_reflex_does_not_fade() -> None:
    tireless = reflex.intensity_under_a_step(ReflexIntensity(weight=0.0), 15.0)
    assert missed(reflex.judge_step(*tireless)) == ["greatest intensity", "reached at", "intensity after 9 s"]


def test_without_fatigue_the_larva_stays_for_ever() -> None:
    one = reflex.larva(ReflexIntensity(0.3, 15.0, 0.0))
    assert missed(reflex.judge(one))[:1] == ["tired, ρ < 0.15"]
    assert one.out == math.inf and one.place[-1] == reflex.TUNNEL


def test_the_larva_tires_when_the_closed_form_says() -> None:
    """ρ = W - g F with S = 1, all from 0: W = 1 - e^(-t/τ_w), F = 1 - (τ_f e^(-t/τ_f) - τ_w e^(-t/τ_w))/(τ_f - τ_w)."""
    one = reflex.larva(ReflexIntensity(0.3, 15.0, 0.98))
    t = one.times
    fatigue = 1 - (15 * np.exp(-t / 15) - 0.3 * np.exp(-t / 0.3)) / 14.7
    assert one.intensity == pytest.approx(np.maximum(0, 1 - np.exp(-t / 0.3) - 0.98 * fatigue), abs=1e-9)
    assert one.tired == pytest.approx(-15 * math.log((1 - 0.85 / 0.98) * 14.7 / 15), abs=2 * reflex.STEP)
