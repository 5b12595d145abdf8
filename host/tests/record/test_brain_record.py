"""What a run keeps of a brain of processes: its record, and the files, figures and picture that come of it."""

from __future__ import annotations

import csv
import json
import math
import struct
from itertools import pairwise
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

import boebot
from boebot.brain import Brain, CognitiveProcess, MotorBehavior, StateVariable, Utility
from boebot.errors import BrainError
from boebot.record.brain_record import BrainNames, BrainRecord, append_brain, read_brain
from boebot.record.record import Record
from boebot.result import RunResult, read_run
from boebot.robot import Robot
from boebot.view import picture, style
from steps import Stepped

PULSE = (2.0, 4.0)  # s; when z is 1


class Ahead(MotorBehavior):
    def step(self, robot: Robot) -> None:
        robot.drive(0.3, 0.3)


class Spin(MotorBehavior):
    def step(self, robot: Robot) -> None:
        robot.drive(-0.3, 0.3)


class Kicker(CognitiveProcess):
    """Kicks "ahead" once, at 6 s."""

    def enter(self, robot: Robot) -> None:
        self.kicked = False

    def step(self, robot: Robot) -> None:
        if robot.time >= 6.0 and not self.kicked:
            self.kick("ahead", -3.0)
            self.kicked = True


class Witness(CognitiveProcess):
    """Notes when it steps."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.seen: list[float] = []

    def step(self, robot: Robot) -> None:
        self.seen.append(robot.time)


UTILITIES = {
    "ahead": Utility(b=0.5),
    "spin": Utility(b=-1.0, w={"pulse": 3.0}, tau=0.3),
    "kicker": Utility(b=1.0),
    "witness": Utility(b=-0.5, w={"pulse": 1.5}, tau=0.1, c=2.0),
}


def brain_of(witness: Witness) -> Brain:
    pulse = StateVariable("pulse", lambda robot: float(PULSE[0] <= robot.time < PULSE[1]))
    others = (Ahead(utility=UTILITIES["ahead"]), Spin(utility=UTILITIES["spin"]))
    return Brain([*others, Kicker(utility=UTILITIES["kicker"]), witness], [pulse])


@pytest.fixture(scope="module")
def witness() -> Witness:
    return Witness(utility=UTILITIES["witness"])


@pytest.fixture(scope="module")
def result(witness: Witness) -> RunResult:
    """On a robot without a board, whose steps are exactly a period apart."""
    return boebot.run(brain_of(witness), robot="arsim", arena="empty", seconds=10)


@pytest.fixture(scope="module")
def folder(result: RunResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("composed")
    assert {path.name for path in result.save(folder, csv=True)} == {path.name for path in folder.iterdir()}
    return folder


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def column(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows])


def record_of(result: RunResult) -> BrainRecord:
    assert result.brain_record is not None
    return result.brain_record


def test_brain_csv_has_the_columns_of_its_page(result: RunResult, folder: Path) -> None:
    rows = rows_of(folder / "brain.csv")
    assert len(rows) == result.steps == 200
    expected = ["time_s", "active", "z_pulse"]
    expected += [f"{kind}_{name}" for kind in ("u", "gamma") for name in UTILITIES]
    assert list(rows[0]) == [*expected, "active_kicker", "active_witness"]
    assert set(column(rows, "time_s")) <= set(column(rows_of(folder / "run.csv"), "time_s")), "the same clock"


def test_brain_csv_follows_the_equations(folder: Path) -> None:
    """(8.4), (8.5) and (8.6), from one row to the next: z is held over the step."""
    rows = rows_of(folder / "brain.csv")
    elapsed = np.diff(column(rows, "time_s"))
    z = column(rows, "z_pulse")
    assert np.array_equal(z == 1, [PULSE[0] <= time < PULSE[1] for time in column(rows, "time_s")])
    for name, utility in UTILITIES.items():
        u, gamma = column(rows, f"u_{name}"), column(rows, f"gamma_{name}")
        decayed = gamma[:-1] * np.exp(-elapsed / utility.tau_gamma)
        settled = np.tanh(utility.c * (utility.w.get("pulse", 0.0) * z[1:] + utility.b + decayed))
        assert u[0] == pytest.approx(math.tanh(utility.c * utility.b), abs=1e-6)
        assert np.allclose(u[1:], settled + (u[:-1] - settled) * np.exp(-elapsed / utility.tau), atol=3e-6)
    assert gamma_kick(rows) == [(6.0, -3.0)]


def gamma_kick(rows: list[dict[str, str]]) -> list[tuple[float, float]]:
    """When the gamma parameter of "ahead" moved away from 0, and to what."""
    time, gamma = column(rows, "time_s"), column(rows, "gamma_ahead")
    away = np.flatnonzero(np.diff(np.abs(gamma)) > 0) + 1
    return [(float(time[index]), float(gamma[index])) for index in away]


def test_cognitive_process_is_active_in_the_steps_in_which_it_stepped(witness: Witness, folder: Path) -> None:
    rows = rows_of(folder / "brain.csv")
    active = [float(row["time_s"]) for row in rows if row["active_witness"] == "1"]
    assert 0 < len(active) < len(rows)
    assert active == pytest.approx(witness.seen)
    assert all(row["active_kicker"] == "1" for row in rows)


def test_active_behavior_is_that_of_the_greatest_utility(folder: Path) -> None:
    rows = rows_of(folder / "brain.csv")
    better = column(rows, "u_spin") > column(rows, "u_ahead")
    assert [row["active"] for row in rows] == ["spin" if spin else "ahead" for spin in better]
    assert 30 < better.sum() < 100


def test_switches_csv_says_what_when_and_why(result: RunResult, folder: Path) -> None:
    """From tanh(-1) at rest, u of spin grows as s + (u_0 - s) e^(-t/0.3), s = tanh 2, and passes tanh 0.5 after
    0.3 ln((s - u_0) / (s - tanh 0.5)) = 0.363 s: at the eighth step in which z is 1, the first being 0.05 s long."""
    rows = rows_of(folder / "switches.csv")
    assert list(rows[0]) == ["time_s", "off", "on", "reason"]
    begun = [row for row in rows if float(row["time_s"]) == 0]
    assert [(row["off"], row["on"]) for row in begun] == [("", "ahead"), ("", "kicker")]
    spin = next(row for row in rows if row["on"] == "spin")
    after = 0.3 * math.log((math.tanh(2) - math.tanh(-1)) / (math.tanh(2) - math.tanh(0.5)))
    assert float(spin["time_s"]) == pytest.approx(PULSE[0] + 0.05 * (math.ceil(after / 0.05) - 1))
    assert spin["off"] == "ahead"
    assert spin["reason"].startswith("spin 0.") and "(pulse +3.00, b -1.00), above ahead 0.462" in spin["reason"]
    assert len(rows) == len(record_of(result).switches)


def test_figures_are_those_of_the_files(result: RunResult, folder: Path) -> None:
    active = [row["active"] for row in rows_of(folder / "brain.csv")]
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["behavior_switches"] == sum(a != b for a, b in pairwise(active))
    assert summary["spin_share"] == pytest.approx(active.count("spin") / 200, abs=1e-4)
    assert summary["ahead_share"] + summary["spin_share"] == pytest.approx(1.0, abs=2e-4)
    assert "spin_share" in result.table()


@pytest.mark.parametrize("most", [None, 2])
def test_share_is_of_time_and_not_of_steps(most: int | None) -> None:
    """Steps at 0, 1 and 3 s of a run of 4 s: each lasts until the next."""
    record = Record()
    for time, motor in ((0.0, 0), (1.0, 1), (3.0, 0)):
        record.append("brain_step", time, struct.pack("<5d", motor, 0.0, 0.0, 0.0, 0.0))
    for time, off, on in ((0.0, "", "a"), (1.0, "a", "b"), (2.0, "", "c"), (3.0, "b", "a")):
        record.append("switch", time, json.dumps([off, on, ""]).encode())
    kept = read_brain(record, BrainNames(("a", "b"), ("a", "b"), ())).thinned(most or 10)
    assert kept.shares(4.0) == {"a": 0.5, "b": 0.5}
    assert kept.shares(8.0) == {"a": 0.75, "b": 0.25}
    assert kept.behavior_switches == 2
    assert len(kept) == (most or 3) and kept.time[-1] == 3.0
    if most is None:
        assert picture.segments(kept, 4.0) == [(0, 0.0, 1.0), (1, 1.0, 3.0), (0, 3.0, 4.0)]


def test_few_of_the_steps_are_shown_with_all_shares(result: RunResult) -> None:
    few, whole = record_of(result).thinned(50), record_of(result)
    assert len(few) == 51 and few.time[-1] == whole.time[-1]
    assert few.shares(10.0) == whole.shares(10.0) and few.behavior_switches == whole.behavior_switches
    assert set(few.switches) <= set(whole.switches)
    last = [[one.on for one in record.switches if one.on in whole.names.behaviors][-1] for record in (few, whole)]
    assert last[0] == last[1]


def test_run_of_another_robot_is_not_confused_with_this_one() -> None:
    """A run that ends before its brain steps must not show the steps of the run before."""
    brain, first, second = Brain([Ahead()]), Stepped(), Stepped()
    names = BrainNames.of(brain)
    assert names is not None
    first.step(brain)
    none, kept = Record(), Record()
    append_brain(none, brain, second.robot)
    append_brain(kept, brain, first.robot)
    append_brain(kept, brain, first.robot)
    assert (len(read_brain(kept, names)), len(read_brain(none, names))) == (1, 0), "each step once"
    assert read_brain(none, names).shares() == {"ahead": 0.0}


def test_brain_that_fails_leaves_its_steps_up_to_there(tmp_path: Path) -> None:
    class Failing(MotorBehavior):
        def step(self, robot: Robot) -> None:
            if robot.time > 0.99:
                raise RuntimeError("no more")

    with pytest.raises(BrainError, match="no more"):
        boebot.run(Brain([Failing()]), robot="arsim", arena="empty", seconds=5, out=tmp_path)
    failed = read_run(tmp_path)
    assert isinstance(failed, RunResult)
    assert record_of(failed).time == pytest.approx(np.arange(20) * 0.05)


def test_other_brains_have_no_record(tmp_path: Path) -> None:
    result = boebot.run(lambda robot: robot.drive(0.1, 0.1), robot="arsim", seconds=0.5)
    result.save(tmp_path, csv=True)
    assert result.brain_record is None
    assert not (tmp_path / "brain.csv").exists() and not (tmp_path / "switches.csv").exists()
    table = result.table()
    assert table["behavior_switches"] is None and not any(name.endswith("_share") for name in table)


def test_each_of_several_robots_has_its_own(tmp_path: Path) -> None:
    brains = [brain_of(Witness(utility=UTILITIES["witness"])), Brain([Ahead()])]
    members = [
        boebot.Member(brain=brain, robot="arsim", pose=(x, 0.0, 0.0)) for x, brain in zip((0, 1), brains, strict=True)
    ]
    together = boebot.run_together(members, arena="empty", seconds=3)
    together.save(tmp_path, csv=True)
    assert [len(record_of(robot).names.behaviors) for robot in together.robots] == [2, 1]
    assert {row["active"] for row in rows_of(tmp_path / "robot-1" / "brain.csv")} == {"ahead", "spin"}
    assert {row["active"] for row in rows_of(tmp_path / "robot-2" / "brain.csv")} == {"ahead"}


def test_picture_has_a_band_in_the_colours_of_the_behaviors(result: RunResult, folder: Path) -> None:
    """The band's lowest row of pixels: as wide for each behavior as its share of the time."""
    picture = (matplotlib.image.imread(folder / "run.png")[:, :, :3] * 255).round().astype(int)
    blue, pink = ([int(style.behavior(index)[i : i + 2], 16) for i in (1, 3, 5)] for index in (0, 1))
    is_blue, is_pink = ((picture == colour).all(axis=2) for colour in (blue, pink))
    covered = (is_blue | is_pink).sum(axis=1)
    row = int(np.flatnonzero(covered > 0.8 * picture.shape[1])[-1])
    share = is_pink[row].sum() / covered[row]
    assert share == pytest.approx(record_of(result).shares(result.run_time)["spin"], abs=0.01)
