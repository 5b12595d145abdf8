"""Experiments on reflexes, fixed actions, homing, kinesis, walls and prey: the cheap ones are met, and all can fail."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.behaviors import FollowWall
from boebot.behaviors.withdraw import ReflexIntensity
from boebot.brain import Brain
from boebot_course.experiment import Measured
from boebot_course.experiments import all_experiments, fixed_action, homing, kinesis, predator, reflex, wall
from boebot_course.experiments.chemotaxis import Swarm, gaussian, swarm, uniform

EXPERIMENTS = all_experiments()


def nothing(share: float) -> None:
    assert 0 <= share <= 1


def missed(measured: list[Measured]) -> list[str]:
    return [one.name for one in measured if not one.is_met]


@pytest.mark.parametrize("name", ["E25", "E26", "E34", "E34-shieldbot", "E35", "E35-shieldbot"])
def test_cheap_experiments_are_met(name: str) -> None:
    outcome = EXPERIMENTS[name].run(1, nothing)
    assert missed(list(outcome.measured)) == []
    columns = outcome.columns()
    assert len({len(column) for column in columns.values()}) == 1


@pytest.mark.parametrize(
    "name", ["E28", "E33", "E33-shieldbot", "E34-shieldbot", "E35", "E35-shieldbot", "E35-avr", "predator-prey"]
)
def test_experiments_say_what_they_run_on(name: str) -> None:
    one = EXPERIMENTS[name]
    assert one.robot and one.title and one.caption and one.source


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


def test_a_pattern_that_is_cut_short_is_noticed() -> None:
    stays, gone = (fixed_action.run_escape("arsim", (0.7854, 2.0, 0.5), one, 1) for one in (True, False))
    duration = fixed_action.escape("arsim").duration
    assert missed(fixed_action.compare(stays, gone, duration)) == []
    cut = fixed_action.Escape(gone.result, gone.released, gone.ended - 0.3, gone.commands[:-15])
    assert missed(fixed_action.compare(stays, cut, duration)) == ["commands that differ", "the pattern lasts"]
    assert fixed_action.differing(stays.commands, gone.commands + 0.1) == len(gone.commands)
    assert missed(fixed_action.compare(gone, stays, duration)) == []  # its own retreat takes the stimulus away, too


def test_a_pattern_that_was_never_released_is_no_success() -> None:
    far = fixed_action.run_escape("arsim", (0.7854, 5.0, 4.0), True, 1)
    assert "the pattern lasts" in missed(fixed_action.compare(far, far, 1.0))


@pytest.mark.parametrize(
    "brain", [FollowWall(side="left"), FollowWall(signal=0.7, gain=0.0), FollowWall(reference=0.9)]
)
def test_robots_that_do_not_follow_walls_fail(brain: FollowWall, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wall, "follower", lambda: Brain([brain]))
    assert not EXPERIMENTS["E35"].run(1, nothing).is_met


def test_a_home_vector_that_points_elsewhere_has_that_error() -> None:
    x, y = np.array([0.0, 3.0, 0.05]), np.array([0.0, 4.0, 0.0])
    vector = np.array([[0.0, 0.0], [-3.0, -4.0], [-0.05, 0.6]])
    one = homing.Journey(x, y, vector, 1, 2)
    assert one.error == pytest.approx(0.6) and one.distance == pytest.approx(0.05)
    lost = homing.Journey(x, y, vector, 1, None)
    assert lost.error == lost.distance == lost.nearest == math.inf


def test_the_compass_circle_has_its_middle() -> None:
    angles = np.linspace(0, 4.0, 30)  # not even a whole turn
    circle = np.column_stack((7 + 20 * np.cos(angles), -3 + 20 * np.sin(angles)))
    assert homing.middle(circle) == pytest.approx((7.0, -3.0))


def test_half_of_the_floor_is_humid() -> None:
    places = np.random.default_rng(1).uniform(-40, 40, (2, 20_000))
    assert kinesis.humid_share(*places) == pytest.approx(0.5, abs=0.02)
    assert kinesis.humid_share(*places[:, :1]) == kinesis.humidity(*places[:, 0])


def test_prey_that_stays_with_the_predator_is_dense_and_left_behind_it_is_not() -> None:
    times = np.arange(201.0)
    with_it = np.repeat(predator.predators(times)[:, None], 10, axis=1)
    left = np.zeros_like(with_it)
    assert predator.density_ratio(Swarm(with_it, 1.0)) == pytest.approx(100 / (math.pi * 0.25))
    assert predator.density_ratio(Swarm(left, 1.0)) == 0, "0.75 m away at least"


def test_bacteria_gather_in_some_seconds_and_not_in_uniform_attractant() -> None:
    lured, others = (swarm(1, attractant, count=12, seconds=6.0) for attractant in (gaussian, uniform))
    assert lured.ratio < 0.6 < 0.9 < others.ratio < 1.1
