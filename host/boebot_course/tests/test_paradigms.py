"""Sense, model, plan, act against behaviors."""

from __future__ import annotations

from boebot_course.experiments import (
    paradigms,
)


def test_plans_that_take_time_are_acted_on_late() -> None:
    start = paradigms.STARTS[3]
    quick = paradigms.cross(paradigms.behavior_based(), start, seed=1)
    slow = paradigms.cross(paradigms.Serial(0.5), start, seed=1)
    assert quick.reaction <= paradigms.PERIOD < 0.45 <= slow.reaction
    assert quick.arrival > 0 and not len(quick.touched)
