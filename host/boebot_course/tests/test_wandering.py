"""Wandering and avoiding: what the criteria tell apart."""

from __future__ import annotations

from dataclasses import replace

import pytest

from boebot.behaviors import Wander
from boebot_course.experiments import (
    wandering,
)
from boebot_course.tests.criteria import missed


@pytest.mark.soak
def test_other_chances_fail_e19(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wandering, "STEPS", 100_000)
    changed = Wander(turn_probability=0.012, stop_turn_probability=0.04, left_turn_probability=0.6)
    assert len(missed(wandering.judge_stays(*wandering.stays(changed, 1)))) == 3


@pytest.mark.soak
def test_wandering_alone_fails_the_criterion_of_avoiding_and_the_other_way_round() -> None:
    few = replace(wandering.SHIELDBOT, runs=2, seconds=25.0)
    alone = wandering.trials(wandering.wanderer, few, 1)
    assert missed(wandering.judge_alone(alone, few)) == []
    assert missed(wandering.judge_avoiding(alone)) == ["runs that collide", "runs in which it avoided something"]
    avoiding = wandering.trials(wandering.avoider, few, 1)
    assert "runs that collide" in missed(wandering.judge_alone(avoiding, few))


@pytest.mark.soak
def test_driving_straight_into_a_wall_is_not_wandering() -> None:
    few = replace(wandering.NOTES, runs=2, seconds=10.0)
    straight = replace(few, turn=0.0)
    trials = wandering.trials(wandering.wanderer, straight, 1)
    assert missed(wandering.judge_alone(trials, few)) == ["turns begun in each second ahead"]


@pytest.mark.soak
def test_a_robot_that_stays_away_from_everything_has_not_avoided() -> None:
    short = replace(wandering.NARROW, runs=2, seconds=0.5)
    trials = wandering.trials(wandering.avoider, short, 1)
    assert missed(wandering.judge_avoiding(trials)) == ["runs in which it avoided something"]
