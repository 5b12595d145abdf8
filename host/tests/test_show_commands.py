"""Tests of `boebot arena`: picture, table, JSON, and what is wrong in one sentence."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from PIL import Image

from boebot.arenas import load_arena
from command import boebot

SVG = "{http://www.w3.org/2000/svg}"


def texts(svg: Path) -> set[str]:
    """What is written in a picture."""
    return {"".join(element.itertext()).strip() for element in ET.parse(svg).iter(f"{SVG}text")}


def test_arena_is_shown(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "arena", "showcase")
    assert (code, err) == (0, "")
    assert "4 m x 3 m" in out and "cushion" in out and "IR 10%" in out and "arena-showcase.png" in out
    with Image.open("arena-showcase.png") as picture:
        assert picture.info["Title"] == "showcase: one of everything"
    code, out, err = boebot(capsys, "arena", "empty", "--out", "it.svg")
    assert (code, err) == (0, "") and "open field" in out
    assert "empty: empty field" in texts(Path("it.svg"))


def test_arena_as_json(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "arena", "showcase", "--json")
    assert (code, err) == (0, "") and not list(tmp_path.iterdir())
    shown, arena = json.loads(out), load_arena("showcase")
    assert shown["size_m"] == [4.0, 3.0] and tuple(shown["start"].values()) == arena.start
    rows = {row["name"]: row for row in shown["shapes"]}
    assert rows["pillar"] == {
        "kind": "disc", "name": "pillar", "x_m": 0.2, "y_m": -0.9, "width_m": 0.3, "depth_m": 0.3, "height_m": None,
        "remarks": "",
    }  # fmt: skip
    described = arena.description
    groups = ("outline", "obstacle", "wall", "disc", "moving", "patch", "line", "light")
    assert len(shown["shapes"]) == sum(len(getattr(described, group)) for group in groups) + 1  # the charger


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("arena", "statoin"), "did you mean 'station'?"),
        (
            ("arena", "room", "--out", "it.jpg"),
            "it.jpg is no name of a picture; expected one that ends in .png",
        ),
        (("arena", "room", "--out", "no/it.png"), "there is no folder no; expected one that the picture"),
        (("arena", "room", "--out", "/dev/full/it.png"), "there is no folder /dev/full"),
    ],
)
def test_wrong_request_is_one_sentence(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], sentence: str
) -> None:
    code, out, err = boebot(capsys, *arguments)
    assert (code, out) == (1, "") and sentence in err and err.count("\n") == 1
