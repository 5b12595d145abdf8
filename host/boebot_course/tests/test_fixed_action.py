"""Fixed action patterns: what the criteria tell apart."""

from __future__ import annotations

from boebot_course.experiments import (
    fixed_action,
)
from boebot_course.tests.criteria import missed


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
