"""Other ways to decide: what each of the rules does with the same behaviors."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

import boebot
from boebot.brain import Brain, Utility
from boebot_course.experiments import deciding, economics
from boebot_course.trials import Steady


def most_useful(arbiter: deciding.Arbiter, calls: Sequence[str]) -> Sequence[str]:
    """The brain's own rule."""
    return [max(calls, key=arbiter.useful)]


def test_by_the_brains_own_rule_an_arbiter_drives_as_the_brain_does() -> None:
    brains = (economics.sweeper(), deciding.Arbiter(rule=most_useful).govern(economics.sweeper()))
    runs = [economics.until_low(brain, economics.robot(), 5, 40.0)[0].result for brain in brains]
    assert len(runs[0].brain_record.switches) > 5  # type: ignore[union-attr]
    assert runs[0].hash == runs[1].hash


SIGNALS = {"withdraw": (-0.7, -0.7), "avoid": (0.5, -0.5), "charge": (0.6, 0.3), "wander": (0.5, 0.5)}


def last_command(way: str, **utilities: float) -> tuple[float, float]:
    """Of behaviors that always drive the same; those without a utility do not call."""
    behaviors = [
        Steady(name=name, left=left, right=right, utility=Utility(b=utilities.get(name, -1.0)))
        for name, (left, right) in SIGNALS.items()
    ]
    result = boebot.run(deciding.WAYS[way](Brain(behaviors)), robot="arsim", arena="empty", seconds=0.5, seed=1)
    return result.record.steps[-1][2:]


@pytest.mark.parametrize(
    ("utilities", "drives"),
    [
        ({"wander": 0.5}, "wander"),
        ({"wander": 0.5, "charge": 0.4}, "wander"),
        ({"wander": 0.5, "charge": 1.0, "avoid": 0.6}, "avoid"),
        ({"wander": 0.5, "charge": 1.0, "avoid": 2.0, "withdraw": 0.6}, "withdraw"),
    ],
)
def test_by_priorities_the_first_that_calls_drives_however_useful_others_are(
    utilities: dict[str, float], drives: str
) -> None:
    assert last_command("priorities", **utilities) == SIGNALS[drives]


def test_votes_for_commands_that_are_near_each_other_meet_between_them() -> None:
    left, right = last_command("voting", wander=0.5, charge=0.6)
    # On the line between both, x of its length d = 0.22 from that of charging, which weighs twice as much, the sum is
    # greatest where 2 x exp(-x²/2σ²) = (d - x) exp(-(d - x)²/2σ²): at 0.3 d.
    assert (left, right) == pytest.approx((0.57, 0.36), abs=0.0251)


def test_votes_for_commands_far_from_each_other_leave_that_of_the_heavier_one() -> None:
    assert last_command("voting", wander=0.5, avoid=0.6) == pytest.approx(SIGNALS["avoid"])


def test_a_tree_goes_on_charging_until_the_battery_is_full_or_something_is_more_urgent() -> None:
    rule, charger = deciding.tree(), SimpleNamespace(charging=False)
    arbiter: Any = SimpleNamespace(other=lambda kind: charger)
    calls = [
        ("wander",),
        ("charge", "wander"),
        ("wander",),
        ("avoid", "wander"),
        ("wander",),
        ("charge", "wander"),
    ]
    driving = [one for those in calls for one in rule(arbiter, those)]
    assert driving == ["wander", "charge", "charge", "avoid", "wander", "charge"]
    charger.charging = True
    driving = [one for those in calls[1:3] + calls[:1] for one in rule(arbiter, those)]
    assert driving == ["charge", "charge", "wander"], "one step more, at which it is full"


def test_without_py_trees_the_extra_is_named() -> None:
    code = "import sys; sys.modules['py_trees'] = None; from boebot_course.experiments import deciding; deciding.tree()"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "a behavior tree needs py-trees, which is not installed: pip install 'boebot[learn]'" in ended.stderr
