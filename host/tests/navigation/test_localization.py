"""Localization by scans: (6.8), estimators, and the behavior on a robot. The notes' random search: experiment E54."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from boebot.navigation import Estimator, Lattice, LineMap, ParticleFilter, RandomSearch, Scan, estimators
from boebot.navigation.frames import Pose, composed, inverse, placed
from boebot.navigation.match import Match
from boebot_course.experiments.patrol import patrolled
from boebot_course.trials import trial_seeds

HALF_TURN = (-math.pi / 2, math.pi / 2)
REACH, RAYS = 4.0, 120


@pytest.fixture(scope="module")
def office() -> LineMap:
    return LineMap.of("office")


@pytest.fixture(scope="module")
def places(office: LineMap) -> list[Pose]:
    """Poses that a robot of 0.15 m can have."""
    lattice = Lattice.of(office, 0.15, 0.05, 0.05)
    start = lattice.nearest_free(-2.5, -1.4, within=0.5)
    assert start is not None
    chance = np.random.default_rng(5)
    cells = np.argwhere(lattice.reachable(start).free)
    drawn = [lattice.centre((int(row), int(column))) for row, column in cells[chance.integers(len(cells), size=40)]]
    return [(x, y, float(chance.uniform(-math.pi, math.pi))) for x, y in drawn]


def scan_at(plan: LineMap, pose: Pose, noise: float = 0.01, seed: int = 1) -> Scan:
    """Of a range finder with that noise, a share of the range."""
    (exact,) = plan.scans([pose], HALF_TURN, RAYS, REACH)
    factors = 1 + noise * np.random.default_rng(seed).standard_normal(RAYS)
    return Scan(np.where(exact > 0, exact * factors, -1.0), HALF_TURN, REACH)


def test_poses_are_composed_and_taken_apart() -> None:
    frame, pose = (1.0, 2.0, math.pi / 2), (0.5, 0.0, math.pi)
    assert composed(frame, pose) == pytest.approx((1.0, 2.5, -math.pi / 2))
    assert composed(inverse(frame), composed(frame, pose))[:2] == pytest.approx(pose[:2])
    assert placed(inverse(frame), [(1.0, 2.5)]) == [pytest.approx((0.5, 0.0))]


def test_scan_error_is_that_of_the_equation(office: LineMap, places: list[Pose]) -> None:
    """(6.8), by hand 5 cm away."""
    scan, here = scan_at(office, places[0], 0.0), (0.05, 0.0, 0.0)
    moved = composed(places[0], here)
    (expected,) = office.scans([moved], HALF_TURN, RAYS, REACH)
    both = (scan.distances > 0) & (expected > 0)
    by_hand = math.sqrt(np.mean((1 - expected[both] / scan.distances[both]) ** 2))
    assert scan.errors(office, [moved])[0] == pytest.approx(by_hand)


@pytest.mark.parametrize("nothing", [-1.0, math.nan, math.inf])
def test_scan_of_nothing_fits_nowhere(nothing: float, office: LineMap, places: list[Pose]) -> None:
    empty = Scan(np.full(RAYS, nothing), HALF_TURN, REACH)
    assert empty.errors(office, places).tolist() == [math.inf] * len(places)
    for estimator in (RandomSearch(), ParticleFilter()):
        estimator.begin(office, places[0], random.Random(1))
        assert not estimator.correct(empty).found
        assert math.dist(estimator.pose[:2], places[0][:2]) < 0.1


def test_range_finder_away_from_the_middle(office: LineMap, places: list[Pose]) -> None:
    place = (0.1, -0.05)
    scan = scan_at(office, composed(places[0], (*place, 0.0)), 0.0)
    assert Scan(scan.distances, HALF_TURN, REACH, place).errors(office, [places[0]])[0] < 1e-12


def test_few_rays_are_those_of_all(office: LineMap, places: list[Pose]) -> None:
    whole = scan_at(office, places[0], 0.0)
    few = whole.thinned(30)
    assert len(few.distances) == 30 and few.errors(office, [places[0]])[0] < 1e-12


@pytest.mark.parametrize("kind", [RandomSearch, ParticleFilter])
def test_estimator_follows_and_says_when_it_is_lost(
    kind: type[RandomSearch] | type[ParticleFilter], office: LineMap, places: list[Pose]
) -> None:
    """Ten robots are carried away: after two scans that fit nowhere they are lost; where the place is much like the
    other, they may not notice."""
    lost = 0
    for number in range(10):
        before, after = places[2 * number], places[2 * number + 1]
        estimator: Estimator = kind()
        estimator.begin(office, before, random.Random(number))
        first = estimator.correct(scan_at(office, before, seed=number))
        assert first.found and math.dist(first.pose[:2], before[:2]) < 0.06
        estimator.move((0.0, 0.0, 0.1))
        turned = composed(before, (0.0, 0.0, 0.1))
        assert math.dist(estimator.pose[:2], turned[:2]) < 0.06
        assert abs(math.remainder(estimator.pose[2] - turned[2], 2 * math.pi)) < 0.08
        two = [estimator.correct(scan_at(office, after, seed=number)) for _ in range(2)]
        lost += not any(one.found for one in two)
    assert lost >= 8


def test_random_search_does_not_believe_a_fit_far_away(office: LineMap, places: list[Pose]) -> None:
    """It may walk from 0.4 m away to the true pose; but so it may walk to any place that looks much like it."""
    walked = 0
    for number, pose in enumerate(places[:20]):
        for estimator, limit in ((RandomSearch(), 0.3), (RandomSearch(farthest=(1.0, 1.0)), 1.0)):
            estimator.begin(office, (pose[0] + 0.4, pose[1], pose[2]), random.Random(number))
            before = estimator.pose
            estimate = estimator.correct(scan_at(office, pose, seed=number))
            moved = math.dist(estimate.pose[:2], before[:2])
            assert moved <= limit and estimate.found == (moved > 0)
            walked += moved > 0.35
    assert walked


def test_random_search_looks_wider_after_a_scan_that_did_not_fit(
    office: LineMap, places: list[Pose], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And keeps the pose that it had; and narrowly again after one that did."""
    errors, asked = iter((1.0, 1.0, 0.01, 0.01)), []

    def searched(scan: Scan, plan: LineMap, start: Pose, source: random.Random, **terms: Any) -> Match:
        asked.append((terms["box"][0], terms["tries"]))
        return Match((start[0] + 0.1, *start[1:]), next(errors), [])

    monkeypatch.setattr(estimators, "search_pose", searched)
    estimator = RandomSearch()
    estimator.begin(office, places[0], random.Random(1))
    found = [estimator.correct(scan_at(office, places[0])) for _ in range(4)]
    assert asked == [(0.1, 200), (0.3, 500), (0.3, 500), (0.1, 200)]
    assert [one.found for one in found] == [False, False, True, True]
    assert [one.pose[0] - places[0][0] for one in found] == pytest.approx([0.0, 0.0, 0.1, 0.2])


def test_particle_filter_finds_itself_again(office: LineMap, places: list[Pose]) -> None:
    again = 0
    for number in range(10):
        estimator = ParticleFilter()
        estimator.begin(office, places[2 * number], random.Random(number))
        estimator.correct(scan_at(office, places[2 * number]))
        after = places[2 * number + 1]
        found = (estimator.correct(scan_at(office, after, seed=k)) for k in range(20))
        again += any(one.found and math.dist(one.pose[:2], after[:2]) < 0.1 for one in found)
    assert again >= 6


# ---- on a robot ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [3, pytest.param(10, marks=pytest.mark.soak)])
def test_patrols_stay_near_the_truth_by_localization_alone(number: int) -> None:
    """Figs. 6.14 and 6.15, as E55 has them, at other seeds. Odometry goes on without a jump."""
    runs = [patrolled(seed, "roller", 120.0, 5.0, RandomSearch()) for seed in trial_seeds(20, number)]
    assert np.median([run.odometry.max() for run in runs]) >= 0.5
    assert np.median([run.localization.max() for run in runs]) <= 0.2
    assert max(np.abs(np.diff(run.odometry)).max() for run in runs) < 0.02
    assert min(run.jumps.max() for run in runs) > 0.02


def test_particle_filter_keeps_the_error_of_a_patrol_small() -> None:
    run = patrolled(3, "roller", 60.0, 5.0, ParticleFilter())
    assert run.localization.max() < run.odometry.max() / 2 and run.jumps.max() > 0.02
