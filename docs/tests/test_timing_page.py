"""The page of the timing: promises are those that are held, and its picture is of today's image."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

from matplotlib.text import Text

from boebot.description.robots import load_robot
from boebot.running.tasks import DEFAULT_PERIOD
from boebot_timing import diagram
from boebot_timing.budget import prove
from boebot_timing.emulated.measure import measure
from boebot_timing.loads import LOADS
from boebot_timing.realisable import judge
from sim_bridge.boards.emulated import avr_image
from tools.tests.timing_promises import PROMISES

DOCS = Path(__file__).resolve().parents[1]


def test_promises_on_the_page_are_those_that_are_held() -> None:
    text = (DOCS / "reference" / "timing.md").read_text(encoding="utf-8")
    for promise in PROMISES:
        limit = f"≤ {promise.most:,} {promise.unit}".strip() if promise.most else "none"
        assert f"| `{promise.load}` | {promise.what} | {limit} |" in text


def test_picture_is_of_the_tick_that_is_measured_today() -> None:
    """It says the same; drawn anew it would take seconds."""
    image, robot = avr_image("shieldbot"), load_robot("shieldbot")
    report = prove(image, LOADS["figures"], measure(image, robot, "figures", 1.0, 1))
    figure = diagram.figure(report, judge(robot, DEFAULT_PERIOD, board=report.board_times))
    said = {word for text in figure.findobj(Text) if (word := text.get_text())}
    shown = (DOCS / "images" / "timing.svg").read_text(encoding="utf-8")
    missing = said - set(map(unescape, re.findall(r"<text[^>]*>([^<]*)</text>", shown)))
    assert not missing, "draw it anew: make timing"
