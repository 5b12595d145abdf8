"""The page's model of a run, which grows chunk by chunk, run by node where there is one."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.view import replay, scene

NODE = shutil.which("node") or shutil.which("nodejs")
pytestmark = pytest.mark.skipif(NODE is None, reason="runs the page's script with node, which is not installed")
MODEL = Path(__file__).with_name("page_model.js")


def answers(about: dict[str, Any], chunks: list[dict[str, Any]], *ask: str) -> list[Any]:
    """What the model says once the chunks are appended; None for what is no finite number."""
    assert NODE is not None
    given = json.dumps({"about": about, "chunks": chunks, "ask": ask})
    done = subprocess.run(
        [NODE, str(MODEL), str(replay.FOLDER)], input=given, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def packed(values: list[float], form: str = "<f4") -> str:
    return base64.b64encode(np.array(values, form).tobytes()).decode()


LISTS = ("readings", "signs", "swept")
ABOUT: dict[str, Any] = {name: [] for name in LISTS} | {"has_estimate": False, "mind": None, "robot": {}}


def rows(time: list[float], x: list[float] | None = None, **more: Any) -> dict[str, Any]:
    """Of a robot that has next to nothing, and drives along x."""
    none = packed([0.0] * len(time))
    made = {
        **dict.fromkeys(("turret", "left", "right"), none),
        "time": packed(time),
        "path": [packed(time if x is None else x), none, none],
        **dict.fromkeys(("state", "contact"), packed([0] * len(time), "u1")),
        "shown": {"time": packed([]), "numbers": [], "texts": []},
        **{name: [] for name in ("readings", "signs", "layers", "swept", "events", "pins", "printed")},
        **dict.fromkeys(("estimate", "mind")),
    }
    return made | more


def test_chunks_are_appended() -> None:
    """Many of them, so that the arrays have to grow more than once."""
    times = [0.02 * index for index in range(1500)]
    chunks = [rows(times[begin : begin + 7]) for begin in range(0, 1500, 7)]
    time, last, duration = answers(ABOUT, chunks, "it.time.values", "it.last", "it.duration")
    assert np.allclose(time, times, atol=1e-5) and last == 1499 and duration == pytest.approx(29.98)


def test_whole_run_is_one_chunk() -> None:
    """As the replay has it: the same numbers as in the result."""
    result = boebot.run("demo", robot="shieldbot-charging", arena="room", seconds=1)
    data = replay.run_data(result, scene.view(result))
    x, utility, age = answers(
        {key: value for key, value in data.items() if key != "rows"},
        [data["rows"]],
        "it.path[0].values",
        "it.mind.behaviors[1].utility.values",
        "it.readings[0].ages.values",
    )
    assert result.true_pose is not None and result.brain_record is not None
    assert np.allclose(x, result.true_pose.x, atol=1e-6)
    assert np.allclose(utility, result.brain_record.utilities[:, 1], atol=1e-6)
    assert len(age) == len(x)


def test_what_is_new_in_a_later_chunk_is_unknown_before() -> None:
    """Shown numbers and texts, pins."""
    first = rows(
        [0.0, 0.1], shown={"time": packed([0.0]), "numbers": [{"name": "a", "values": packed([1.5])}], "texts": []}
    )
    second = rows(
        [0.2, 0.3],
        shown={
            "time": packed([0.2, 0.3]),
            "numbers": [
                {"name": name, "values": packed(values)} for name, values in (("a", [2.0, 3.0]), ("b", [4.0, 5.0]))
            ],
            "texts": [{"name": "word", "words": ["no", "yes"], "index": [1, 0]}],
        },
        pins=[{"name": "13", "time": packed([0.21, 0.22], "<f8"), "level": packed([1, 0], "u1")}],
    )
    third = rows([0.4])
    ask = ("it.numbers.map(one => [one.name, [...one.values.values]])", "it.texts[0].values")
    numbers, texts, edges, names = answers(ABOUT, [first, second, third], *ask, "it.pins[0].time.values", "it.names")
    assert numbers == [["a", [1.5, 2, 3]], ["b", [None, 4, 5]]]
    assert texts == ["", "yes", "no"]
    assert edges == [0.21, 0.22], "as exact as they came"
    assert names == 4, "as many new names: panels and lanes are made anew"


def test_events_are_in_the_order_of_time_with_the_switches_among_them() -> None:
    about = ABOUT | {"mind": {"behaviors": [{"name": "go", "colour": "#123456"}], "cognitive": []}}
    mind: dict[str, Any] = {
        "time": packed([0.1]),
        "motor": packed([0], "u1"),
        "behaviors": [packed([0.5])],
        "cognitive": [],
    }
    chunk = rows(
        [0.0, 0.1],
        mind=mind | {"switches": [[0.1, "go", "because"]]},
        events=[[0.2, "contact", "c"], [0.05, "lost", "l"]],
    )
    (found,) = answers(about, [chunk], "it.events.map(event => [event.time, event.kind, event.text])")
    assert found == [[0.05, "lost", "l"], [0.1, "switch", "go: because"], [0.2, "contact", "c"]]


def test_pose_between_ticks() -> None:
    """On the way there, but not where the robot was put elsewhere by hand."""
    chunk = rows([0.0, 0.1, 0.2], [0.0, 0.04, 2.0])
    ask = [f"poseAt(it.time.values, it.path, {time})[0]" for time in (-1, 0.05, 0.15, 0.21, 7)]
    assert answers(ABOUT, [chunk], *ask) == pytest.approx([0.0, 0.02, 0.04, 2.0, 2.0], abs=1e-6)
