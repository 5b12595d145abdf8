"""What matters: effects and shares of known figures, and the command from file to page."""

from __future__ import annotations

import json
import multiprocessing
import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from boebot.description.robots import load_robot
from boebot.errors import BoebotError
from boebot_campaign import designs, engine, kept, local, tasks
from boebot_campaign.matters import Matters, effects, shares
from boebot_campaign.plan import Plan, Range, heard, read
from command import boebot
from sim_bridge.robots.imperfections import applied

FORKED = multiprocessing.get_context("forkserver")
FORKED.set_forkserver_preload(local.IMPORTED)
FILE = """\
brains = ["wander"]
robots = ["arsim"]
arenas = ["room"]
seconds = 0.5
seeds = [1, 2]
figure = "true_distance_m"
samples = 4
"""


@pytest.mark.parametrize(("axes", "runs"), [(1, 2), (4, 8), (5, 16), (34, 128), (65, 256)])
def test_a_two_level_design_mixes_no_effect_with_that_of_two_axes_together(axes: int, runs: int) -> None:
    signs = 2 * designs.points("two-level", 0, axes, 1) - 1
    assert len(signs) == designs.length("two-level", 0, axes) == runs and set(signs.flat) == {-1, 1}
    assert (signs.T @ signs == runs * np.eye(axes)).all() and not signs.sum(axis=0).any()
    for some in combinations(range(min(axes, 12)), 2):
        assert not (signs[:, some].prod(axis=1) @ signs).any()


def test_in_a_saltelli_design_the_seed_is_an_axis() -> None:
    axes = {"servo_lag_s": Range(low=0.0, high=0.1)}
    plan = Plan(brains=["demo"], seconds=1.0, seeds=[5, 6, 9], design="saltelli", points=64, imperfections=dict(axes))
    points = designs.points("saltelli", 64, 2, 1)
    cases = [plan.case(row, points) for row in range(plan.count)]
    assert len(cases) == 64 * 4 and {one.seed for one in cases} == {5, 6, 9}
    assert {
        (a.seed == b.seed, a.imperfections == b.imperfections) for a, b in zip(cases[::4], cases[1::4], strict=True)
    } == {(True, False)}


AXES = [(f"axis {index}", [0.0, 1.0]) for index in range(34)]


def test_chance_is_taken_for_an_effect_no_oftener_than_it_says() -> None:
    random, points = np.random.default_rng(3), designs.points("two-level", 0, 34, 1)
    trials = 200
    wrong = sum(
        any(one["counts"] for one in effects(AXES, points, random.exponential(size=(len(points), 6))))
        for _ in range(trials)
    )
    assert wrong / trials < 0.2  # 1 in 20 of each of two tests


def test_effects_are_those_that_the_figure_has_on_average_and_at_one_seed() -> None:
    random, points = np.random.default_rng(4), designs.points("two-level", 0, 34, 1)
    by_seed = np.tile([2.0, -2.0], 4)  # drawn for a robot: better or worse
    values = 3 * points[:, :1] + by_seed * points[:, 1:2] + 5 * points[:, 2:3] * points[:, 3:4]
    found = {one["name"]: one for one in effects(AXES, points, values + random.normal(size=(128, 8)))}
    assert found["axis 0"]["effect"].least < 3 < found["axis 0"]["effect"].most
    assert found["axis 0"]["effect"].least > 2
    assert found["axis 1"]["effect"].least < 0 < found["axis 1"]["effect"].most
    assert found["axis 1"]["at_one_seed"] == pytest.approx(2, rel=0.2)
    assert found["axis 2"]["effect"].mean == pytest.approx(2.5, abs=0.3)  # half of what both do together
    assert {name for name, one in found.items() if one["counts"]} == {f"axis {index}" for index in range(4)}
    assert [*found][:3] == sorted([*found][:3], key=lambda name: -found[name]["at_one_seed"])


def test_shares_are_those_of_a_sum_and_of_a_product() -> None:
    axes = [(name, [0.0, 1.0]) for name in ("x", "y", "z", "nothing")]
    points = designs.points("saltelli", 1024, 4, 1)
    centred = points - 0.5
    values = centred[:, 0] + 2 * centred[:, 1] + 6 * centred[:, 1] * centred[:, 2]
    variance = 1 / 12 + 4 / 12 + 36 / 144
    wanted = {"x": (1 / 12, 1 / 12), "y": (4 / 12, 4 / 12 + 36 / 144), "z": (0, 36 / 144), "nothing": (0, 0)}
    for one in shares(axes, values):
        itself, total = wanted[one["name"]]
        assert one["by_itself"].mean == pytest.approx(itself / variance, abs=0.05)
        assert one["with_others"].mean == pytest.approx(total / variance, abs=0.05)
        assert one["by_itself"].least <= one["by_itself"].mean <= one["by_itself"].most
    assert shares(axes, np.ones(len(points))) == []


def saved(folder: Path, text: str) -> Path:
    (folder / "matters.toml").write_text(text)
    return folder / "matters.toml"


def test_all_that_changes_something_of_the_robot_is_an_axis_and_each_row_can_be_run(tmp_path: Path) -> None:
    text = FILE.replace("arsim", "shieldbot") + "[imperfections]\nencoder_bounces = [0, 3]\n"
    plan = read(saved(tmp_path, text), Matters).as_sweep()
    assert len(plan.axes) == 35 and plan.count == 128 * 2
    assert plan.imperfections["servo_lag_s"] == Range(low=0.0, high=0.055)
    assert plan.imperfections["ping_grazing_rad"] == Range(low=1.57, high=0.785)  # it is off at 1.57
    assert plan.imperfections["temperature_c"] == Range(low=18.0, high=22.0)
    points, robot = designs.points("two-level", 0, 35, 1), load_robot("shieldbot")
    for row in range(0, plan.count, 2):
        applied(robot, given=heard(plan.case(row, points).imperfections))


def test_the_file_of_the_page_can_be_asked(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[3] / "docs/how-to/what-matters.md"
    (block,) = re.findall(r"```toml\n(.*?)```", page.read_text(), re.DOTALL)
    plan = read(saved(tmp_path, block), Matters).as_sweep()
    assert f"here {len(plan.axes)} of them in {plan.count // 12} settings, each at 12 seeds" in page.read_text()


BAD = {
    "one seed": (("[1, 2]", "{ from = 3, to = 3 }"), "there is one seed; expected 2 or more"),
    "two brains": (('["wander"]', '["wander", "clearway"]'), "brains: expected array of length <= 1"),
    "two robots": (('["arsim"]', '["arsim", "shieldbot"]'), "robots: expected array of length <= 1"),
    "no such figure": (("true_distance_m", "true_distance"), "figure is 'true_distance'.*true_distance_m"),
    "a figure that is no number": (("true_distance_m", "hash"), "figure is 'hash'; expected one of [a-z_, ]*$"),
    "a figure that the plan says": (("true_distance_m", "seed"), "figure is 'seed'; expected one of "),
    "seeds from above": (("[1, 2]", "{ from = 3, to = 1 }"), "seeds: from is 3, to is 1; expected no less"),
    "samples": (("samples = 4", "samples = 5"), "samples is 5; expected a power of two"),
    "too many samples": (
        ("samples = 4", "samples = 1073741824"),
        "these are [0-9,]* runs; expected at most 10,000,000",
    ),
    "a design": (("samples = 4", 'design = "grid"'), "design"),
    "idle": (("samples = 4", "[imperfections]\nservo_lag_s = [0, 0.1]"), "servo_lag_s changes nothing"),
    "three values": (("samples = 4", "[imperfections]\ntyre_grip = [0.1, 0.5, 1]"), "lists 3; expected two"),
    "whole": (("samples = 4", "[imperfections]\ntyre_slip = { from = 0, to = 1 }"), "takes whole numbers"),
}


@pytest.mark.parametrize(("change", "sentence"), BAD.values(), ids=BAD.keys())
def test_what_cannot_be_asked_is_one_sentence(change: tuple[str, str], sentence: str, tmp_path: Path) -> None:
    assert change[0] in FILE
    with pytest.raises(BoebotError, match=f"matters.toml.*{sentence}"):
        read(saved(tmp_path, FILE.replace(*change)), Matters)


def test_the_command_writes_a_page_and_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = []

    def without_cluster(_: engine.Workers, folder: kept.Folder, told: engine.Told) -> None:
        if folder.undone():
            ran.append((folder.path.name, folder.plan.count))
            worker = FORKED.Process(target=tasks.do_part, args=(str(folder.path), folder.stamp, 0, folder.plan.count))
            worker.start()
            worker.join()
            assert worker.exitcode == 0
        told(folder.plan.count)

    monkeypatch.setattr(engine.Workers, "run", without_cluster)
    out = tmp_path / "out"
    command = ["matters", str(saved(tmp_path, FILE)), "--out", str(out)]
    code, text, errors = boebot(capsys, *command, "--json")
    assert (code, errors) == (0, "")
    said = json.loads(text)
    friction = next(one for one in said["effects"] if one["name"] == "dc_motor_viscous_friction_n_m_s")
    assert friction["counts"] and friction["effect"][2] < 0 and friction["ends"] == [0.0, 0.02]
    counting = [one["name"] for one in said["effects"] if one["counts"]]
    assert [one["name"] for one in said["indices"]] == [*counting[:5], "seed"]
    assert ran == [("effects", 8 * 2), ("indices", 4 * (len(counting[:5]) + 3))]
    page = (out / "index.md").read_text()
    assert all(f"| {name} |" in page for name in counting) and (out / "matters.png").stat().st_size > 10_000
    code, text, errors = boebot(capsys, *command)
    assert (code, errors, len(ran)) == (0, "", 2) and "by itself" in text and str(out / "index.md") in text
    code, _, errors = boebot(capsys, "report", str(out))
    assert code != 0 and errors.endswith(f"expected one of them: {out / 'effects'}, {out / 'indices'}\n")
