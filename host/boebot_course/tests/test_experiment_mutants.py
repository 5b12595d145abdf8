"""Experiments fail when what they show is taken away: one row, a mutant, for each that has been doubted.

A mutant replaces something in this process, by monkeypatch; the experiment with seed 1 must then miss a criterion. That
it raises instead is no success: whoever reads its figures would not learn what is wrong.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

import numpy as np
import pytest

from boebot.behaviors import Avoid, ChargeBattery, FollowWall, Phototaxis, RunAndTumble, Wander
from boebot.brain import leaky, utility
from boebot.cognition import PathIntegration
from boebot.navigation.frames import Pose
from boebot.robot import Robot
from boebot_course.experiment import Floats
from boebot_course.experiments import (
    all_experiments,
    chemotaxis,
    economics,
    evolution,
    kinesis,
    predator,
    snapshot,
    utility_theory,
)
from boebot_course.tests.mutants import Mutant
from boebot_course.tests.mutants_of_navigation import NAVIGATION
from boebot_course.trials import Trial

pytestmark = pytest.mark.soak


# ---- section 7.1: utility theory -------------------------------------------------------------------------------------


def chances_swapped(patch: pytest.MonkeyPatch) -> None:
    def swapped(chances: Sequence[float], utilities: Sequence[float]) -> float:
        return sum(p * u for p, u in zip(reversed(chances), utilities, strict=True))

    patch.setattr(utility_theory, "expected_utility", swapped)


def chances_unheeded(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(utility_theory, "expected_utility", lambda chances, utilities: sum(utilities) / len(utilities))


def utility_straight(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(utility_theory, "money_utility", lambda amount, kappa: amount / utility_theory.MOST)


def price_of_the_payoff(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(utility_theory, "expected_gain", lambda wealth, price: sum(1.0 for _ in range(30)) - price)


def answers_by_payoff(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(utility_theory, "answer", lambda better, worse: (better + worse) / 2)


# ---- sections 5.3.2 and 4.4.2: wandering, taxis ----------------------------------------------------------------------


def no_turning(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Wander, "chance", lambda self, probability, per=None: False)


def light_unheeded(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Phototaxis, "step", lambda self, robot: robot.drive(self.signal, self.signal))


def nothing_avoided(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Avoid, "step", lambda self, robot: robot.drive(0.5, 0.5))


def wall_unheeded(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(FollowWall, "step", lambda self, robot: robot.drive(self.signal, self.signal))


def way_not_summed_up(patch: pytest.MonkeyPatch) -> None:
    def step(self: PathIntegration, robot: Robot) -> None:
        summed_up(self, robot)
        self.vector = (0.0, 0.0)

    summed_up = PathIntegration.step
    patch.setattr(PathIntegration, "step", step)


# ---- section 4.4.2: E. coli, its predator, wood lice -----------------------------------------------------------------


def no_memory(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(leaky.LeakyIntegrator, "advance", lambda self, x, elapsed: self.value)


def no_tumbling(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(RunAndTumble, "_tumble", lambda self, robot: None)


def attractant_everywhere(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(chemotaxis, "gaussian", chemotaxis.uniform)


def attractant_repels(patch: pytest.MonkeyPatch) -> None:
    drawn = chemotaxis.gaussian
    patch.setattr(chemotaxis, "gaussian", lambda x, y, time: 1 - drawn(x, y, time))


def runs_after_all_tumbles(patch: pytest.MonkeyPatch) -> None:
    swarm = chemotaxis.swarm
    patch.setattr(chemotaxis, "swarm", lambda *given, run_on=0.0: swarm(*given))


def predator_stands_still(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(predator, "SLOWER", math.inf)


def predator_without_attractant(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(predator, "lure", chemotaxis.uniform)


def humid_or_not_alike(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(kinesis, "SLOW", kinesis.FAST)


def snapshot_from_elsewhere(patch: pytest.MonkeyPatch) -> None:
    way_home, home_and_start = snapshot.way_home, snapshot.home_and_start

    def misled(home: Pose, start: Pose, seed: int) -> tuple[Trial, Floats]:
        trial, _ = way_home(home_and_start(seed + 1)[0], start, seed)
        return trial, np.hypot(*(trial.path - home[:2]).T)

    patch.setattr(snapshot, "way_home", misled)


# ---- section 8.2: utility functions ----------------------------------------------------------------------------------


def no_lag(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(utility.Utilities, "_factors_of", lambda self, elapsed: [(0.0, 0.0)] * len(self.values))


def constant_tendencies(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(utility.Utilities, "advance", lambda self, z, elapsed: None)


def gamma_that_stays(patch: pytest.MonkeyPatch) -> None:
    factors = utility.Utilities._factors_of
    patch.setattr(
        utility.Utilities, "_factors_of", lambda self, elapsed: [(lag, 1.0) for lag, _ in factors(self, elapsed)]
    )


def fitness_unheeded(patch: pytest.MonkeyPatch) -> None:
    offspring = evolution.offspring
    patch.setattr(
        evolution, "offspring", lambda genes, fitness, source: offspring(genes, source.random(len(genes)), source)
    )


def no_mutation(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(evolution, "MUTATION", 0.0)


def chance_of_no_seed(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Wander, "chance", lambda self, probability, per=None: random.random() < 0.05)


def station_without_current(patch: pytest.MonkeyPatch) -> None:
    described = economics.robot
    patch.setattr(economics, "robot", lambda *, contacts=True: described(contacts=False))


def station_not_sought(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(ChargeBattery, "seek", lambda self, robot: None)


OLD = [
    Mutant("E56", "the logarithm", price_of_the_payoff),
    Mutant("E57", "which chance belongs to which outcome", chances_swapped),
    Mutant("E57", "the chances", chances_unheeded),
    Mutant("E58", "the aversion to risks", utility_straight),
    Mutant("E58", "the chances", chances_unheeded),
    Mutant("elicitation", "the aversion to risks", answers_by_payoff),
    Mutant("elicitation", "the chances", chances_unheeded),
    Mutant("E20", "turning", no_turning),
    Mutant("E21", "avoiding", nothing_avoided),
    Mutant("E27", "the light", light_unheeded),
    Mutant("E28", "that humidity slows it down", humid_or_not_alike),
    Mutant("E29", "the memory", no_memory),
    Mutant("E30", "the memory", no_memory),
    Mutant("E31", "tumbling", no_tumbling),
    Mutant("E31", "differences of the attractant", attractant_everywhere),
    Mutant("E31", "that the attractant attracts", attractant_repels),
    Mutant("E32", "tumbling on the spot", runs_after_all_tumbles),
    Mutant("E33", "the home vector", way_not_summed_up),
    Mutant("E35", "the wall", wall_unheeded),
    Mutant("predator-prey", "the predator's motion", predator_stands_still),
    Mutant("predator-prey", "the predator's attractant", predator_without_attractant),
    Mutant("E59", "the memory", no_memory),
    Mutant("isocline", "that tendencies follow deficits", constant_tendencies),
    Mutant("E61", "the utilities' lag", no_lag),
    Mutant("E62", "the utilities' lag", no_lag),
    Mutant("E63", "the decay of gamma", gamma_that_stays),
    Mutant("E64", "the utilities' lag", no_lag),
    Mutant("E65", "selection", fitness_unheeded),
    Mutant("E65", "mutation", no_mutation),
    Mutant("E68", "that a brain's chance is its seed's", chance_of_no_seed),
    Mutant("E68", "readings", wall_unheeded),
    Mutant("robot-economics", "what charging is good for", station_without_current),
    Mutant("robot-economics", "the way to the station", station_not_sought),
    Mutant("snapshot", "what was seen at home", snapshot_from_elsewhere),
    Mutant("deciding", "the way to the station", station_not_sought),
]
"""Of the experiments E17 to E35 and E56 to E68, and of those that have a name only."""


@pytest.mark.parametrize("mutant", [*OLD, *NAVIGATION], ids=lambda mutant: f"{mutant.experiment} {mutant.taken_away}")
def test_without_what_it_shows_an_experiment_fails(mutant: Mutant, monkeypatch: pytest.MonkeyPatch) -> None:
    mutant.patch(monkeypatch)
    outcome = all_experiments()[mutant.experiment].run(1)
    assert not outcome.is_met, f"passes without {mutant.taken_away}"
