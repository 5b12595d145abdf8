"""The replay page's own script, run by node where there is one: what it draws and says at a moment of a run."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.brain import Brain, MotorBehavior, StateVariable, Utility
from boebot.devices.drawing import circle
from boebot.record import overview
from boebot.result import RunResult
from boebot.view import replay, scene, style

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
    assert {"grip 0.9", "grip 0.15", "charger", "4 cm high", "IR 10%", "sound 20%", "m", "0.5", "−0.5"} <= words


def test_slow_devices_are_read_at_the_cursor(result: RunResult, shown: list[dict[str, Any]]) -> None:
    series = result.series
    for time, moment in zip(TIMES, shown, strict=True):
        index = int(np.searchsorted(result.series.time, time + 1e-9) - 1)
        table = {name: (value, age) for name, value, age in moment["readings"]}
        assert set(table) == {
            "servo left", "servo right", "ping", "battery", "light left", "light right", "compass", "analog infrared",
            "turret", "buzzer", "supply",
        }  # fmt: skip
        battery, age = series.number("battery", "voltage")[index], series.number("battery", "age")[index]
        assert table["battery"] == (f"{battery:.2f} V", f"{age * 1000:.0f} ms")
        assert table["light left"][0] == f"{series.number('light_left', 'decay_time')[index] * 1000:.3f} ms"
        degrees = np.degrees(series.number("compass", "heading")[index])
        assert table["compass"][0] == ("–" if np.isnan(degrees) else f"{degrees:.1f} °".replace("-", "−"))
    assert {name: value for name, value, _ in shown[-1]["readings"]}["turret"] == "28.6 °", "0.5 rad"


def test_page_hides_what_the_robot_has_not(shown: list[dict[str, Any]], tmp_path: Path) -> None:
    assert [device for device, _ in shown[0]["lamps"]] == [
        "whisker left", "whisker right", "infrared left", "infrared right",
    ]  # fmt: skip
    assert {"estimateRow", "errorRow"} <= set(shown[0]["hidden"]), "a boebot has no encoders"
    arsim = boebot.run(lambda robot: robot.drive(0.5, 0.5), robot="arsim", seconds=1)
    (moment,) = moments(arsim, tmp_path, 0.5)
    assert [device for device, _ in moment["lamps"]] == ["infrared left", "infrared right"]
    assert "estimateRow" not in moment["hidden"]
    assert [row[0] for row in moment["readings"]] == ["infrared left", "infrared right", "compass"]
    assert moment["texts"]["clock"] == "0.50 / 1.00 s"


def test_truth_is_marked_and_absent_where_nobody_knows_it(
    result: RunResult, shown: list[dict[str, Any]], tmp_path: Path
) -> None:
    assert shown[0]["texts"]["poseName"] == "true pose" and "truth" not in shown[0]["hidden"]
    content = replay.content([result])
    content["runs"][0]["known"] = False  # as of a real robot
    (tmp_path / "page.html").write_text(replay.joined(content))
    assert NODE is not None
    command = [NODE, str(STAND_INS), str(tmp_path / "page.html"), "1.0"]
    moment = json.loads(subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout)
    assert moment["texts"]["poseName"] == "odometry" and "truth" in moment["hidden"]


CIRCLE: list[list[float]] = []


@pytest.mark.parametrize(
    "outline",
    [pytest.param(CIRCLE, marks=pytest.mark.soak), [[-0.08, -0.05], [0.06, -0.05], [0.06, 0.05], [-0.08, 0.05]]],
)
def test_page_draws_the_body_as_what_meets_things(outline: list[list[float]], tmp_path: Path) -> None:
    """Each of two robots, in its own frame: the outline, or the circle."""
    mine = tmp_path / "mine.toml"
    mine.write_text(f"extends = 'arsim'\nname = 'mine'\n[body]\noutline_m = {outline}\n")
    members = [boebot.Member(brain=lambda robot: None, robot=mine, pose=(x, 0.0, 0.0)) for x in (0.0, 1.0)]
    run = boebot.run_together(members, arena="empty", seconds=0.2)
    (moment,) = moments(run, tmp_path, 0.1)  # type: ignore[arg-type]
    scale, shift_x, shift_y = moment["scale"]
    paths = [np.array(row["path"]) for row in moment["drawn"] if row.get("fill") == style.BODY]
    bodies = [(path - (shift_x, shift_y)) / (scale, -scale) for path in paths]
    edge = outline or circle((0.0, 0.0), run.robots[0].robot.body.radius_m)
    places = sorted(bodies, key=lambda body: float(body[0, 0]))
    assert np.allclose(places, [np.add(edge, (x, 0.0)) for x in (0.0, 1.0)], atol=1e-4)


# ---- a brain of processes -----------------------------------------------------------------------------------------


class Ahead(MotorBehavior):
    def step(self, robot: boebot.Robot) -> None:
        robot.drive(0.3, 0.3)


class Spin(MotorBehavior):
    def step(self, robot: boebot.Robot) -> None:
        robot.drive(-0.3, 0.3)


def composed() -> Brain:
    """Turns in the second half of each second."""
    late = StateVariable("late", lambda robot: float(robot.time % 1 >= 0.5))
    return Brain([Ahead(utility=Utility(b=0.5)), Spin(utility=Utility(b=-1.0, w={"late": 3.0}, tau=0.05))], [late])


@pytest.fixture(scope="module")
def composed_run() -> RunResult:
    return boebot.run(composed(), robot="arsim", arena="empty", seconds=6)


def bars(moment: dict[str, Any], index: int) -> float:
    """How wide all bars in the colour of a behavior are together (pixels)."""
    return float(sum(row["width"] for row in moment["still"] if row.get("bar") == style.behavior(index)))


@pytest.mark.parametrize("most", [pytest.param(6000, marks=pytest.mark.soak), 40])
def test_page_says_which_behavior_is_active_and_why(
    most: int, composed_run: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At steps that the page keeps, also where it keeps one in three."""
    monkeypatch.setattr(overview, "STEPS", most)
    composed_run = dataclasses.replace(composed_run)
    record = composed_run.brain_record
    assert record is not None and len(record) == 120
    every = 1 if most > 120 else 3
    times = [float(record.time[index]) for index in range(0, 120, 3 * every)]
    for time, moment in zip(times, moments(composed_run, tmp_path, *times), strict=True):
        last = [switch for switch in record.switches if switch.time <= time + 1e-9][-1]
        texts = moment["texts"]
        assert (texts["behavior"], texts["reason"]) == (last.on, last.reason)
        assert texts["since"] == f"since {last.time:.2f} s"
        wide = [bars(moment, index) for index in (0, 1)]
        share = record.shares(float(composed_run.series.time[-1]))["spin"]
        assert wide[1] / sum(wide) == pytest.approx(share, abs=0.01 * every)
    assert {switch.on for switch in record.switches} == {"ahead", "spin"}


def test_page_shows_the_brain_of_the_chosen_robot(composed_run: RunResult, tmp_path: Path) -> None:
    """Robots 1 and 2 of three have one of processes, each its own; the third has none."""
    brains = [Brain([Spin(name="only")]), composed(), lambda robot: robot.drive(0.1, 0.1)]
    members = [
        boebot.Member(brain=brain, robot="arsim", pose=(x, 0.0, 0.0))
        for x, brain in zip((0.0, 1.0, 2.0), brains, strict=True)
    ]
    run = boebot.run_together(members, arena="empty", seconds=1)
    (moment,) = moments(run, tmp_path, 0.9)  # type: ignore[arg-type]
    assert moment["texts"]["behavior"] == "only" and "mind" not in moment["hidden"]
    page = (tmp_path / "replay.html").read_text()
    for chosen, behavior in ((2, "spin"), (3, None)):
        other = tmp_path / f"robot-{chosen}.html"
        other.write_text(page.replace("exec(location.hash)", f'exec("#robot={chosen}")'))
        assert NODE is not None
        done = subprocess.run([NODE, str(STAND_INS), str(other), "0.9"], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        shown = json.loads(done.stdout)
        assert shown["texts"].get("behavior") == behavior
        assert ("mind" in shown["hidden"]) == (behavior is None)


def test_page_stays_small(composed_run: RunResult, tmp_path: Path) -> None:
    """A step adds a time and a utility for each process, four bytes each, in four characters for three bytes."""
    with_brain = replay.write([composed_run], tmp_path / "with.html").stat().st_size
    record, composed_run.overview.brain = composed_run.overview.brain, None
    try:
        without = replay.write([composed_run], tmp_path / "without.html").stat().st_size
    finally:
        composed_run.overview.brain = record
    assert record is not None
    assert with_brain - without < 120 * 13 * 4 / 3 + 200 * len(record.switches) + 500


# ---- sweeps of lasers ---------------------------------------------------------------------------------------------

REAR = """
extends = 'roller'
name = 'two lasers'
[device.laser]
rays = 682
step_rad = 0.006135923
[device.rear]
type = "laser_range_finder"
rays = 7
step_rad = 0.2
range_m = 0.5
position_m = [-0.1, 0.03]
heading_rad = 3.0
"""


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    robot = tmp_path_factory.mktemp("robot") / "rear.toml"
    robot.write_text(REAR)
    return boebot.run(lambda it: it.drive(0.2, 0.6), robot=robot, arena="room", seconds=3)


def swept(moment: dict[str, Any]) -> list[np.ndarray]:
    """The areas on the page, back in metres; they lie below the robots."""
    scale, shift_x, shift_y = moment["scale"]
    found = [row["path"] for row in moment["drawn"] if row.get("fill") == style.colour(1) and row["alpha"] == 0.1][:2]
    return [(np.array(path) - (shift_x, shift_y)) / (scale, -scale) for path in found]


def test_page_draws_the_newest_sweep_of_each_laser(scanned: RunResult, tmp_path: Path) -> None:
    """Between two of them the last one stands, where it was taken; of 682 rays 128 are kept, the outermost too."""
    ahead, rear = scene.view(scanned).swept
    for time, moment in zip((0.0, 1.07, 2.93), moments(scanned, tmp_path, 0.0, 1.07, 2.93), strict=True):
        shown_ahead, shown_rear = swept(moment)
        area = ahead.area(int(np.flatnonzero(ahead.time <= time + 1e-9)[-1]))
        assert len(shown_ahead) == 1 + 128
        assert np.allclose(shown_ahead[[0, 1, -1]], area[[0, 1, -1]], atol=2e-4)
        assert np.abs(shown_ahead[:, None] - area).max(axis=2).min(axis=1).max() < 2e-4, "its own corners"
        area = rear.area(int(np.flatnonzero(rear.time <= time + 1e-9)[-1]))
        assert np.allclose(shown_rear, area, atol=1e-4)


def test_sweeps_take_bounded_room_in_the_page(
    scanned: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two bytes a number, in four characters for three bytes; what is shown is no older than the sweeps left out."""
    sizes = []
    for most in (replay.SWEPT_AT_MOST, 2_000):
        monkeypatch.setattr(replay, "SWEPT_AT_MOST", most)
        sizes.append(replay.write([scanned], tmp_path / "page.html").stat().st_size)
        (content,) = json.loads((tmp_path / "page.html").read_text().partition("const page = ")[2].partition(";\n")[0])[
            "runs"
        ]
        room = sum(
            len(value) for one in content["rows"]["swept"] for value in (one["time"], one["distances"], *one["pose"])
        )
        assert room <= most * 2 * 4 / 3 + 100
    assert sizes[1] < sizes[0] - 5_000
    ahead = scene.view(scanned).swept[0]
    (moment,) = moments(scanned, tmp_path, 2.93)
    shown = swept(moment)[0]
    taken = [index for index in range(len(ahead.time)) if np.allclose(ahead.area(index)[0], shown[0], atol=1e-5)]
    assert taken and 2.93 - ahead.time[taken[-1]] < 0.1 * 6, "30 sweeps, of which 6 have room: every fifth"
