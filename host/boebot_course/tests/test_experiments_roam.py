"""Experiments of wandering, avoiding, straight runs and taxis: they meet their criteria, and the criteria can fail."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from boebot.behaviors import StraightRun, Wander
from boebot.brain import Brain
from boebot.cognition import Odometry
from boebot.errors import BrainError
from boebot_course.experiments import (
    Measured,
    all_experiments,
    odometric_ghost,
    straight_line,
    straight_line_servo,
    taxis,
    wandering,
)

EXPERIMENTS = all_experiments()
CHEAP = ("E19", "E22", "E23", "E23-shieldbot", "E24")
ROWS = {
    "E19": "none",
    **dict.fromkeys(("E20", "E21", "E22", "E24"), "arsim"),
    "E27": "arsim in the size of a Boe-Bot",
    "E23": "shieldbot (16 edges, as a model of its servos)",
    **dict.fromkeys((f"E{number}-shieldbot" for number in (20, 21, 22, 23, 24, 27)), "shieldbot (native)"),
    **dict.fromkeys(("E21-avr", "E22-avr"), "shieldbot (avr)"),
}


def ignore(share: float) -> None:
    assert 0 <= share <= 1


def missed(measured: Sequence[Measured]) -> list[str]:
    return [one.name for one in measured if not one.is_met]


def test_each_row_names_its_robot() -> None:
    for name, robot in ROWS.items():
        row = EXPERIMENTS[name]
        assert row.robot == robot


@pytest.mark.parametrize("name", CHEAP)
def test_cheap_rows_are_met_and_drawn(name: str) -> None:
    outcome = EXPERIMENTS[name].run(1, ignore)
    assert missed(outcome.measured) == []
    assert len({len(column) for column in outcome.columns().values()}) == 1
    figure = Figure()
    outcome.draw(figure)
    assert all(axes.has_data() for axes in figure.axes)


def test_other_chances_fail_e19(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wandering, "STEPS", 100_000)
    changed = Wander(turn_probability=0.012, stop_turn_probability=0.04, left_turn_probability=0.6)
    assert len(missed(wandering.judge_stays(*wandering.stays(changed, 1, ignore)))) == 3


def test_wandering_alone_fails_the_criterion_of_avoiding_and_the_other_way_round() -> None:
    few = replace(wandering.SHIELDBOT, runs=2, seconds=25.0)
    alone = wandering.trials(wandering.wanderer, few, 1, ignore)
    assert missed(wandering.judge_alone(alone, few)) == []
    assert missed(wandering.judge_avoiding(alone)) == ["runs that collide", "runs in which it avoided something"]
    avoiding = wandering.trials(wandering.avoider, few, 1, ignore)
    assert "runs that collide" in missed(wandering.judge_alone(avoiding, few))


def test_driving_straight_into_a_wall_is_not_wandering() -> None:
    few = replace(wandering.NOTES, runs=2, seconds=10.0)
    straight = replace(few, turn=0.0)
    trials = wandering.trials(wandering.wanderer, straight, 1, ignore)
    assert missed(wandering.judge_alone(trials, few)) == ["turns begun in each second ahead"]


def test_a_robot_that_stays_away_from_everything_has_not_avoided() -> None:
    short = replace(wandering.NARROW, runs=2, seconds=0.5)
    trials = wandering.trials(wandering.avoider, short, 1, ignore)
    assert missed(wandering.judge_avoiding(trials)) == ["runs in which it avoided something"]


def test_a_threshold_of_one_tenth_fails_e22() -> None:
    brain = Brain([StraightRun(threshold=0.1), Odometry()], period=0.01)
    trial = straight_line.drive(brain, "arsim", 6.0, 1)
    assert missed(straight_line.judge_notes(trial)) == [
        "d at the stop command",
        "d at rest",
        "time of the stop command",
    ]


def test_two_shieldbots_meet_e22_and_e24() -> None:
    believers = [straight_line.runner(period=0.05, least=0.06, hold=0.5) for _ in range(2)]
    runs = [straight_line.drive(brain, "shieldbot", 13.0, seed, "native") for seed, brain in enumerate(believers, 1)]
    assert missed(straight_line.judge_shieldbot(runs)) == []
    assert "mean error" in missed(odometric_ghost.judge_shieldbots(runs))  # they have no wrong wheel factor
    deceived = straight_line.runner(period=0.05, least=0.06, hold=0.5, factors=(1.02, 1.0))
    assert (
        missed(odometric_ghost.judge_shieldbots([straight_line.drive(deceived, "shieldbot", 13.0, 1, "native")])) == []
    )


def test_without_a_least_signal_the_shieldbot_fails_e22() -> None:
    brain = straight_line.runner(period=0.05, hold=straight_line.HOLD)
    trial = straight_line.drive(brain, "shieldbot", 14.0, 1, "native")
    assert math.isnan(trial.stop_time)
    assert "runs that stop" in missed(straight_line.judge_shieldbot([trial]))


def test_a_least_signal_within_the_dead_band_fails_e23() -> None:
    run = straight_line_servo.on_servo_model(0.04)
    assert "with s_min: stops (1: yes)" in missed(straight_line_servo.judge_model(run, run))


def test_an_odometer_without_error_has_no_ghost() -> None:
    trial = straight_line.drive(straight_line.runner(period=0.01), "arsim", 6.0, 1)
    assert "error of the estimate at the end" in missed(odometric_ghost.judge_notes(trial))


def test_the_closed_form_of_the_ghost_agrees_with_its_integral() -> None:
    """(2.7) to (2.9) summed by the midpoint rule along a straight line."""
    step, travelled = 1e-5, np.arange(0, 1, 1e-5) + 0.5e-5
    heading = (1 - 1.02) / 0.4 * travelled
    x, y = np.cumsum(1.01 * step * np.cos(heading)), np.cumsum(1.01 * step * np.sin(heading))
    last = int(np.argmax(np.hypot(x, y) >= 0.98))
    error = math.hypot(x[last] - travelled[last], y[last])
    assert odometric_ghost.arc_error(0.98, 0.4) == pytest.approx(error, abs=2e-5)


@pytest.mark.parametrize("factors", [(1.0,), (1.0, 0.0), (1.0, math.nan), (-1.0, 1.0)])
def test_wheel_factors_that_are_none_are_refused(factors: tuple[float, ...]) -> None:
    with pytest.raises(BrainError, match=r"factors are .* expected two numbers above 0"):
        Odometry(factors=factors)  # type: ignore[arg-type]


def test_a_robot_that_flees_the_light_fails_e27() -> None:
    fleeing = taxis.trials(replace(taxis.ARSIM, seconds=14.0), 1, ignore, flee=True, starts=6)
    times = [taxis.time_to_lamp(trial) for trial in fleeing]
    found = missed(taxis.judge(taxis.ARSIM, times, taxis.ARSIM.straight))
    assert found == ["starts that reach the lamp", "median time against the straight way's"]


def test_six_starts_of_e27_reach_the_lamp() -> None:
    seeking = taxis.trials(replace(taxis.ARSIM, seconds=20.0), 1, ignore, starts=6)
    assert all(taxis.time_to_lamp(trial) < math.inf for trial in seeking)
