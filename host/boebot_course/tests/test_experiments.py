"""Every experiment: what it says of itself, whether it is met, and whether its page still says what a run prints.

Those that are slow are run by `make experiments`; of their pages only what needs no run is looked at.
"""

from __future__ import annotations

import itertools
import re
from functools import cache

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from boebot.description.robots import load_robot
from boebot.navigation import RandomSearch
from boebot_course import pages
from boebot_course.experiments import Outcome, all_experiments, patrol
from boebot_course.running import Verdict

EXPERIMENTS = all_experiments()
QUICK = [name for name, one in EXPERIMENTS.items() if not one.slow]
SAME = 1e-3  # of a figure on a page: another computer's last digits may differ
NOTHING = 1e-9  # and rounding alone


@cache
def outcome(name: str) -> Outcome:
    return EXPERIMENTS[name].run(pages.SEED)


@pytest.mark.parametrize("name", QUICK)
def test_quick_experiment_is_met(name: str) -> None:
    found = outcome(name)
    assert found.measured and found.columns()
    assert not [f"{one.name}: {one.text}, expected {one.expected}" for one in found.measured if not one.is_met]


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_experiment_says_what_it_is(name: str) -> None:
    one = EXPERIMENTS[name]
    assert re.fullmatch(r"\w[\w-]*", name), "it names files"
    assert name.lower() not in {"list", "readme", "index"}
    for text in (one.title, one.source, one.caption, one.criterion):
        assert text and text == text.strip() and "\n" not in text
    assert one.caption.endswith(".") and one.criterion.endswith(".") and not one.title.endswith(".")
    assert one.section, "names no section of the notes"
    robot = re.split(r"[ ,(]", one.robot)[0]
    if robot != "none":
        load_robot(robot)


def hides(upper: Line2D, lower: Line2D) -> bool:
    """A line drawn over another, as wide and without gaps, where it takes most of that one's dots."""
    if lower.get_zorder() > upper.get_zorder():
        upper, lower = lower, upper
    assert upper.axes is not None
    to_pixels = upper.axes.transData.transform
    points, own = (
        {tuple(pixel) for pixel in to_pixels(np.column_stack(line.get_data())).round().tolist()}
        for line in (lower, upper)
    )
    is_solid = upper.get_linestyle() == "-" and upper.get_linewidth() >= lower.get_linewidth()
    return is_solid and len(points) > 2 and len(points & own) > len(points) / 2


@pytest.mark.parametrize(
    ("name", "legend"),
    {
        "E22": {"left", "right"},
        "E23": {"s_min = 0.06", "without s_min"},
        "E46": {"as searched", "tightened"},
        "E49": {"wedge", "0.05 m beside", "no hill", "one hill"},
        "E52": {"scan", "1 % noise", "the robot's own laser", "share of noise"},
        "E53": {"scan", "expected by the map where odometry believes to be"},
        "E54": {"believed before", "accepted", "found", "truth", "before", "after"},
        "isocline": {"animal 1", "animal 2", "animal 3", "animal 4"},
    }.items(),
)
def test_no_line_of_a_picture_hides_another_and_its_legend_names_them(name: str, legend: set[str]) -> None:
    figure = Figure(layout="constrained")
    outcome(name).draw(figure)
    for axes in figure.axes:
        lines = [line for line in axes.get_lines() if line.get_linestyle() != "None"]
        assert not any(hides(upper, lower) for lower, upper in itertools.combinations(lines, 2))
    legends = [*figure.legends, *(shown for axes in figure.axes if (shown := axes.get_legend()) is not None)]
    assert legend <= {text.get_text() for shown in legends for text in shown.get_texts()}


def test_patrol_is_drawn_as_it_was_and_as_it_was_believed() -> None:
    """Figs. 6.14 and 6.15: the true path in each, by odometry alone on the left, else by localization."""
    run = patrol.patrolled(1, "roller", 12.0, 5.0, RandomSearch())
    figure = Figure(layout="constrained")
    patrol._draw(figure, [run])
    for axes, columns in zip(figure.axes, ((0, 1), (3, 4), (3, 4)), strict=False):
        true, believed = (line.get_xydata() for line in axes.get_lines() if not str(line.get_label()).startswith("_"))
        assert np.array_equal(true, run.trial.path) and np.array_equal(believed, run.poses[:, columns])
    apart = np.hypot(*(run.poses[:, :2] - run.poses[:, 3:5]).T)
    assert apart.max() > 0.01, "they differ, once a scan has come"


def test_names_differ_as_names_of_files() -> None:
    assert len({name.lower() for name in EXPERIMENTS}) == len(EXPERIMENTS)


CHAPTERS = sorted(set(map(pages.chapter_of, EXPERIMENTS.values())))


@pytest.mark.parametrize("chapter", CHAPTERS)
def test_page_of_a_chapter_is_as_the_kit_writes_it(chapter: str) -> None:
    """Measured figures only where they are quick: another computer's last digits may differ."""
    shown = (pages.FOLDER / f"chapter-{chapter}.md").read_text(encoding="utf-8")
    verdicts = {name: Verdict(name, tuple(outcome(name).measured)) for name in QUICK}
    text = pages.chapter_page(chapter, verdicts)
    assert without_rows(shown) == without_rows(text), "stale: make pictures"
    there, now = rows_of(shown), rows_of(text)
    for name in now.keys() & set(QUICK) - {"E66"}:  # it counts kinds of objects inside the kit
        assert numbers(there[name]) == pytest.approx(numbers(now[name]), rel=SAME, abs=NOTHING, nan_ok=True), name


def without_rows(text: str) -> str:
    """A page without its figures."""
    return re.sub(r"(?<=---\|---\n)(?:.+\n)+", "", text)


def rows_of(text: str) -> dict[str, str]:
    """The figures of each experiment: of the table that follows its picture."""
    found = re.findall(r"^!\[.*\]\((.*)\.png\)\n\nfigure .*\n---\|---\n((?:.+\n)*)", text, re.MULTILINE)
    return dict(found)


def numbers(rows: str) -> list[float]:
    """What was measured."""
    return [float(re.split(r"[ *]", row.rpartition(" | ")[2].lstrip("*"))[0]) for row in rows.splitlines()]


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_picture_is_there_and_small(name: str) -> None:
    picture = pages.FOLDER / f"{name}.png"
    assert picture.stat().st_size <= pages.LARGEST_BYTES and Image.open(picture).size[0] >= 500


def test_list_of_pages_is_complete_and_there_are_no_others() -> None:
    listed = (pages.FOLDER / "README.md").read_text(encoding="utf-8")
    assert listed == pages.listing(EXPERIMENTS.values()), "stale: make pictures"
    wanted = {f"{name}.png" for name in EXPERIMENTS} | {f"chapter-{chapter}.md" for chapter in CHAPTERS} | {"README.md"}
    assert {path.name for path in pages.FOLDER.iterdir()} == wanted
