"""The page of the timing: its bounds and sizes are those of today's images, and a run of today measures the same."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from itertools import zip_longest
from pathlib import Path

import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from boebot.description.robots import load_robot
from boebot_timing import diagram
from boebot_timing.budget import Report
from boebot_timing.emulated.measure import measure
from tools import timing_page
from tools.avr_program import IMAGES
from tools.timing_page import Reports
from tools.timing_promises import PROMISES

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "timing.md"
PICTURE = Path("..") / "images" / timing_page.PICTURE
RENEW = "print it anew: make timing"
NUMBER = re.compile(r"(?:–|\d{1,3}(?:,\d{3})*(?:\.\d+)?(?: %)?(?: / \d+\.\d+)*)")
LOAD = "figures"
COLOURS = {to_rgb(colour) for colour in ("#d55e00", "#0072b2")}  # interrupts and tasks (diagram.py)


@pytest.fixture(scope="module")
def now() -> Reports:
    """Of the image whose tick is drawn, as it is today, nothing measured: the others are printed with it."""
    return timing_page.reports(timing_page.DRAWN)


@pytest.fixture(scope="module")
def again(now: Reports) -> Report:
    """What the emulator says today of one scenario of it."""
    name = timing_page.DRAWN
    measured = measure(timing_page.elf(name), load_robot(name), LOAD, timing_page.SECONDS, timing_page.SEED)
    return replace(now[LOAD], measured=measured)


def section_of(name: str) -> str:
    return PAGE.read_text(encoding="utf-8").split(f"## {name}.elf\n")[1].split("\n## ")[0].strip()


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def differ(shown: str, now: str) -> bool:
    """Whether two lines say different things, but for figures that were not measured now."""
    if not now.startswith("|"):
        return re.fullmatch(NUMBER.pattern.join(map(re.escape, now.split(timing_page.UNMEASURED))), shown) is None
    pairs = list(zip_longest(cells(shown), cells(now)))
    return any(NUMBER.fullmatch(a or "") is None if b == timing_page.UNMEASURED else a != b for a, b in pairs)


def test_bounds_and_sizes_on_the_page_are_those_of_the_image(now: Reports) -> None:
    shown = section_of(timing_page.DRAWN).splitlines()
    lines = timing_page.image_section(timing_page.DRAWN, now).strip().splitlines()[2:]
    different = [f"{a!r}, now {b!r}" for a, b in zip(shown, lines, strict=False) if differ(a, b)]
    assert len(shown) == len(lines) and not different, f"{RENEW}\n" + "\n".join(different[:10])


def test_promises_on_the_page_are_those_that_are_held() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for promise in PROMISES:
        assert f"| `{promise.load}` | {promise.what} | {timing_page.limit(promise)} |" in text, RENEW


def test_what_was_measured_is_measured_again(again: Report) -> None:
    """Of one load; a run is a function of image, scenario and seed."""
    expected = [cells(line) for line in timing_page.sums({LOAD: again}).splitlines()]
    section = section_of(timing_page.DRAWN)
    table = section[section.index("| of a tick ") :].split("\n\n")[0]
    shown = [cells(line) for line in table.splitlines()]
    column = shown[0].index(LOAD)
    assert [[row[0], row[column]] for row in shown if "---" not in row[0]] == [
        row for row in expected if "---" not in row[0]
    ], RENEW


def test_picture_is_of_the_tick_that_is_measured_today(again: Report) -> None:
    """It says the same, and has a box for each span; drawn anew it would take seconds."""
    svg = (PAGE.parent / PICTURE).read_text(encoding="utf-8")
    figure = diagram.figure(again, timing_page.verdict(timing_page.DRAWN, again))
    said = {word for text in figure.findobj(Text) if (word := text.get_text())}
    shown = set(map(unescape, re.findall(r"<text[^>]*>([^<]*)</text>", svg)))
    assert not said - shown, f"{RENEW}\n{said - shown}"
    boxes = [box for box in figure.findobj(Rectangle) if box.get_width() and box.get_facecolor()[:3] in COLOURS]
    drawn = [colour for colour in re.findall(r"fill: (#\w{6})", svg) if to_rgb(colour) in COLOURS]
    assert len(boxes) == len(drawn), RENEW


def test_nothing_on_the_page_took_longer_than_its_bound() -> None:
    """A task or an interrupt; the larger where loads differ."""
    blocks = [block for block in PAGE.read_text(encoding="utf-8").split("\n\n") if " | bound | emulator | " in block]
    assert len(blocks) == 2 * len(IMAGES)
    for row in (cells(line) for block in blocks for line in block.splitlines()[2:]):
        bound = max(int(number) for number in row[1].replace(",", "").split(" / "))
        assert row[2] == "–" or 0 < int(row[2].replace(",", "")) <= bound, row
