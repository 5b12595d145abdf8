"""The replay page's own script, run by node where there is one: what it draws and says at a moment of a run."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.report import style
from boebot.result import RunResult

NODE = shutil.which("node") or shutil.which("nodejs")
pytestmark = pytest.mark.skipif(NODE is None, reason="runs the page's script with node, which is not installed")
STAND_INS = Path(__file__).with_name("replay_page.js")
TIMES = (0.0, 3.0, 7.5)


@pytest.fixture(scope="module")
def result() -> RunResult:
    """A robot with every slow device in the arena with everything."""

    def step(robot: boebot.Robot) -> None:
        robot.drive(0.3, 0.25)
        robot.turn_turret(0.5)

    return boebot.run(step, robot="boebot", arena="showcase", seconds=8)


def moments(result: RunResult, folder: Path, *times: float) -> list[dict[str, Any]]:
    """What the page shows at those times."""
    result.save(folder)
    assert NODE is not None
    command = [NODE, str(STAND_INS), str(folder / "replay.html"), *map(str, times)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def shown(result: RunResult, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    return moments(result, tmp_path_factory.mktemp("page"), *TIMES)


def centres(moment: dict[str, Any], rows: list[dict[str, Any]], colour: str) -> list[tuple[float, float]]:
    """Of the shapes filled with a colour, back in metres."""
    scale, shift_x, shift_y = moment["scale"]
    found = []
    for row in rows:
        if row.get("fill") == colour:
            x, y = np.mean([point[:2] for point in row["path"]], axis=0)
            found.append(((x - shift_x) / scale, (shift_y - y) / scale))
    return found


def test_moving_shapes_are_where_the_truth_has_them(result: RunResult, shown: list[dict[str, Any]]) -> None:
    assert result.truth is not None
    for time, moment in zip(TIMES, shown, strict=True):
        places = [moving.pose(time + result.clock_offset)[:2] for moving in result.truth.plan.moving]
        assert np.allclose(centres(moment, moment["drawn"], style.MOVING), places, atol=2e-3)
    first, last = (centres(moment, moment["drawn"], style.MOVING) for moment in (shown[0], shown[-1]))
    assert np.abs(np.subtract(first, last)).max() > 0.5, "they have moved"


def test_everything_that_stands_is_filled_by_its_kind(shown: list[dict[str, Any]]) -> None:
    """The places of the arena's file."""
    still = shown[0]["still"]
    for colour, places in {
        style.SOLID: [(-0.2, 1.05), (0.2, -0.9)],
        style.DULL: [(-1.7, 1.2)],
        style.LOW: [(-1.25, 0.24)],
        style.ROUGH: [(-0.05, 0.0)],
        style.SMOOTH: [(1.175, -1.2)],
        style.LAMP: [(1.6, 1.2)],
    }.items():
        assert np.allclose(centres(shown[0], still, colour), places, atol=1e-3), colour
    words = {row["text"] for row in still if "text" in row}
    assert {"grip 0.9", "grip 0.15", "charger", "4 cm high", "IR 10%, sound 20%", "m", "0.5", "−0.5"} <= words


def test_slow_devices_are_read_at_the_cursor(result: RunResult, shown: list[dict[str, Any]]) -> None:
    devices = result.telemetry.devices
    for time, moment in zip(TIMES, shown, strict=True):
        index = int(np.searchsorted(result.series.time, time + 1e-9) - 1)
        table = {name: (value, age) for name, value, age in moment["readings"]}
        assert set(table) == {
            "battery", "left light", "right light", "compass", "analog IR", "turret", "buzzer", "supply",
        }  # fmt: skip
        battery, age = devices.values["battery"][index], devices.ages["battery"][index]
        assert table["battery"] == (f"{battery:.2f} V", f"{age * 1000:.0f} ms")
        assert table["left light"][0] == f"{devices.values['left_light'][index] * 1000:.3f} ms"
        degrees = np.degrees(devices.values["compass"][index])
        assert table["compass"][0] == ("–" if np.isnan(degrees) else f"{degrees:.1f} °".replace("-", "−"))
    assert {name: value for name, value, _ in shown[-1]["readings"]}["turret"] == "28.6 °", "0.5 rad"


def test_page_hides_what_the_robot_has_not(shown: list[dict[str, Any]], tmp_path: Path) -> None:
    assert [device for device, _ in shown[0]["lamps"]] == [
        "whisker_left", "whisker_right", "infrared_left", "infrared_right",
    ]  # fmt: skip
    assert {"estimateRow", "errorRow"} <= set(shown[0]["hidden"]), "a boebot has no encoders"
    arsim = boebot.run(lambda robot: robot.drive(0.5, 0.5), robot="arsim", seconds=1)
    (moment,) = moments(arsim, tmp_path, 0.5)
    assert [device for device, _ in moment["lamps"]] == ["infrared_left", "infrared_right"]
    assert "pingRow" in moment["hidden"] and "estimateRow" not in moment["hidden"]
    assert [row[0] for row in moment["readings"]] == ["left IR", "right IR", "compass"]
    assert moment["texts"]["clock"] == "0.50 / 1.00 s"


BODY = "rgba(229,233,240,.94)"


@pytest.mark.parametrize("outline", [[], [[-0.08, -0.05], [0.06, -0.05], [0.06, 0.05], [-0.08, 0.05]]])
def test_page_draws_the_body_as_what_meets_things(outline: list[list[float]], tmp_path: Path) -> None:
    """Each of two robots, in its own frame: the outline, or the circle."""
    mine = tmp_path / "mine.toml"
    mine.write_text(f"extends = 'arsim'\nname = 'mine'\n[body]\noutline_m = {outline}\n")
    members = [boebot.Member(brain=lambda robot: None, robot=mine, pose=(x, 0.0, 0.0)) for x in (0.0, 1.0)]
    run = boebot.run_together(members, arena="empty", seconds=0.2)
    (moment,) = moments(run, tmp_path, 0.1)  # type: ignore[arg-type]
    bodies = [row["path"] for row in moment["drawn"] if row.get("fill") == BODY]
    assert bodies == [outline or [[0, 0, run.robots[0].robot.body.radius_m]]] * 2
