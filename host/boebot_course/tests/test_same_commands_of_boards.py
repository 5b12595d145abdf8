"""E68: the same brain and seed command the same on all boards as long as telemetry agrees."""

from __future__ import annotations

import pytest

import boebot
from boebot_course.experiments import wall
from boebot_course.experiments.same_commands import (
    BRAINS,
    WALLS_SECONDS,
    command_difference,
    disagreements,
    judge_walls,
    telemetry_difference,
)


@pytest.mark.parametrize("board_url", ["native", "avr"])
@pytest.mark.parametrize("name", BRAINS)
def test_commands_differ_no_sooner_than_telemetry(board_url: str, name: str) -> None:
    native, here = (boebot.run(BRAINS[name](), on=on, seconds=20, seed=1) for on in ("native", board_url))
    seen, commanded = telemetry_difference(native, here), command_difference(native, here)
    assert commanded is None or (seen is not None and seen.step <= commanded.step), commanded
    if board_url == "native":
        assert seen is None and commanded is None
    assert here.steps == 400 and disagreements(here, BRAINS[name]()) == 0
    # from one board to the other a step sees the same tick, or the one before or after
    steps = zip(native.record.steps, here.record.steps, strict=True)
    assert max(abs(a[0] - b[0]) for a, b in steps) <= 1


@pytest.mark.parametrize("board_url", ["native", pytest.param("avr", marks=pytest.mark.soak)])
def test_whole_runs_along_walls_are_alike(board_url: str) -> None:
    """E68's brain that its readings pull back: 60 s on both boards, step by step."""
    measured = judge_walls([wall.lap(wall.pinger(), on, 1, wall.START, WALLS_SECONDS) for on in ("native", board_url)])
    assert [one.name for one in measured if not one.is_met] == []
