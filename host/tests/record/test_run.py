"""Runs that are equal have equal figures and one hash, however they were recorded and watched; of a run that is not
recorded each figure is right, or None."""

from __future__ import annotations

import hashlib
import inspect
import json
import struct
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

import boebot
from boebot.behaviors import Avoid, Wander
from boebot.brain import Brain, Utility
from boebot.cli.ending import five_rows
from boebot.cognition import near
from boebot.live.live_view import LiveView
from boebot.record import record
from boebot.record.run import FIGURES, SHARE
from boebot.record.run_folder import RunFolder
from boebot.result import RunResult, read_run
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot.view.tables import write_summary

ROBOTS = ("arsim", "shieldbot-charging")  # without a board, and with one that has slow devices
COMPUTED = (cached_property, property)


def mind() -> Brain:
    return Brain([Wander(utility=Utility(b=0.5)), Avoid(utility=Utility(b=-1.0, w={"near": 3.0}))], [near()])


def digest(run: RunResult) -> str:
    """As docs/reference/run-files.md defines it."""
    parts = b""
    for stream in ("truth", "command"):
        rows = run.record.rows(stream)
        parts += hashlib.sha256(b"".join(struct.pack("<d", time_s) for time_s, _ in rows)).digest()
        parts += hashlib.sha256(b"".join(data for _, data in rows)).digest()
    return hashlib.sha256(parts).hexdigest()


@pytest.mark.parametrize("robot", ROBOTS)
def test_equal_runs_have_equal_tables_and_one_hash(robot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In memory and on disk, in whichever groups rows came, watched or not."""
    request = Request.single(mind(), robot, seconds=1, seed=2)
    plain = execute(request)
    assert plain.hash == digest(plain)
    monkeypatch.setattr(record, "EACH_S", 0.0)  # each step is a group
    with RunFolder(tmp_path) as folder:
        grouped = execute(request, folder=folder)
    read = read_run(tmp_path)
    assert isinstance(read, RunResult) and len(list(read.record.groups())) >= 20
    view = LiveView(lambda url: None, speed=None)
    watched = execute(request, onlooker=view)
    view.close()
    summaries = []
    for run in (plain, grouped, read, watched):
        assert run.table() == plain.table()
        write_summary(run, tmp_path / "summary.json")
        summaries.append(json.loads((tmp_path / "summary.json").read_text()))
        assert summaries[-1].pop("wall_clock").keys() == run.wall_clock().keys()
    assert summaries == [summaries[0]] * 4 and summaries[0]["hash"] == plain.hash
    assert boebot.run(mind(), robot, seconds=1, seed=3).hash != plain.hash


def test_each_robot_of_a_run_has_its_hash() -> None:
    members = [boebot.Member(brain=mind(), robot="arsim") for _ in range(2)]
    one, other = boebot.run_together(members, seconds=2).robots
    assert one.hash == digest(one) and other.hash == digest(other) != one.hash


@pytest.mark.parametrize("robot", [*ROBOTS, "rover"])
def test_figures_are_those_of_every_table_with_their_types(robot: str, tmp_path: Path) -> None:
    asked: dict[str, Any] = {"robot": robot, "seconds": 1.0, "without": ["slip"]}
    if robot == "rover":  # a program drives it
        (tmp_path / "stay.hex").write_text(":02000000FFCF30\n:00000001FF\n")
        asked |= {"brain": tmp_path / "stay.hex"}
    else:
        asked |= {
            "brain": mind(),
            "parameters": {"avoid.turn": 0.4},
            "faults": ["host.slow=0.1@0.2"] * (robot != "arsim"),
        }
    run = execute(Request.single(**asked))
    table = run.table()
    behaviors = () if run.brain_names is None else run.brain_names.behaviors
    assert table.keys() == FIGURES.keys() | {f"{name}{SHARE}" for name in behaviors}
    for name, value in table.items():
        assert value is None or type(value) is FIGURES.get(name, float), name


@pytest.mark.parametrize("robot", ROBOTS)
def test_of_an_unrecorded_run_each_figure_is_right_or_none(robot: str) -> None:
    recorded, unrecorded = (boebot.run(mind(), robot, seconds=3, record=kept) for kept in (True, False))
    expected, found = recorded.table(), unrecorded.table()
    assert found.keys() == expected.keys()
    assert {name: value for name, value in found.items() if value not in (None, expected[name])} == {}
    assert (found["steps"], found["run_time_s"], found["ticks"], found["wander_share"]) == (60, 3.0, None, None)
    assert (
        unrecorded.summary()
        == f"brain on {robot} ({recorded.board}) in {expected['arena']}, 3.0 s, distance unknown, seed 1, complete"
    )
    for name, kind in inspect.getmembers_static(RunResult, lambda member: isinstance(member, COMPUTED)):
        value = getattr(unrecorded, name)
        if isinstance(value, int | float) and name not in ("is_recorded", "has_truth", "real_time_factor"):
            assert value == getattr(recorded, name), (name, kind)


@pytest.mark.parametrize(("robot", "fell"), [("roller-charging", 0.008), ("shieldbot-charging", None), ("arsim", None)])
def test_charge_at_the_end_is_that_of_the_last_voltage(robot: str, fell: float | None, tmp_path: Path) -> None:
    run = boebot.run(lambda robot: robot.stop(), robot, arena="empty", seconds=4, out=tmp_path)
    charge = run.battery_charge
    if robot == "arsim":
        assert charge is None, "it has no battery"
        return
    assert charge is not None
    if fell is None:  # its capacitors are 0.6 full as the run begins; the board draws less than 0.2 A
        assert run.robot.supply is not None
        assert 0.6 - 0.2 * 4 / run.robot.supply.capacity_as < charge < 0.6
    else:
        assert charge == pytest.approx(1 - fell, abs=1e-3), "it falls by 0.002 in a second"
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["battery_charge"] == read_run(tmp_path).table()["battery_charge"] == round(charge, 3)
    assert f"battery {charge:.0%} full at the end" in dict(five_rows(run))["way"]
