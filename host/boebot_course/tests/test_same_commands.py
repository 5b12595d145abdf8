"""How two runs are compared, and a run with what a brain commands anew on its telemetry."""

from __future__ import annotations

import pytest

import boebot
from boebot.running.replayed import replayed
from boebot_course.experiments.same_commands import command_difference, composed, disagreements, telemetry_difference


def test_runs_that_are_the_same_have_no_difference_and_others_say_where() -> None:
    one, same, other = (boebot.run("wander", on="native", seconds=5, seed=seed) for seed in (1, 1, 2))
    assert telemetry_difference(one, same) is None and command_difference(one, same) is None
    seen, commanded = telemetry_difference(one, other), command_difference(one, other)
    assert seen is not None
    assert commanded is None or commanded.step >= seen.step
    assert str(seen).startswith(f"step {seen.step} (tick {one.record.steps[seen.step][0]}): {seen.what} is ")


def test_replay_gives_the_commands_of_the_run_and_another_brain_gives_others() -> None:
    result = boebot.run(composed(), on="native", seconds=5, seed=1)
    assert len(replayed(result, composed())) == result.steps == 100
    assert disagreements(result, composed()) == 0
    assert disagreements(result, "wander") > 0


def test_runs_without_telemetry_are_refused() -> None:
    direct = boebot.run(lambda robot: None, robot="arsim", seconds=0.1)
    with pytest.raises(boebot.BoebotError, match="robot 'arsim' has no board, and no telemetry to compare"):
        telemetry_difference(direct, direct)
