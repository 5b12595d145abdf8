"""Tests of `boebot list`, and of the names that a wrong one is thought to mean."""

from __future__ import annotations

import json

import pytest

from boebot import behaviors
from boebot.arenas import arena_names
from boebot.brains import bundled
from boebot.description.robots import robot_names
from boebot.errors import did_you_mean
from boebot.guests import LISTS, guests
from boebot.imperfections import imperfections, switches
from boebot.sketches import NAMES
from command import boebot


def test_every_list_has_all_names_and_a_line_of_each(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "list", "--json")
    assert (code, err) == (0, "")
    listed = json.loads(out)
    assert list(listed) == [
        "robots",
        "arenas",
        "brains",
        "sketches",
        "behaviors",
        "imperfections",
        "switches",
        *guests(LISTS),
    ]
    names = {kind: [row["name"] for row in rows] for kind, rows in listed.items()}
    assert (names["robots"], names["arenas"], names["brains"]) == (robot_names(), arena_names(), bundled())
    assert names["sketches"] == list(NAMES)
    assert names["imperfections"] == list(imperfections()) and names["switches"] == list(switches())
    assert set(names["behaviors"]) < set(behaviors.__all__) and "Avoid" in names["behaviors"]
    assert all(row["title"] for rows in listed.values() for row in rows)


def test_imperfections_have_their_magnitudes(capsys: pytest.CaptureFixture[str]) -> None:
    """In the list for people the neutral value stands beside the switch that sets it."""
    _, out, _ = boebot(capsys, "list", "imperfections")
    assert "servo_lag_s 0.055 s lag of the speed; without lag: 0 " in " ".join(out.split())
    rows = json.loads(boebot(capsys, "list", "imperfections", "--json")[1])["imperfections"]
    (grip,) = (row for row in rows if row["name"] == "tyre_grip")
    assert (grip["value"], grip["switch"], grip["neutral"], grip["of"]) == (0.7, "slip", 10.0, ["body"])
    assert next(row for row in rows if row["name"] == "servo_scale_us")["neutral"] is None


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
