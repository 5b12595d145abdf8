"""What a brain shows and sketches: in record, table, picture and page, within its bounds."""

from __future__ import annotations

import csv
import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from matplotlib.figure import Figure

import boebot
from boebot.errors import BrainError
from boebot.record.brain_record import read_layers, read_shown
from boebot.record.record import Record
from boebot.result import RunResult, read_run
from boebot.showing import BYTES_AT_ONCE, BYTES_S, NAMES, SKETCH_EACH_S, UNKNOWN, Showing, Sketch
from boebot.view import painter, scene

START = (1.0, -2.0, math.pi / 2)
LINE = [(0.0, 0.0), (0.5, 0.25)]
NODE = shutil.which("node") or shutil.which("nodejs")
PAGE = Path(__file__).parents[1] / "view" / "replay_page.js"


def step(robot: boebot.Robot) -> None:
    """Ten steps in a second."""
    robot.drive(0.2, 0.1)
    second = round(robot.time * 10) // 10
    robot.show("whole", second)
    robot.show("even", second % 2 == 0)
    robot.show("word", ["nought", "one", "two"][second])
    if second == 1:
        robot.show("early", None)
    elif second == 0:
        robot.show("early", math.nan if robot.time < 0.45 else 0.5)
    robot.sketch("ahead", lines=[LINE], points=[(0.25, second), (math.nan, 0.0)])
    if robot.time > 0.95:
        robot.sketch("map", grid=boebot.Grid([[0, 1, 0.5], [math.nan, -3, 7]], 0.1, -1.0, 2.0), frame="arena")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shown") / "out"
    result = boebot.run(step, robot="arsim", arena="empty", pose=START, seconds=2.5, period=0.1, out=folder)
    result.save(folder, csv=True)
    return folder


@pytest.fixture(scope="module")
def result(folder: Path) -> RunResult:
    """As it is read back."""
    read = read_run(folder)
    assert isinstance(read, RunResult)
    return read


def test_values_are_columns_and_hold(folder: Path) -> None:
    with (folder / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        step_s = math.floor(float(row["time_s"]) * 10 + 1e-6) / 10  # that the row shows
        second = math.floor(step_s + 1e-6) if step_s < 2.45 else 2
        assert float(row["shown_whole"]) == second
        assert float(row["shown_even"]) == (second % 2 == 0)
        assert row["shown_word"] == ["nought", "one", "two"][second]
        assert row["shown_early"] == ("0.500000" if 0.45 < step_s < 0.95 else "")


def test_values_are_kept_when_they_change(result: RunResult) -> None:
    assert result.record.times_of("shown") == pytest.approx([0.0, 0.5, 1.0, 2.0])
    assert result.shown.texts == {"word": ["nought", "nought", "one", "two"]}
    assert result.notices == []


def test_few_rows_are_shown_with_the_last() -> None:
    record = Record()
    for index in range(100):
        record.append("shown", index / 10, json.dumps({"n": index}).encode())
    few = read_shown(record, 7)
    assert len(few.time) <= 8 and few.numbers["n"][-1] == 99 and few.time[-1] == 9.9
    assert few.at(np.array([-1.0, 20.0])).numbers["n"] == pytest.approx([math.nan, 99], nan_ok=True)


def test_layer_is_kept_when_it_changes(result: RunResult) -> None:
    ahead, drawn = result.layers
    assert (ahead.name, drawn.name) == ("ahead", "map")
    assert ahead.time == pytest.approx([0, 1, 2]) and drawn.time == pytest.approx([1.0])
    points = [np.frombuffer(sketch.points, "<f4") for sketch in ahead.sketches]
    assert np.array_equal(points, [(0.25, second) for second in range(3)]), "without those that are no numbers"
    assert np.array_equal(np.frombuffer(ahead.sketches[0].lines[0], "<f4").reshape(-1, 2), LINE)
    grid = drawn.sketches[0].grid
    assert grid is not None and (grid.rows, grid.columns, grid.cell, grid.x, grid.y) == (2, 3, 0.1, -1.0, 2.0)
    assert list(grid.cells) == [0, 254, 127, UNKNOWN, 0, 254]


def test_picture_draws_each_layer_in_its_frame(result: RunResult) -> None:
    """Where the run began the robot stood at (1, -2) and looked along y."""
    axes = Figure().add_subplot()
    axes.set_xlim(-3, 3)
    axes.set_ylim(-4, 4)
    painter.draw_layers(axes, scene.view(result))
    (line, points), (grid,) = axes.lines, axes.images
    to_arena = line.get_transform() - axes.transData
    assert to_arena.transform(line.get_xydata()) == pytest.approx(np.array([(1.0, -2.0), (0.75, -1.5)]))
    assert to_arena.transform(points.get_xydata()) == pytest.approx(np.array([(-1.0, -1.75)]))
    assert grid.get_extent() == pytest.approx((-1.0, -0.7, 2.0, 2.2))
    assert (grid.get_transform() - axes.transData).transform((0.5, 0.5)) == pytest.approx((0.5, 0.5))
    assert (axes.get_xlim(), axes.get_ylim()) == ((-3, 3), (-4, 4)), "it shows what it showed"
    opaque = np.asarray(grid.get_array())[..., 3]
    assert opaque[1, 0] == 0 and opaque[0, 0] < opaque[0, 2] < opaque[0, 1]


@pytest.mark.skipif(NODE is None, reason="runs the page's script with node, which is not installed")
def test_page_shows_values_and_sketches(folder: Path) -> None:
    assert NODE is not None
    command = [NODE, str(PAGE), str(folder / "replay.html"), "0.3", "2.3"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    moments: list[dict[str, Any]] = [json.loads(line) for line in done.stdout.splitlines()]
    assert [dict(moment["shown"]) for moment in moments] == [
        {"whole": "0", "even": "1", "early": "–", "word": "nought"},
        {"whole": "2", "even": "1", "early": "–", "word": "two"},
    ]
    for second, moment in zip((0, 2), moments, strict=True):
        scale, *shift = moment["scale"]
        paths, dots = (
            [
                (np.array([point[:2] for point in row["path"]]) - shift) / (scale, -scale)
                for row in moment["drawn"]
                if row.get(how) == "#7b4fa3"
            ]
            for how in ("stroke", "fill")
        )
        assert np.allclose(paths, [[(1.0, -2.0), (0.75, -1.5)]]), "as in the picture"
        assert np.allclose(dots[0][-1], (1.0 - second, -1.75))
    assert [row["image"] for row in moments[1]["drawn"] if "image" in row] == [[-1, 2, pytest.approx(0.3), 0.2]]
    assert not [row for row in moments[0]["drawn"] if "image" in row], "not yet"


def test_each_of_several_robots_has_its_own(tmp_path: Path) -> None:
    def first(robot: boebot.Robot) -> None:
        robot.show("first", 1)

    members = [boebot.Member(brain=brain, robot="arsim", pose=(x, 0, 0)) for x, brain in ((0, first), (1, step))]
    boebot.run_together(members, arena="empty", seconds=0.3, out=tmp_path / "out")
    read = read_run(tmp_path / "out")
    assert isinstance(read, boebot.TogetherResult)
    assert list(read.robots[0].shown.numbers) == ["first"] and not read.robots[0].layers
    assert [layer.name for layer in read.robots[1].layers] == ["ahead"]


def test_main_and_processes_show_as_steps_do() -> None:
    class Speak(boebot.brain.MotorBehavior):
        def step(self, robot: boebot.Robot) -> None:
            robot.show("n", robot.time)
            robot.sketch("here", points=[(0, 0)])

    def main(robot: boebot.MainRobot) -> None:
        for leg in range(3):
            robot.show("n", leg)
            robot.sketch("here", points=[(leg, 0)])
            robot.wait(0.1)

    for brain in (boebot.brain.Brain([Speak()]), main):
        result = boebot.run(brain, robot="arsim", arena="empty", seconds=0.5)
        assert len(result.shown.numbers["n"]) >= 3 and [layer.name for layer in result.layers] == ["here"]


# ---- bounds ----------------------------------------------------------------------------------------------------------


class Kept:
    """What goes to the record."""

    def __init__(self) -> None:
        self.showing = Showing()
        self.showing.is_kept = True

    @property
    def rows(self) -> list[tuple[str, float, bytes]]:
        """All so far."""
        self._rows = [*getattr(self, "_rows", []), *self.showing.take()]
        return self._rows

    def sketch(self, time_s: float, layer: str = "a", **what: Any) -> None:
        terms: dict[str, Any] = {"lines": (), "points": (), "grid": None, "frame": "start"} | what
        self.showing.sketch(time_s, layer, **terms)


def test_layer_changes_ten_times_a_second_and_ends_with_its_last_sketch() -> None:
    kept = Kept()
    for index in range(1000):
        kept.sketch(index * 0.001, points=[(index, 0)])
    kept.showing.end()
    times = [time_s for _, time_s, _ in kept.rows]
    assert times[-1] == 0.999 and len(times) == 11
    assert np.diff(times[:-1]) == pytest.approx(SKETCH_EACH_S)
    last = msgspec.json.decode(kept.rows[-1][2], type=Sketch)
    assert np.frombuffer(last.points, "<f4").tolist() == [999, 0]
    assert kept.showing.notices == []


def test_brain_that_never_stops_showing_is_bounded_and_told_once() -> None:
    kept = Kept()
    grid = np.zeros((400, 400))
    for index in range(400):
        time_s = index * 0.1
        grid[index // 400, index % 400] = 1.0
        kept.sketch(time_s, grid=boebot.Grid(grid, 0.01))
        kept.sketch(time_s, f"layer {index}", points=[(0, 0)])
        kept.sketch(time_s, "far too much", points=np.zeros((20_001, 2)))
        for name in range(40):
            kept.showing.show(time_s, f"value {index} {name}", index)
            kept.showing.show(time_s, f"value {index} {name}", None if name < 20 else index)
    assert sum(len(data) for *_, data in kept.rows) < BYTES_AT_ONCE + BYTES_S * 40
    assert len(kept.showing.values) == NAMES
    notices = kept.showing.notices
    assert len(notices) == 4
    assert "the brain shows more than 32 values: 'value 1 32' and others are left out" in notices
    assert any("more than 32 layers" in sentence for sentence in notices)
    assert any("at most 20,000 points and 250,000 cells" in sentence for sentence in notices)
    assert any("more than 50 kB in a second" in sentence for sentence in notices)


def test_what_no_file_can_hold_is_replaced_or_left_out() -> None:
    def odd(robot: boebot.Robot) -> None:
        robot.show("name", "a\udcff")  # as of a file whose name is no UTF-8
        robot.sketch("far", points=[(1e39, 0.0), (1.0, 2.0)])

    result = boebot.run(odd, robot="arsim", arena="empty", seconds=0.1)
    assert [*result.shown.texts["name"]][-1] == "a?"
    assert result.layers[0].sketches[-1].points == np.array([1, 2], "<f4").tobytes()


def test_run_says_what_was_left_out() -> None:
    def many(robot: boebot.Robot) -> None:
        for index in range(40):
            robot.show(f"value {index}", robot.time)

    result = boebot.run(many, robot="arsim", arena="empty", seconds=1)
    assert result.notices == ["the brain shows more than 32 values: 'value 32' and others are left out"]
    assert len(result.shown.numbers) == 32


def test_many_sketches_are_thinned_to_few_bytes() -> None:
    kept = Kept()
    for index in range(64):
        kept.sketch(index * 1.0, "great", points=np.full((1000, 2), index))
        kept.sketch(index * 1.0, "small", points=[(index, index)])
    record = Record()
    for row in kept.rows:
        record.append(*row)
    great, small = read_layers(record, 100_000)
    assert len(small.time) == 64 and great.time[0] == 0 and great.time[-1] == 63
    assert 5 <= len(great.time) <= 12
    assert [np.frombuffer(sketch.points, "<f4")[0] for sketch in great.sketches] == great.time.tolist()


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda robot: robot.show("", 1), r"show\(''.*expects a name of 1 to 100 printable characters"),
        (lambda robot: robot.show("a\nb", 1), "expects a name"),
        (lambda robot: robot.show("a", [1, 2]), r"show\('a', \[1, 2\]\) expects a number, a text or None"),
        (lambda robot: robot.sketch("a", points=[1, 2]), r"points expects pairs, as in \[\(0.1, 0.2\)"),
        (lambda robot: robot.sketch("a", points="ab"), "points expects pairs"),
        (lambda robot: robot.sketch("a", lines=LINE), r"each of lines expects pairs"),
        (lambda robot: robot.sketch("a", lines=3), "lines expects a list of lines"),
        (lambda robot: robot.sketch("a", frame="world"), 'expected "start", "arena" or "robot"'),
        (lambda robot: robot.sketch("a", grid=[[0, 1]]), r"grid expects boebot.Grid\(values, cell, x, y\)"),
        (lambda robot: robot.sketch("a", grid=boebot.Grid([[0]], 0)), "grid expects"),
    ],
)
def test_bad_input_is_one_sentence(call: Any, sentence: str) -> None:
    with pytest.raises(BrainError, match=sentence):
        boebot.run(call, robot="arsim", arena="empty", seconds=0.1)
