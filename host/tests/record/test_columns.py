"""Tests of the overview of a run: by windows of any size it is the same as at once, and few ticks stand for many."""

from __future__ import annotations

import csv
import dataclasses
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.record import columns
from boebot.record.overview import _Walk
from boebot.record.truth import Pose, interpolated, touch_indices
from boebot.result import RunResult
from boebot.view import tables

RUNS = ("shieldbot-basic", "shieldbot", "shieldbot-charging", "arsim")


@cache
def run_of(robot: str, seconds: float = 40) -> RunResult:
    result = boebot.run("wander", robot=robot, arena="showcase", seconds=seconds, seed=7)
    assert result.overview.columns.time[-1] == pytest.approx(seconds)
    return result


@pytest.mark.parametrize("robot", RUNS)
@pytest.mark.parametrize(("ticks", "seconds"), [(1, 4), (23, 40), (1000, 40)])
def test_windows_of_any_size_give_the_same(
    robot: str, ticks: int, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = run_of(robot, seconds)
    parts = dataclasses.replace(whole)
    monkeypatch.setattr(columns, "TICKS", ticks)
    for name in ("true_contacts", "whisker_touches", "overruns", "dead_man_stops", "fallback_takeovers"):
        assert getattr(parts.overview, name) == getattr(whole.overview, name), name
    for name in ("true_distance", "odometry_distance", "slow_reading_age"):
        assert getattr(parts.overview, name) == pytest.approx(getattr(whole.overview, name), abs=1e-9), name
    for name in ("true_pose", "odometry"):
        one, other = getattr(parts.overview.columns, name), getattr(whole.overview.columns, name)
        assert (one is None) == (other is None)
        if one is not None:
            assert np.allclose(dataclasses.astuple(one), dataclasses.astuple(other), atol=1e-9, rtol=0), name
    assert np.array_equal(parts.overview.contact_places, whole.overview.contact_places)
    one, other = parts.overview.columns.contact, whole.overview.columns.contact
    assert one is not None and other is not None and np.array_equal(one, other)


def columns_of(path: Path) -> dict[str, list[str]]:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return {name: list(cells) for name, *cells in zip(header, *rows, strict=True)}


@pytest.mark.parametrize("robot", RUNS)
def test_run_csv_by_windows_is_the_same(robot: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    whole, at_once, by_windows = run_of(robot), tmp_path / "at_once.csv", tmp_path / "by_windows.csv"
    tables.write_run(whole, at_once)
    monkeypatch.setattr(columns, "TICKS", 130)
    tables.write_run(whole, by_windows)
    expected = tables.columns(whole)
    assert columns_of(at_once) == expected and len(expected["tick"]) == whole.record.ticks
    found = columns_of(by_windows)
    assert list(found) == list(expected)
    for name, cells in found.items():
        if name.startswith("odometry_"):  # put together of pieces: the last digit may differ
            assert np.allclose(np.array(cells, float), np.array(expected[name], float), atol=1.1e-5, rtol=0), name
        else:
            assert cells == expected[name], name


@pytest.mark.parametrize("robot", RUNS)
def test_figures_are_those_of_the_whole_arrays(robot: str) -> None:
    result = run_of(robot)
    few, truth = result.overview, result.truth
    assert truth is not None and result.true_pose is not None
    begin, end = result.clock_offset, result.clock_offset + float(result.series.time[-1])
    inside = (truth.time >= begin) & (truth.time <= end)
    assert few.true_contacts == len(touch_indices(truth.time[inside], truth.contact[inside]))
    way = interpolated(truth.time, Pose(truth.x, truth.y, truth.heading), result.series.time + begin)
    assert few.true_distance == pytest.approx(way.length)
    assert few.columns.true_pose is not None and np.array_equal(few.columns.true_pose.x, result.true_pose.x)


@pytest.mark.parametrize("robot", RUNS)
def test_few_ticks_stand_for_many(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run_of(robot)
    few = dataclasses.replace(whole)
    monkeypatch.setattr("boebot.record.overview.POINTS", 300)
    monkeypatch.setattr(columns, "TICKS", 900)
    stride = -(-whole.record.ticks // 300)
    kept = np.unique(np.append(np.arange(0, whole.record.ticks, stride), whole.record.ticks - 1))
    thin, every = few.overview.columns, whole.series
    assert len(thin) == len(kept) <= 301 and few.table() == pytest.approx(whole.table(), nan_ok=True)
    assert np.array_equal(thin.time, every.time[kept]) and np.array_equal(thin.raw["tick"], every.raw["tick"][kept])
    assert np.array_equal(thin.command, every.command[kept])
    for mine, theirs in zip(thin.readouts(), every.readouts(), strict=True):
        assert np.array_equal(mine.values, theirs.values[kept], equal_nan=True), mine.device
        assert np.allclose(mine.ages, theirs.ages[kept], equal_nan=True, atol=1e-9), mine.device


def test_long_time_between_two_ticks_takes_no_memory() -> None:
    """As a record claims it that no run has left; a place for each 0.1 s would be 72 TB."""
    walk = _Walk(0.1)
    time, x = np.array([0.0, 0.1, 0.2, 1e12]), np.array([0.0, 1.0, 2.0, 5.0])
    walk.add(time, Pose(x, np.zeros(4), np.zeros(4)), is_last=True)
    assert walk.length == 5.0


def test_line_sensors_are_in_the_table(tmp_path: Path) -> None:
    """Their messages are of another kind than those of the other slow devices."""
    result = boebot.run("wander", robot="shieldbot-line", arena="track", seconds=1, seed=7)
    tables.write_run(result, tmp_path / "run.csv")
    cells = columns_of(tmp_path / "run.csv")["line_middle_decay_time_s"]
    assert cells[-1] == f"{result.series.number('line_middle', 'decay_time')[-1]:.6f}"
    assert result.table()["slow_readings"] == result.record.count("line_telemetry") > 0
