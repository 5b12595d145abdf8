"""A result where somebody looks at it: its figure, its page in a browser, in a notebook, as a pandas DataFrame."""

from __future__ import annotations

import base64
import io
import os
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import pandas
import pytest
from matplotlib.figure import Figure
from PIL import Image

import boebot
from boebot.errors import BoebotError
from boebot.result import RunResult, TogetherResult
from boebot.view import on_screen
from copied_process import python

ROBOTS = [boebot.Member(brain="wander", robot="arsim", pose=(x, 0.0, 0.0)) for x in (0.0, 1.0)]


@pytest.fixture(scope="module")
def result() -> RunResult:
    def step(robot: boebot.Robot) -> None:
        robot.drive(0.3, 0.2)
        robot.show("word", "NA" if robot.time > 0.5 else "going")
        robot.show("half", robot.time / 2 if robot.time > 0.5 else None)

    return boebot.run(step, seconds=1)


@pytest.fixture(scope="module")
def together() -> TogetherResult:
    return boebot.run_together(ROBOTS, arena="empty", seconds=1)


def picture_in(html: str) -> Image.Image:
    """The one below the tables."""
    (data,) = re.findall(r'</table><img alt="[^"]+" width="\d+" src="data:image/png;base64,([^"]+)">$', html)
    return Image.open(io.BytesIO(base64.b64decode(data)))


def test_figure_is_that_of_the_picture(result: RunResult, together: TogetherResult, tmp_path: Path) -> None:
    for run in (result, together):
        figure = run.plot()
        assert isinstance(figure, Figure)
        figure.savefig(tmp_path / "it.png", dpi=figure.dpi)
        with Image.open(tmp_path / "it.png") as mine, picture_in(run._repr_html_()) as shown:
            assert mine.size == shown.size and mine.tobytes() == shown.tobytes()
    html = together._repr_html_()
    assert html.count("<table>") == 2 and html.index("robot 2") < html.index("<img")


def test_nothing_to_draw_is_one_sentence() -> None:
    empty = boebot.run("wander", seconds=0.1, record=False)
    for look in (empty.plot, empty.replay, TogetherResult(robots=[empty], error=None).plot):
        with pytest.raises(BoebotError, match=r"^the run has no control tick that could be drawn; expected one"):
            look()
    assert empty._repr_html_().endswith("</table>")


BROWSE = """
import boebot
result = boebot.run("wander", robot="arsim", arena="empty", seconds=0.5)
print(result.replay())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the environment says whether there is a display")
def test_page_is_opened_where_there_is_a_display(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    browser, opened = tmp_path / "browser", tmp_path / "opened"
    browser.write_text(f'#!/bin/sh\necho "$1" >>{opened}\n')
    browser.chmod(0o755)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    for environment in ({}, {"BROWSER": f"{browser} %s"}):
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        assert opened.exists() is False
        done = python(f"import tempfile; tempfile.tempdir = None\n{BROWSE}", tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        page = Path(done.stdout.strip())
        assert page.is_relative_to(tmp_path) and "<title>" in page.read_text()
    assert opened.read_text() == f"{page.as_uri()}\n"


class Reader(HTMLParser):
    """What a browser makes of a piece of HTML: its tags, and the text between them."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.mark.parametrize(
    "page",
    [
        "",
        '<p title="it\'s">1 &lt; 2 &amp; 3</p>',
        "</iframe><script>alert(1)</script>",
        '" onload="alert(1)',
        "&quot;&#34;&amp;quot; &copy &notit; ✓ \n\t",
    ],
)
def test_frame_holds_any_page_as_it_is(page: str) -> None:
    read = Reader(on_screen.html_frame(page))
    ((tag, attributes),) = read.tags
    assert (tag, attributes["srcdoc"], read.text) == ("iframe", page, "")


def test_ipython_in_a_terminal_is_no_notebook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    shell = "from IPython.core.interactiveshell import InteractiveShell; InteractiveShell.instance()"
    done = python(f"{shell}\n{BROWSE}", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "<title>" in Path(done.stdout.strip()).read_text()


def test_columns_are_those_of_the_file(result: RunResult, tmp_path: Path) -> None:
    result.save(tmp_path, csv=True)
    heading, *rows = (tmp_path / "run.csv").read_text().splitlines()
    frame = result.to_pandas()
    assert [frame.index.name, *frame.columns] == heading.split(",") and len(frame) == len(rows) == result.record.ticks
    assert list(frame.index) == pytest.approx(result.series.time, abs=1e-4)
    assert frame["tick"].dtype == "int64" and list(frame["tick"]) == list(result.series.raw["tick"])
    assert result.true_pose is not None
    assert list(frame["true_x_m"]) == pytest.approx(result.true_pose.x, abs=1e-5)
    assert frame["true_x_m"].dtype == frame["shown_half"].dtype == "float64"
    assert pandas.isna(frame["shown_half"].iloc[0]) and frame["shown_half"].iloc[-1] == pytest.approx(0.475)
    assert set(frame["command"].iloc[10:]) == {"signal"}
    assert frame["shown_word"].iloc[-1] == "NA", "a text, not an empty cell"


def test_robots_stand_below_each_other(together: TogetherResult) -> None:
    frame = together.to_pandas()
    assert frame.index.names == ["robot", "time_s"]
    assert len(frame) == sum(robot.record.ticks for robot in together.robots)
    assert list(frame.loc[2]["true_x_m"]) == list(together.robots[1].to_pandas()["true_x_m"])


def test_without_pandas_it_is_one_sentence(result: RunResult, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(BoebotError, match=r"^to_pandas\(\) needs pandas, which is not installed: pip"):
        result.to_pandas()
