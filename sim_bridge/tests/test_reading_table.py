"""Noise by a table of readings (rule S3): its statistics by itself and in vehicles' sensors, its files, wrong tables.

Truth: moments of what the table was filled with, and of a bilinear mixture of independent draws.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from scipy import stats

from boebot.arenas import Arena
from boebot.errors import RobotError
from sim_bridge.reading_table import ReadingTable
from sim_bridge.tests.simulated import arena_of
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, beam

DISTANCES, ANGLES = [0.2, 0.4, 0.6, 0.8], [0.0, 0.3, 0.6]
SIGMA = 0.02


def clean(d: float, a: float) -> float:
    return (0.03 / d**2 + 0.1) * math.cos(a)


def filled(seed: int = 4, count: int = 2000) -> ReadingTable:
    """Fed from S2 data: S(d, angle) (1 + 0.02 xi)."""
    draw = np.random.default_rng(seed)
    samples = [[clean(d, a) * (1 + SIGMA * draw.standard_normal(count)) for a in ANGLES] for d in DISTANCES]
    return ReadingTable(DISTANCES, ANGLES, samples)


def wall() -> Arena:
    """At x = 2 m, across the way."""
    return arena_of([(2.0, -50), (3.0, -50), (3.0, 50), (2.0, 50)])


def standing(model: VehicleModel, pose: tuple[float, float, float], name: str, count: int = 4000, seed: int = 1) -> Any:
    """Readings of a vehicle that stands still."""
    model.dc_motors()
    vehicle = Vehicle(model, wall(), pose=pose, seed=seed)
    found = np.empty(count)
    for step in range(count):
        found[step] = vehicle[name]
        vehicle.step(0.0, 0.0)
    return found


# ---- its statistics --------------------------------------------------------------------------------------------------


def test_e70_a_table_fed_from_s2_data_reproduces_its_mean_and_spread() -> None:
    """Within 5 %, in every bin, by the Python face."""
    table = filled()
    for d in DISTANCES:
        for a in ANGLES:
            reads = table.readings(d, a, 4000, seed=9)
            assert reads.mean() == pytest.approx(clean(d, a), rel=0.05)
            assert reads.std() == pytest.approx(SIGMA * clean(d, a), rel=0.05)


def test_between_bins_it_is_the_mixture_of_four_independent_draws() -> None:
    """Mean sum w S, variance sum (w sigma S)^2 with the bilinear weights w; bounds are four standard errors."""
    reads = filled().readings(0.45, 0.1, 20_000)
    along, across = 0.25, 1 / 3
    weights = {(0.4, 0.0): (1 - along) * (1 - across), (0.4, 0.3): (1 - along) * across}
    weights |= {(0.6, 0.0): along * (1 - across), (0.6, 0.3): along * across}
    mean = sum(w * clean(*place) for place, w in weights.items())
    spread = SIGMA * math.sqrt(sum((w * clean(*place)) ** 2 for place, w in weights.items()))
    slack = SIGMA * clean(0.4, 0.0) / math.sqrt(2000)  # of the means of the bins, which were drawn themselves
    assert reads.mean() == pytest.approx(mean, abs=4 * slack)
    assert reads.std() == pytest.approx(spread, rel=4 / math.sqrt(2 * 2000))


def test_draws_have_the_samples_own_distribution() -> None:
    """A sensor that reads 1 in nine of ten cases and 5 in the tenth, at a bin: chi-squared at p = 0.001."""
    table = ReadingTable([0.5], [0.0], [[[1.0] * 9 + [5.0]]])
    reads = table.readings(0.5, 0.0, 5000)
    high = int((reads == 5.0).sum())
    assert set(np.unique(reads)) == {1.0, 5.0}
    assert stats.chisquare([high, 5000 - high], [500, 4500]).pvalue > 0.001


def test_draws_follow_the_seed_and_do_not_follow_each_other() -> None:
    table = filled()
    one, again, other = (table.readings(0.5, 0.2, 2000, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one, again) and not np.array_equal(one, other)
    assert abs(np.corrcoef(one[:-1], one[1:])[0, 1]) < 4 / math.sqrt(2000)


# ---- in a vehicle ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_a_vehicles_sensor_reads_what_the_real_one_read(angle: float) -> None:
    """0.4 m from the wall along the beam, met at `angle` to its normal: mean and spread of that bin within 5 %."""
    model = VehicleModel(ARSIM_BODY | {"radius": 0.1})
    model.sensor("table", "seen", table=filled(), beam=beam(), reach=1.0)
    reads = standing(model, (2 - 0.4 * math.cos(angle), 0.0, angle), "seen")
    assert reads.mean() == pytest.approx(clean(0.4, angle), rel=0.05)
    assert reads.std() == pytest.approx(SIGMA * clean(0.4, angle), rel=0.05)


def test_without_noise_it_reads_the_means() -> None:
    table = filled()
    model = VehicleModel(ARSIM_BODY, noise=False)
    model.sensor("table", "seen", table=table, beam=beam(x=0.2), reach=1.0)
    reads = standing(model, (1.2, 0, 0), "seen", 5)
    mean = float(np.mean([table.readings(0.6, 0.0, 20_000, seed=seed).mean() for seed in range(4)]))
    assert len(set(reads)) == 1 and reads[0] == pytest.approx(mean, rel=4 * SIGMA / math.sqrt(80_000))


def test_two_sensors_keep_what_makes_them_unlike() -> None:
    weak, strong = (ReadingTable([0.1, 1.0], [0.0], [[[0.9 * gain]], [[0.1 * gain]]]) for gain in (0.8, 1.0))
    model = VehicleModel(ARSIM_BODY)
    model.sensor("infrared_proximity", "left", table=weak, beam=beam(x=0.2), range=1.0)
    model.sensor("infrared_proximity", "right", table=strong, beam=beam(x=0.2), range=1.0)
    model.dc_motors()
    vehicle = Vehicle(model, wall(), pose=(1.0, 0, 0))
    assert vehicle["left"] == pytest.approx(0.8 * vehicle["right"]) and 0.1 < vehicle["left"] < 0.8


def test_nothing_in_reach_is_0_for_infra_red_and_d_max_for_sonar() -> None:
    table = ReadingTable([0.1, 3.0], [0.0], [[[0.1]], [[3.0]]])
    model = VehicleModel(ARSIM_BODY)
    model.sensor("infrared_proximity", "ir", table=table, beam=beam(), range=0.5)
    model.sensor("sonar", "near", table=table, beam=beam(), range_maximum=0.5)
    model.sensor("sonar", "far", table=table, beam=beam(), range_maximum=3.0, period=0.05)
    model.dc_motors()
    vehicle = Vehicle(model, wall(), pose=(1.0, 0, 0))
    assert (vehicle["ir"], vehicle["near"]) == (0.0, 0.5)
    assert vehicle["far"] == pytest.approx(1.0), "the table is the identity"
    assert model.looks["near"][1] == 0.5


def test_of_several_rays_the_nearest_counts() -> None:
    """Rays at -0.5, 0 and 0.5 rad; turned by 0.5 rad the right one meets the wall straight on, at 1 m."""
    table = ReadingTable([0.5, 1.5], [0.0, 0.6], [[[0.5], [10.5]], [[1.5], [11.5]]])  # d, and 10 more at 0.6 rad
    model = VehicleModel(ARSIM_BODY)
    model.sensor("table", "seen", table=table, beam=beam(opening=1.0, rays=3), reach=5.0)
    model.dc_motors()
    assert Vehicle(model, wall(), pose=(1.0, 0, 0.5))["seen"] == pytest.approx(1.0)
    assert Vehicle(model, wall(), pose=(1.0, 0, 0.8))["seen"] == pytest.approx(1 / math.cos(0.3) + 10 * 0.3 / 0.6)


# ---- files, wrong tables ---------------------------------------------------------------------------------------------


def test_a_file_of_recorded_readings(tmp_path: Path) -> None:
    file = tmp_path / "ir-7.csv"
    file.write_text("distance_m,angle_rad,reading\n0.5,0,1.0\n0.5,0,3.0\n0.2,0,7\n\n0.2,0.5,8\n0.5,0.5,9\n")
    table = ReadingTable.load(file)
    assert (table.distances, table.angles) == ([0.2, 0.5], [0.0, 0.5])
    assert set(table.readings(0.5, 0, 100)) == {1.0, 3.0} and set(table.readings(0.1, 0.9, 10)) == {8.0}


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", r"ir\.csv:1: expected the columns distance_m, angle_rad, reading"),
        ("d,a,r\n", r"ir\.csv:1: expected the columns"),
        ("distance_m,angle_rad,reading\n0.5,0,x\n", r"ir\.csv:2: reading is 'x'; expected a finite number"),
        ("distance_m,angle_rad,reading\n0.5,nan,1\n", r"ir\.csv:2: angle_rad is 'nan'; expected a finite number"),
        ("distance_m,angle_rad,reading\n0.5,0\n", r"ir\.csv:2: 2 columns; expected 3"),
        ("distance_m,angle_rad,reading\n0.5,0,1\n0.6,1,1\n", "no reading at 0.5 m and 1 rad; expected some"),
        ("distance_m,angle_rad,reading\n", "distances has 0 entries; expected bins"),
        ("\0", "expected the columns|cannot be read"),
    ],
)
def test_wrong_files_get_a_sentence(tmp_path: Path, text: str, what: str) -> None:
    file = tmp_path / "ir.csv"
    file.write_text(text)
    with pytest.raises(RobotError, match=what):
        ReadingTable.load(file)
    with pytest.raises(RobotError, match=r"none\.csv cannot be read"):
        ReadingTable.load(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("distances", "angles", "samples", "what"),
    [
        ([0.2, 0.2], [0.0], [[[1]], [[1]]], r"distances\[1\] is 0.2; expected more than distances\[0\], 0.2"),
        ([], [0.0], [], "distances has 0 entries; expected bins"),
        (3, [0.0], [], "distances is 3; expected a list"),
        ([0.2], "ab", [], "angles is 'ab'; expected a list"),
        ([0.2], [math.nan], [[[1]]], r"angles\[0\] is nan; expected a finite number"),
        ([0.2, 0.3], [0.0], [[[1]]], "samples has 1 entries; expected 2, one for each distance"),
        ([0.2], [0.0, 1.0], [[[1]]], r"samples\[0\] has 1 entries; expected 2, one for each angle"),
        ([0.2], [0.0], [[[]]], r"samples\[0\]\[0\] has 0 entries; expected readings"),
        ([0.2], [0.0], [[1.0]], r"samples\[0\]\[0\] is 1\.0; expected a list"),
        ([0.2], [0.0], [[[1.0, math.inf]]], r"samples\[0\]\[0\]\[1\] is inf; expected a finite number"),
        ([0.2], [0.0], [[["x"]]], r"samples\[0\]\[0\]\[0\] is 'x'; expected a finite number"),
    ],
)
def test_wrong_tables_get_a_sentence(distances: Any, angles: Any, samples: Any, what: str) -> None:
    with pytest.raises(RobotError, match=f"table: {what}"):
        ReadingTable(distances, angles, samples)


def test_a_sensor_with_a_wrong_table_gets_a_sentence() -> None:
    model, table, none = VehicleModel(ARSIM_BODY), ReadingTable([0.5], [0.0], [[[1.0]]]), cast(Any, 3)
    for add, what in (
        (
            lambda: model.sensor("infrared_proximity", "a", table=none, beam=beam(), range=1.0),
            "table is 3; expected a ReadingTable",
        ),
        (
            lambda: model.sensor("infrared_proximity", "a", table=table, beam=beam(), range=1.0, c1=0.03),
            "there is no key 'c1'",
        ),
        (
            lambda: model.sensor("infrared_proximity", "a", table=table, beam=beam()),
            "range is None; expected a number more than",
        ),
        (
            lambda: model.sensor("sonar", "a", table=table, range_maximum=1.0),
            "the key 'beam' is missing; expected a mapping",
        ),
        (
            lambda: model.sensor("table", "a", table=table, beam=beam(rays=0), reach=1.0),
            "rays is 0; expected a whole number from 1",
        ),
        (
            lambda: model.sensor("table", "a", table=table, beam=beam(), reach=1.0, none=math.nan),
            "none is nan; expected a finite",
        ),
        (lambda: table.readings(0.5, math.nan, 3), "angle is nan"),
        (lambda: table.readings(0.5, 0.0, -1), "count is -1; expected a whole number from 0"),
    ):
        with pytest.raises(RobotError, match=what):
            add()
    assert not model.names
