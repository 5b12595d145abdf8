"""Evolution: the same however it was stopped, a best brain that runs as its file says, refusals in a sentence."""

from __future__ import annotations

import os
import shutil
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
import command
from boebot.brains import load_brain
from boebot.errors import BoebotError
from boebot.rates import Mean, mean_of
from boebot.running.brain_parameters import in_force
from boebot_campaign import engine, evolution, kept, plan, tasks, toml_brain
from boebot_campaign.evolve_file import Evolve

KEYS: dict[str, Any] = {
    "brains": ["clearway"],
    "arenas": ["room"],
    "seconds": 0.5,
    "seeds": [1, 2],
    "test_seeds": [11, 12],
    "population": 2,
    "generations": 2,
    "restarts": 1,
    "parameters": {"avoid.utility.b": {"from": -3, "to": 3}, "wander.forward": {}},
    "fitness": {"true_distance_m": 1.0, "true_contacts": -0.5},
}


@pytest.fixture(scope="module")
def ran() -> Iterator[list[tuple[str, int]]]:
    """Rows are run here, the second half of each sweep first. Folder and number of rows of each part that was run."""
    parts = []

    def run(_: engine.Workers, folder: kept.Folder, told: Callable[[int], object]) -> None:
        for first, end in folder.undone():
            for part in (((first + end) // 2, end), (first, (first + end) // 2)):
                tasks.do_part(str(folder.path), folder.stamp, *part)
                parts.append((folder.path.name, part[1] - part[0]))
        told(folder.plan.count)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(engine.Workers, "run", run)
        patched.setattr(os, "fsync", lambda _: None)  # no power cut
        yield parts


@pytest.fixture(scope="module")
def whole(ran: list[tuple[str, int]], tmp_path_factory: pytest.TempPathFactory) -> evolution.Evolution:
    """One that was not stopped."""
    told: list[int] = []
    done: evolution.Evolution = boebot.evolve(out=tmp_path_factory.mktemp("whole"), progress=told.append, **KEYS)
    assert told == sorted(told)
    assert told[-1] == sum(count for _, count in ran) == (2 + 1 + 2 + 4 + 4) * 2 + 2 * 2
    assert told[-1] == plan.made(KEYS, Evolve, "evolve").most_runs
    return done


def test_stopped_evolution_goes_on_and_ends_as_one_that_was_not(
    whole: evolution.Evolution, ran: list[tuple[str, int]], tmp_path: Path
) -> None:
    assert len(whole.curve) == 4 and whole.pairs == 2 and whole.picture.is_file()
    shutil.copytree(whole.folder, tmp_path, dirs_exist_ok=True)
    gone = ["generation-002", "generation-003", "test"]
    for name in gone:
        shutil.rmtree(tmp_path / name)
    ran.clear()
    np.random.rand()  # somebody else's chance
    stopped = boebot.evolve(out=tmp_path, **KEYS)
    assert {name for name, _ in ran} == set(gone)
    assert stopped.curve == whole.curve and stopped.difference == whole.difference
    assert stopped.brain.read_text() == whole.brain.read_text()


CHANGES: dict[str, Any] = {
    "fitness": {"true_distance_m": 1.0, "true_contacts": -0.6},
    "parameters": {"avoid.utility.b": {"from": -3, "to": 3.1}, "wander.forward": {}},
    "seconds": 0.6,
    "seeds": [1, 3],
    "test_seeds": [11],
    "population": 3,
    "restarts": 0,
    "seed": 2,
    "generations": 3,  # after them the second start would begin elsewhere
}


@pytest.mark.parametrize("key", CHANGES)
def test_after_a_change_it_is_refused_before_the_first_run_and_the_key_named(
    key: str, whole: evolution.Evolution, ran: list[tuple[str, int]]
) -> None:
    ran.clear()
    before = {path: path.stat().st_mtime_ns for path in whole.folder.iterdir()}
    with pytest.raises(BoebotError, match=rf"the plan has changed since .* was begun, in {key}; expected it as it was"):
        boebot.evolve(out=whole.folder, **KEYS | {key: CHANGES[key]})
    assert not ran and before == {path: path.stat().st_mtime_ns for path in whole.folder.iterdir()}


ONE = KEYS | {
    "parameters": {"wander.forward": {}},
    "seeds": [1],
    "test_seeds": [2],
    "generations": 1,
    "population": 2,
    "restarts": 0,
}


def test_more_generations_go_on_and_end_as_if_they_were_asked_at_first(
    ran: list[tuple[str, int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evolution, "_draw", lambda _: None)
    few = boebot.evolve(out=tmp_path / "grown", **ONE)
    first = few.brain.read_text()
    ran.clear()
    grown = boebot.evolve(out=tmp_path / "grown", **ONE | {"generations": 2})
    assert {name for name, _ in ran} == {"generation-001", "test"}
    whole = boebot.evolve(out=tmp_path / "whole", **ONE | {"generations": 2})
    assert grown.curve == whole.curve and grown.difference == whole.difference != few.difference
    assert first != grown.brain.read_text() == whole.brain.read_text()
    assert (tmp_path / "grown" / "evolve.json").read_text() == (tmp_path / "whole" / "evolve.json").read_text()
    with pytest.raises(BoebotError, match="in generations;"):
        boebot.evolve(out=tmp_path / "grown", **ONE)


def test_what_was_asked_is_kept_before_the_first_run_and_others_keep_out(
    ran: list[tuple[str, int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = plan.made(ONE, Evolve, "evolve")

    def run(_: engine.Workers, folder: kept.Folder, __: engine.Told) -> None:
        assert kept.loaded(tmp_path / "out" / "evolve.json", Evolve).plan == asked
        with pytest.raises(BoebotError, match=r"another process writes to .*out now"):
            boebot.evolve(out=tmp_path / "out", **ONE)
        raise BoebotError(f"in {folder.path.name}")

    monkeypatch.setattr(engine.Workers, "run", run)
    with pytest.raises(BoebotError, match=r"^in generation-000$"):
        boebot.evolve(out=tmp_path / "out", **ONE)
    for words in (["report", str(tmp_path / "out")], ["run", "--sweep", str(tmp_path / "out"), "--row", "1"]):
        code, _, said = command.boebot(capsys, *words)
        assert (
            code != 0 and "holds sweeps, and no rows itself; expected one of them: " in said and "Traceback" not in said
        )
    (tmp_path / "out" / "evolve.json").unlink()
    with pytest.raises(BoebotError, match=r"out holds 'generation-000' and no evolve\.json; expected an empty folder"):
        boebot.evolve(out=tmp_path / "out", **ONE)


def test_best_is_the_candidate_whose_rows_say_so(whole: evolution.Evolution) -> None:
    means: dict[tuple[float, float], float] = {}
    for folder in sorted(whole.folder.glob("generation-*")):
        frame = _rows(folder)
        for point, rows in frame.groupby(["parameter.avoid.utility.b", "parameter.wander.forward"]):
            means[point] = rows["fitness"].mean()
    best = max(means, key=lambda point: means[point])
    assert len(means) == 2 + 1 + 2 + 4 + 4 and means[-1.0, 0.5] == pytest.approx(whole.by_hand)
    written = tomllib.loads(whole.brain.read_text())["process"]
    assert (written["avoid"]["utility"]["b"], written["wander"]["forward"]) == best
    assert whole.curve[-1].best_so_far == pytest.approx(means[best]) and whole.by_hand < means[best]
    assert [one.best_so_far for one in whole.curve] == sorted(one.best_so_far for one in whole.curve)
    frame = _rows(whole.folder / "test")
    by_brain = frame.groupby("brain")["fitness"].mean()
    assert whole.difference is not None
    assert whole.difference.mean == pytest.approx(by_brain[whole.brain.name] - by_brain["clearway"], abs=1e-9)
    assert set(frame["seed"]) == {11, 12}


def _rows(folder: Path) -> Any:
    frame = kept.Folder(folder).table().to_pandas()
    return frame.assign(fitness=frame["true_distance_m"] - 0.5 * frame["true_contacts"])


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ({"status": "ok", "battery_charge": 0.0}, 2 * 3.0 - 10),
        ({"status": "ok", "battery_charge": 0.5}, 2 * 3.0),
        ({"status": "raised", "battery_charge": 0.5}, 2 * 3.0 - 100),
        ({"status": "raised", "battery_charge": None}, None),
        ({"status": "killed", "battery_charge": None}, None),
    ],
)
def test_fitness_weighs_figures_and_what_happened(row: dict[str, Any], expected: float | None) -> None:
    weights = {"true_distance_m": 2.0, "empty_battery": -10.0, "raised": -100.0}
    asked = plan.made(KEYS | {"fitness": weights}, Evolve, "evolve")
    found = asked.fitness_of({"row": 1, "true_distance_m": 3.0, **row}, Path("out"))
    assert np.isnan(found) if expected is None else found == expected
    with pytest.raises(BoebotError, match="row 1 in out has no empty_battery"):
        asked.fitness_of({"row": 1, "true_distance_m": 3.0, "status": "ok", "battery_charge": None}, Path("out"))


OWN = """\
from boebot.behaviors import Wander
from boebot.brain import Brain
class Mine(Wander): pass
brain = Brain([Mine()])
"""


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"parameters": {"avoid.utility.bb": {}}}, "no parameter 'avoid.utility.bb'"),
        ({"parameters": {"avoid.utility.b": {"from": 1, "to": -3}}}, "is from 1 to -3; expected from below to"),
        ({"parameters": {"avoid.utility.b": {"from": 1, "to": 1}}}, "parameters.avoid.utility.b: from and to are 1"),
        ({"parameters": {"avoid.utility.b": {"from": 1, "to": 3}}}, "expected bounds around it"),
        ({"parameters": {}}, "parameters: expected object of length >= 1"),
        ({"fitness": {}}, "fitness: expected object of length >= 1"),
        ({"fitness": {"true_distance": 1.0}}, "did you mean 'true_distance_m'"),
        ({"fitness": {"hash": 1.0}}, "fitness has 'hash'; expected figures of a run"),
        ({"seeds": []}, "seeds: expected array of length >= 1"),
        ({"test_seeds": []}, "seeds: expected array of length >= 1"),
        ({"test_seeds": [2]}, "test_seeds has 2, as seeds has"),
        ({"test_seeds": [11, 12, 11]}, "11 is there twice, in test_seeds"),
        ({"points": 3}, "an evolution has no points and imperfections; expected population and parameters"),
        ({"imperfections": {"servo_lag_s": [0.1]}}, "has no points and imperfections"),
        ({"design": "grid"}, "design is 'grid'; expected one of random"),
        ({"parameters": {"avoid.utility.b": {"from": -3, "to": 3, "steps": 3}}}, "has steps, which only a grid takes"),
        (
            {"parameters": {"avoid.utility.b": {"form": -3}}},
            "parameters.avoid.utility.b: there is no key 'form' here; expected from, to, steps; did you mean 'from'",
        ),
        ({"fitness": {"true_distance_m": "much"}}, "fitness.true_distance_m: expected float, got str"),
        ({"brains": ["clearway", "demo"]}, "brains: expected array of length <= 1"),
        ({"brain": "clearway"}, "there is no key 'brain' here.*did you mean 'brains'"),
        ({"test_seeds": {"from": 9, "to": 8}}, "test_seeds: from is 9, to is 8"),
        ({"test_seeds": {"from": 2, "to": 10**12}}, "of the test, these are 999,999,999,999 runs"),
        ({"population": 1}, "population: expected int >= 2"),
        ({"restarts": 40}, "<= 20"),
        ({"restarts": 20}, "runs; expected at most"),
        ({"arenas": ["nowhere"]}, "nowhere"),
        ({"brains": ["wander"]}, "has no processes"),
        ({"brains": ["own.py"]}, "cannot be written as a TOML file: process 'mine'"),
    ],
)
def test_bad_input_is_a_sentence_before_the_first_run(
    changed: dict[str, Any], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(OWN)
    with pytest.raises(BoebotError, match=sentence):
        boebot.evolve(out="out", **KEYS | changed)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["demo", "clearway"])
def test_brain_written_as_toml_runs_as_it_did(name: str, tmp_path: Path) -> None:
    values = {"wander.forward": 0.37, "wander.utility.w.near": -1e-7}
    loaded = load_brain(name)
    with in_force(loaded, values):
        text = toml_brain.text(loaded, "changed", loaded.robot, loaded.arena)
    (tmp_path / "best.toml").write_text(text)
    first, again = boebot.run(name, seconds=1, parameters=values), boebot.run(tmp_path / "best.toml", seconds=1)
    assert first.hash == again.hash != boebot.run(name, seconds=1).hash
    assert first.table()["arena"] == again.table()["arena"]


def test_words_say_when_nothing_is_shown() -> None:
    none = Path()
    done = evolution.Evolution(folder=none, brain=none, picture=none, curve=[], by_hand=0.0, pairs=3, difference=None)
    assert evolution.in_words(done) == "no run of both has figures"
    for bounds, verdict in (((-0.1, 0.5), "includes 0"), ((0.1, 0.5), "better"), ((-0.5, -0.1), "worse")):
        shown = replace(done, difference=Mean(sum(bounds) / 2, *bounds))
        assert evolution.in_words(shown).endswith(verdict)
    shown = replace(done, pairs=1, difference=mean_of(np.array([0.5])))
    assert evolution.in_words(shown) == "+0.50 beside by hand: nothing is shown by 1 pair"
