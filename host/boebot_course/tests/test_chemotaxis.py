"""Bacteria that run and tumble."""

from __future__ import annotations

from boebot_course.experiments.chemotaxis import gaussian, swarm, uniform


def test_bacteria_gather_in_some_seconds_and_not_in_uniform_attractant() -> None:
    lured, others = (swarm(1, attractant, count=12, seconds=6.0) for attractant in (gaussian, uniform))
    assert lured.ratio < 0.6 < 0.9 < others.ratio < 1.1
