"""Experiments about decisions: what they compute against other ways to the same, and criteria that can fail."""

from __future__ import annotations

import types
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import boebot
from boebot.record.compare import command_difference, telemetry_difference
from boebot.running.replayed import replayed
from boebot_course.experiments import (
    Outcome,
    all_experiments,
    animals,
    contract,
    economics,
    evolution,
    paradigms,
    stentor,
)
from boebot_course.experiments import utility_functions as functions
from boebot_course.experiments.same_commands import composed, disagreements

CHEAP = ("E59", "E60", "E61", "E62", "E63", "E64", "E66", "dose-response", "isocline", "robot-economics")


def run(name: str, seed: int = 1) -> Outcome:
    return all_experiments()[name].run(seed, lambda share: None)


@pytest.mark.parametrize("name", CHEAP)
def test_criteria_are_met(name: str) -> None:
    outcome = run(name)
    assert [one for one in outcome.measured if not one.is_met] == []
    assert len({len(column) for column in outcome.columns().values()}) == 1


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
    assert not run(name).is_met


# ---- Stentor ------------------------------------------------------------------------------------------------------


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


# ---- evolution ----------------------------------------------------------------------------------------------------


def test_toy_has_the_utility_of_the_notes() -> None:
    """(8.4) by the trapezoid rule, on what the robot saw, while the energy falls and rises."""
    genes = evolution.BY_HAND
    lives = evolution.live(np.array([genes]), traced=True, seconds=60)
    energy = np.concatenate(([1.0], lives.trace["energy"][:-1, 0]))
    on = np.concatenate(([0.0], lives.trace["place"][:-1, 0] <= 1e-9))
    settled, tau = np.tanh(genes.b + genes.w_energy * energy + genes.w_on * on), float(np.exp(genes.log_tau))
    fine, u, expected = 100, settled[0], []
    for level in settled:
        for _ in range(fine):
            rate = evolution.STEP / fine / tau
            u += rate * (level - u) / (1 + rate / 2)
        expected.append(u)
    assert lives.trace["utility"][:, 0] == pytest.approx(np.array(expected), abs=1e-6)
    assert lives.switches[0] == 2, "to the charger and back"


def test_evolution_repeats_itself_and_keeps_its_best() -> None:
    first, again, other = (evolution.evolve(seed, generations=3, seconds=60) for seed in (1, 1, 2))
    assert np.array_equal(first.best, again.best) and np.array_equal(first.genes, again.genes)
    assert not np.array_equal(first.genes, other.genes)
    assert (np.diff(first.best, axis=0) >= -1e-9).all()


def test_offspring_are_rather_those_of_the_better() -> None:
    genes = np.repeat(np.arange(30.0)[:, None], 4, axis=1)
    children = evolution.offspring(genes, np.arange(30.0), np.random.default_rng(1))
    assert (children[0, :3] == 29).all(), "the best as it is"
    # of two drawn, the better with 0.75: mean rank (0.75 · 2/3 + 0.25 · 1/3) · 29 = 16.9; its error is 8 / sqrt(30)
    assert 16.9 - 4.5 < children[1:, :3].mean() < 16.9 + 4.5


# ---- paradigms, comparison -------------------------------------------------------------------------------


def test_plans_that_take_time_are_acted_on_late() -> None:
    start = paradigms.STARTS[3]
    quick = paradigms.cross(paradigms.behavior_based(), start, seed=1)
    slow = paradigms.cross(paradigms.Serial(0.5), start, seed=1)
    assert quick.reaction <= paradigms.PERIOD < 0.45 <= slow.reaction
    assert quick.arrival > 0 and not len(quick.touched)


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
