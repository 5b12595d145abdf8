"""Tests of `boebot list`, and of the names that a wrong one is thought to mean."""

from __future__ import annotations

import json

import pytest

from boebot import behaviors
from boebot.arenas import arena_names
from boebot.boards import imperfections
from boebot.brains import bundled
from boebot.description.robots import robot_names
from boebot.errors import did_you_mean
from command import boebot


def test_every_list_has_all_names_and_a_line_of_each(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "list", "--json")
    assert (code, err) == (0, "")
    listed = json.loads(out)
    assert list(listed) == ["robots", "arenas", "brains", "behaviors", "experiments", "imperfections"]
    names = {kind: [row["name"] for row in rows] for kind, rows in listed.items()}
    assert (names["robots"], names["arenas"], names["brains"]) == (robot_names(), arena_names(), bundled())
    assert names["imperfections"] == list(imperfections()) and len(imperfections()) > 20
    assert set(names["behaviors"]) < set(behaviors.__all__) and "Avoid" in names["behaviors"]
    assert all(row["title"] for rows in listed.values() for row in rows)


def test_one_list_alone(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = boebot(capsys, "list", "arenas")
    assert "track" in out and "wander" not in out
    code, _, err = boebot(capsys, "list", "arena")
    assert code == 2 and "there is no list of 'arena'; expected robots, arenas" in err


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("left_whisker", "; did you mean 'whisker_left'?"),
        ("Pingg", "; did you mean 'ping'?"),
        ("gripper", ""),
        ("ping" * 1_000_000, ""),
    ],
)
def test_name_that_was_meant(name: str, hint: str) -> None:
    assert did_you_mean(name, ["ping", "whisker_left", "whisker_right", "compass"]) == hint
