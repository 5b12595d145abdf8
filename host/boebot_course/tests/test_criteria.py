"""Criteria can fail: experiments with a constant that is changed."""

from __future__ import annotations

import types

import pytest

from boebot_course.experiments import (
    all_experiments,
    animals,
    contract,
    economics,
    stentor,
)
from boebot_course.experiments import utility_functions as functions


@pytest.mark.soak
@pytest.mark.parametrize(
    ("name", "module", "constant", "value"),
    [
        ("E59", stentor, "FEED", 0.47),
        ("E60", stentor, "K_2", 0.95),
        ("E61", functions, "TAU", 0.2),
        ("E62", functions, "WEIGHT", 1.8),
        ("E63", functions, "KICK", 2.8),
        ("E64", functions, "TAU", 0.35),
        ("E66", contract, "ALLOWED", ("builtins", "boebot.robot", "boebot.description.equipment")),
        ("isocline", animals, "USE", 0.05),
        ("robot-economics", economics, "BEGIN_V", 7.8),
    ],
)
def test_criteria_can_fail(
    name: str, module: types.ModuleType, constant: str, value: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, constant, value)
    assert not all_experiments()[name].run(1).is_met
