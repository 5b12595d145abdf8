"""Stentor by three ways through its equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from boebot_course.experiments import (
    stentor,
)


def integrated(dose: float) -> list[tuple[int, float]]:
    """Starts by an integrator that knows nothing of closed forms, its switches located by its events."""
    active, time, y, starts = 0, 0.0, np.zeros(5), [(1, 0.0)]

    def utilities(y: Any) -> Any:
        return np.concatenate(([stentor.FEED], y[1:]))

    while True:

        def slope(t: float, y: Any, active: int = active) -> Any:
            x = y[0]
            rate = dose - stentor.K_1 * x if active == 0 else stentor.X_2 - stentor.K_2 * x
            return np.concatenate(([rate], stentor.GAINS * x - stentor.DECAYS * y[1:]))

        rivals = [one for one in range(5) if one != active]
        events = [lambda t, y, one=one, active=active: utilities(y)[one] - utilities(y)[active] for one in rivals]
        for event in events:
            event.terminal, event.direction = True, 1  # type: ignore[attr-defined]
        found = solve_ivp(slope, (time, 4.0), y, events=events, rtol=1e-9, atol=1e-11, max_step=0.05)
        reached = [one for one, times in zip(rivals, found.t_events, strict=True) if len(times)]
        if not reached:
            return starts
        active, time, y = reached[0], float(found.t[-1]), found.y[:, -1]
        starts.append((active + 1, time))


@pytest.mark.parametrize("dose", [2.6, 1.0])
def test_stentor_from_switch_to_switch_is_what_an_integrator_gives(dose: float) -> None:
    exact, expected = stentor.exact(dose).starts, integrated(dose)
    assert [which for which, _ in exact] == [which for which, _ in expected]
    assert [time for _, time in exact] == pytest.approx([time for _, time in expected], abs=1e-5)


def test_stentor_by_euler_comes_to_the_exact_one() -> None:
    limit = stentor.exact()
    distances = []
    for step in (8e-3, 2e-3):
        euler = stentor.by_euler(step=step)
        distances.append(max(abs(a[1] - b[1]) for a, b in zip(euler.starts[:5], limit.starts[:5], strict=True)))
    assert distances[1] < distances[0] / 2 and distances[1] < 4e-3
