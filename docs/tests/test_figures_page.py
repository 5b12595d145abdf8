"""The page of the figures is in the form that `make bench` prints, with every figure that there is; never how fast."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from tools.tests.bench import report
from tools.tests.bench.__main__ import figures
from tools.tests.bench.figures import Figure

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "figures.md"
NUMBER = r"(?:\d{1,3}(?:,\d{3})+|\d+(?:\.\d+)?(?:e-\d+)?)"


@cache
def all_figures() -> list[Figure]:
    return figures([])


def rows() -> list[list[str]]:
    return [line[2:-2].split(" | ") for line in PAGE.read_text().splitlines() if line.startswith("| ")]


def test_the_page_names_machine_load_and_time() -> None:
    text = PAGE.read_text()
    assert re.search(rf"\d processors, .*, Python 3\.\d+\.\d+; load {NUMBER} before, {NUMBER} after\.", text)
    assert re.search(rf"^Took {NUMBER} minutes\.$", text, re.MULTILINE), "not a page of a whole run"


def test_the_page_has_every_figure_with_its_unit_and_target() -> None:
    heading, ruler, *found = rows()
    assert tuple(heading) == report.COLUMNS and set(ruler) == {"---"}
    expected = [(figure.name, figure.unit, report.target(vars(figure))) for figure in all_figures()]
    assert [(row[0], row[3], row[4]) for row in found] == expected


def test_every_value_is_a_number_and_every_peer_is_there() -> None:
    """A measurement that failed is named with its error."""
    failures = next((line for line in PAGE.read_text().splitlines() if line.startswith("Failed: ")), "")
    for row, figure in zip(rows()[2:], all_figures(), strict=True):
        if row[1] == "failed":
            assert f"{row[0]}: " in failures
            continue
        assert re.fullmatch(NUMBER, row[1]), row
        assert re.fullmatch(rf"–|{NUMBER} %", row[2]) and (row[2] == "–") <= (figure.rounds == 1 or row[1] == "0"), row
        beside = [] if row[5] == "–" else row[5].split("; ")
        assert len(beside) == len(figure.peers), row
        for text, peer in zip(beside, figure.peers, strict=True):
            times = "" if row[1] == "0" else rf" \(× {NUMBER}\)"
            assert re.fullmatch(rf"{re.escape(peer.name)}: {NUMBER}{times}", text), row
