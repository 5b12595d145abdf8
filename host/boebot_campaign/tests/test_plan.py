"""Plans: which rows there are, and one sentence for what cannot be run, before anything is made."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import pytest

import boebot
from boebot.errors import BoebotError
from boebot.running.loop import execute
from boebot_campaign import designs, plan

ONE = {"brains": ["demo"], "seconds": 1.0, "seeds": [1]}


def test_rows_are_all_combinations_each_once_and_seeds_are_paired() -> None:
    made = plan.made(
        {
            "brains": ["demo", "clearway"],
            "robots": ["shieldbot-charging"],
            "arenas": ["room"],
            "test_arenas": ["station"],
            "seconds": 1.0,
            "seeds": {"from": 5, "to": 7},
            "starts": [[0.0, 0.0, 0.0], [0.5, 0.5, 1.0]],
            "parameters": {"avoid.utility.b": [0.0, 1.0]},
            "imperfections": {"servo_lag_s": {"from": 0.02, "to": 0.08, "steps": 3}},
        },
        plan.Plan,
        "sweep",
    )
    none = designs.points(made.design, made.points, 2, 1)
    cases = [made.case(row, none) for row in range(made.count)]
    found = {
        (one.arena, one.brain, one.parameters["avoid.utility.b"], one.imperfections["servo_lag_s"], one.pose, one.seed)
        for one in cases
    }
    poses = [(0.0, 0.0, 0.0), (0.5, 0.5, 1.0)]
    wanted = product(["room", "station"], ["demo", "clearway"], [0.0, 1.0], [0.02, 0.05, 0.08], poses, [5, 6, 7])
    assert found == set(wanted) and len(cases) == 2 * 2 * 2 * 3 * 2 * 3
    assert {(one.arena, one.set) for one in cases} == {("room", "train"), ("station", "test")}
    pairs = [[(one.start, one.seed) for one in cases if one.brain == brain] for brain in ("demo", "clearway")]
    assert pairs[0] == pairs[1]


def test_free_starts_are_of_the_arena_that_the_run_is_in() -> None:
    keys = {**ONE, "brains": ["wander"], "robots": ["arsim"], "seconds": 0.01, "starts": 50}
    made = plan.made(keys, plan.Plan, "sweep")
    none = designs.points(made.design, made.points, 0, 1)
    requests = [made.request(made.case(row, none), "") for row in range(made.count)]
    assert len({request.members[0].pose for request in requests}) == 50
    assert [execute(request).error for request in requests] == [None] * 50


@pytest.mark.parametrize("design", ["random", "latin", "sobol"])
def test_designs_fill_the_range_and_are_the_same_each_time(design: designs.Design) -> None:
    once, again = (designs.points(design, 64, 3, seed=4) for _ in range(2))
    assert (once == again).all() and (designs.points(design, 64, 3, seed=5) != once).any()
    assert once.shape == (64, 3) and once.min() >= 0 and once.max() < 1
    if design != "random":  # each 64th of each axis has one point
        assert all(sorted((64 * column).astype(int)) == list(range(64)) for column in once.T)


BAD = {
    "no seeds": ({"seeds": []}, "seeds: expected array of length >= 1"),
    "too many runs": ({"seeds": {"from": 1, "to": 10**12}}, "1,000,000,000,000 runs"),
    "no such parameter": ({"parameters": {"avoid.trun": [0.1]}}, "no parameter 'avoid.trun'.*avoid.turn"),
    "parameter of a brain that has none": (
        {"brains": ["wander"], "parameters": {"a.b": [1]}},
        "has no parameter 'a.b'",
    ),
    "value that the process refuses": ({"parameters": {"wander.turn_probability": [7.0]}}, "turn_probability"),
    "no such imperfection": ({"imperfections": {"servo_lag": [0.1]}}, "no imperfection 'servo_lag'"),
    "unknown key": ({"seed": [1]}, "no key 'seed'.*did you mean 'seeds'"),
    "no brain file": ({"brains": ["none_such.py"]}, "no brain file .*none_such.py"),
    "no such arena": ({"arenas": ["rom"]}, "no arena 'rom'"),
    "no such fault": ({"faults": [["ping.mising@1"]]}, "ping.mising"),
    "no such board": ({"on": "foo"}, "no board 'foo'; expected an emulated board"),
    "board of a robot without": ({"brains": ["wander"], "robots": ["arsim"], "on": "native"}, "'arsim' has no board"),
    "no board for a robot with one": ({"on": "direct"}, "driven by its board: it cannot run 'direct'"),
    "second start inside a box": (
        {"arenas": ["room"], "starts": [[0.0, 0.0, 0.0], [0.5, -0.5, 0.0]]},
        "arena room: the robot cannot start at x = 0.5 m, y = -0.5 m: no free space",
    ),
    "no place is free": ({"arenas": ["cell.toml"], "starts": 2}, "arena cell: of 10,000 places none is free"),
    "nor the arena's start": ({"arenas": ["cell.toml"]}, "arena cell: the robot cannot start at x = 0 m, y = 0 m"),
    "period that no step of the world has": (
        {"brains": ["hasty.py"], "robots": ["arsim"]},
        "a brain period of 33 ms does not fit",
    ),
    "second choice of faults is of no part": ({"faults": [[], ["sonar.missing@0s"]]}, "has no 'sonar.missing'"),
    "no time": ({"seconds": 0}, "a run cannot last 0 s"),
    "start twice": ({"starts": [[0, 0, 0], [0.0, 0.0, 0.0]]}, "0.0, 0.0, 0.0. is there twice, in starts"),
    "faults twice": (
        {"faults": [["ping.missing@0s", "cable.out@0s"], ["cable.out@0s", "ping.missing@0s"]]},
        "is there twice, in faults",
    ),
    "value twice": ({"parameters": {"avoid.utility.b": [0, 1, 0.0]}}, "0 is there twice, in avoid.utility.b"),
    "magnitude twice": ({"imperfections": {"servo_lag_s": [0.1, 0.1]}}, "0.1 is there twice, in servo_lag_s"),
    "seed twice": ({"seeds": [4, 5, 4]}, "4 is there twice, in seeds"),
    "arena of both kinds": (
        {"arenas": ["room", "station"], "test_arenas": ["room"]},
        "room is there twice, in arenas and test_arenas",
    ),
    "range of one number": (
        {"parameters": {"avoid.utility.b": {"from": 1.0, "to": 1.0, "steps": 3}}},
        "parameters.avoid.utility.b: from and to are 1; expected two numbers",
    ),
    "seeds from above": ({"seeds": {"from": 3, "to": 1}}, "seeds: from is 3, to is 1; expected no less than from"),
    "limit beyond a clock": ({"limit_s": 1e12}, "limit_s: expected float <= "),
    "a port": ({"on": "/dev/ttyACM0"}, "a port"),
    "design without points": ({"design": "latin", "parameters": {"avoid.utility.b": {"from": 0, "to": 1}}}, "0 points"),
    "design without axes": ({"design": "latin", "points": 1}, "has 1 point over 0 axes"),
    "sobol of odd points": (
        {"design": "sobol", "points": 100, "parameters": {"avoid.utility.b": {"from": 0, "to": 1}}},
        "power of two",
    ),
    "grid without steps": ({"parameters": {"avoid.utility.b": {"from": 0, "to": 1}}}, "0 steps"),
    "limit of nothing": ({"limit_s": 0.0}, "limit_s"),
}


CELL = """\
name = "cell"
title = "4 cm by 4 cm"
start = { x_m = 0.0, y_m = 0.0, heading_rad = 0.0 }
[[outline]]
name = "walls"
corners_m = [[-0.02, -0.02], [0.02, -0.02], [0.02, 0.02], [-0.02, 0.02]]
"""


@pytest.mark.parametrize(("keys", "sentence"), BAD.values(), ids=BAD.keys())
def test_what_cannot_be_run_is_one_sentence_and_no_folder(
    keys: dict[str, object], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cell.toml").write_text(CELL)
    (tmp_path / "hasty.py").write_text("PERIOD = 0.033\n\n\ndef step(robot):\n    pass\n")
    with pytest.raises(BoebotError) as caught:
        boebot.sweep(out=tmp_path / "out", **{**ONE, **keys})
    assert re.search(sentence, str(caught.value)) and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()
