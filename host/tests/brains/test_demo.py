"""The demonstration brain, on the native board in its arena: what it chooses, when, and where it charges."""

from __future__ import annotations

import numpy as np
import pytest

import boebot
from boebot.brain import Brain
from boebot.brains import load_brain
from boebot.record.brain_record import BrainRecord
from boebot.result import RunResult


@pytest.fixture(scope="module")
def result() -> RunResult:
    return boebot.run("demo", on="native", seconds=60)


@pytest.fixture(scope="module")
def record(result: RunResult) -> BrainRecord:
    assert result.brain_record is not None
    return result.brain_record


def variable(record: BrainRecord, name: str) -> np.ndarray:
    return np.asarray(record.values[:, record.names.variables.index(name)])


@pytest.mark.parametrize(
    ("near", "contact", "energy", "charging"), [(0, 0, 1.0, 0), (1, 0, 0.5, 0), (0.4, 1, 0.2, 0), (0, 0, 0.7, 1)]
)
def test_weights_are_those_that_were_chosen(near: float, contact: float, energy: float, charging: float) -> None:
    """tanh 0.5; b -1, 3 near, 4 contact; 1.5 - 3.2 E + 1.9 on_charger."""
    brain = load_brain("demo").brain
    assert isinstance(brain, Brain)
    z = {"near": near, "contact": contact, "low": 1 - energy, "charging": charging}
    arguments = {
        process.name: process.utility.b + sum(weight * z[name] for name, weight in process.utility.w.items())
        for process in brain.processes
    }
    assert arguments["wander"] == 0.5
    assert arguments["avoid"] == pytest.approx(-1 + 3 * near + 4 * contact)
    assert arguments["charge"] == pytest.approx(1.5 - 3.2 * energy + 1.9 * charging)


def test_wander_avoid_and_charge_are_all_seen(result: RunResult, record: BrainRecord) -> None:
    assert result.error is None
    shares = record.shares(result.run_time)
    assert all(shares[name] >= 0.02 for name in ("wander", "avoid", "charge")), shares
    assert sum(shares.values()) == pytest.approx(1.0)


def test_it_charges_on_the_station_and_leaves_it_full(result: RunResult, record: BrainRecord) -> None:
    """Charging begins to count in the argument 1.5 - 3.2 E + 1.9 once the voltage has risen: then the robot's centre is
    on the station (the noticing lags its arrival). It leaves when the argument falls below 0.5: E = 2.9 / 3.2 or more,
    for the utility lags behind, and E grows meanwhile."""
    assert result.true_pose is not None and result.truth is not None and result.truth.plan.described.charger is not None
    charger, low = result.truth.plan.described.charger, variable(record, "low")
    behavior = [record.names.behaviors[index] for index in record.motor]
    on = np.flatnonzero(variable(record, "charging") > 0)
    assert len(on)
    arrived, left = int(on[0]), next(k for k in range(on[0], len(low)) if behavior[k] != "charge")
    tick = int(np.searchsorted(result.series.time, record.time[arrived]))
    x, y = result.true_pose.x[tick], result.true_pose.y[tick]
    assert np.hypot(x - charger.x_m, y - charger.y_m) <= charger.radius_m
    assert low[arrived] > 1 - 1 / 3.2, "it came because 1.5 - 3.2 E exceeds 0.5"
    assert 1 - low[left] >= 2.9 / 3.2
    assert behavior[left] == "wander"


def test_every_switch_has_the_greater_utility(record: BrainRecord) -> None:
    chosen = record.utilities[:, : len(record.names.behaviors)]
    assert np.array_equal(record.motor, chosen.argmax(axis=1))
