"""A metre straight ahead: what the criteria tell apart."""

from __future__ import annotations

import math

import pytest

from boebot.behaviors import StraightRun
from boebot.brain import Brain
from boebot.cognition import Odometry
from boebot_course.experiments import (
    odometric_ghost,
    straight_line,
    straight_line_servo,
)
from boebot_course.tests.criteria import missed


@pytest.mark.soak
def test_a_threshold_of_one_tenth_fails_e22() -> None:
    brain = Brain([StraightRun(threshold=0.1), Odometry()], period=0.01)
    trial = straight_line.drive(brain, "arsim", 6.0, 1)
    assert missed(straight_line.judge_notes(trial)) == [
        "d at the stop command",
        "d at rest",
        "time of the stop command",
    ]


@pytest.mark.soak
def test_two_shieldbots_meet_e22_and_e24() -> None:
    believers = [straight_line.runner(period=0.05, least=0.06, hold=0.5) for _ in range(2)]
    runs = [straight_line.drive(brain, "shieldbot", 13.0, seed, "native") for seed, brain in enumerate(believers, 1)]
    assert missed(straight_line.judge_shieldbot(runs)) == []
    assert "mean error" in missed(odometric_ghost.judge_shieldbots(runs))  # they have no wrong wheel factor
    deceived = straight_line.runner(period=0.05, least=0.06, hold=0.5, factors=(1.02, 1.0))
    assert (
        missed(odometric_ghost.judge_shieldbots([straight_line.drive(deceived, "shieldbot", 13.0, 1, "native")])) == []
    )


@pytest.mark.soak
def test_without_a_least_signal_the_shieldbot_fails_e22() -> None:
    brain = straight_line.runner(period=0.05, hold=straight_line.HOLD)
    trial = straight_line.drive(brain, "shieldbot", 14.0, 1, "native")
    assert math.isnan(trial.stop_time)
    assert "runs that stop" in missed(straight_line.judge_shieldbot([trial]))


@pytest.mark.soak
def test_a_least_signal_within_the_dead_band_fails_e23() -> None:
    run = straight_line_servo.on_servo_model(0.04)
    assert "with s_min: stops (1: yes)" in missed(straight_line_servo.judge_model(run, run))
