"""The page of the lecture notes: its table has each section, figure, equation and code listing of the notes, its
commands name what there is; and every file that the page names is there."""

from __future__ import annotations

import re
import shlex
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from boebot.arenas import arena_names
from boebot.brains import bundled
from boebot.description.robots import robot_names
from boebot_course.experiments import all_experiments

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "reference" / "notes.md").read_text(encoding="utf-8")

# ---- section by section ----------------------------------------------------------------------------------------------

TABLE = PAGE.partition("## Section by section\n")[2].partition("\n## ")[0]
ROWS = [cells for cells in re.findall(r"^(.*) \| (.*) \| (.*)$", TABLE, re.MULTILINE) if cells[2] != "command"]

CONTENTS = """
1.1 1.2 1.2.1 1.2.2 1.2.3 1.2.4 2.1 2.2 3.1 3.2 3.2.1 3.2.2 3.2.3 3.2.4 3.2.5 3.2.6 3.2.7 3.3 4.1 4.2 4.3 4.4 4.4.1
4.4.2 4.4.3 4.4.4 5.1 5.2 5.3 5.3.1 5.3.2 5.4 6.1 6.2 6.3 7.1 7.2 8.1 8.1.1 8.2 8.2.1 8.2.2 8.2.3
"""
SECTIONS = CONTENTS.split()
FIGURES = {1: 18, 2: 3, 3: 6, 4: 2, 5: 1, 6: 18, 7: 4, 8: 3}  # how many each chapter has
EQUATIONS = {1: 10, 2: 34, 3: 22, 4: 1, 5: 1, 6: 8, 7: 15, 8: 8}
LISTINGS = {5: 4}

NUMBERS = r"(\d\.\d+(?:\.\d+)*(?:, \d\.\d+(?:\.\d+)*)*)"


def listed(first: str) -> set[str]:
    """Numbers that follow such a word in the table's first column: "Figs. 1.11, 1.12"."""
    found = re.findall(rf"\b(?:{first}) {NUMBERS}", "\n".join(where for where, _, _ in ROWS))
    return {number for numbers in found for number in numbers.split(", ")}


def equations() -> set[str]:
    """Of the first column, with what lies between the ends of "(1.1)–(1.7)"."""
    found: set[str] = set()
    for where, _, _ in ROWS:
        for chapter, first, _, last in re.findall(r"\((\d)\.(\d+)\)(?:–\((\d)\.(\d+)\))?", where):
            found |= {f"{chapter}.{number}" for number in range(int(first), int(last or first) + 1)}
    return found


def all_of(counts: dict[int, int]) -> set[str]:
    return {f"{chapter}.{number}" for chapter, count in counts.items() for number in range(1, count + 1)}


def test_each_section_figure_equation_and_listing_has_a_row() -> None:
    assert set(re.findall(r"§(\d[\d.]*)", "\n".join(where for where, _, _ in ROWS))) == {*SECTIONS}
    assert listed(r"Figs?\.") == all_of(FIGURES)
    assert equations() == all_of(EQUATIONS)
    assert listed("code listings?") == all_of(LISTINGS)


@pytest.mark.parametrize("row", ROWS, ids=[f"{where}: {what}"[:60] for where, what, _ in ROWS])
def test_a_row_says_its_command_or_why_there_is_none(row: tuple[str, str, str]) -> None:
    shown = row[2]
    if shown.startswith("not here: "):
        assert len(shown.split()) > 5, "a few words say why"
        return
    commands = shown.split("`, `")
    assert shown[0] == shown[-1] == "`", "commands and nothing else"
    for command in commands:
        check(command.strip("`"))


OPTIONS = {  # of all commands of the table: what their values may be
    "--robot": robot_names,
    "--arena": arena_names,
    "--on": lambda: ["avr", "native", "shieldbot"],
}
THINGS = {"run": bundled, "arena": arena_names, "robot": robot_names, "experiment": all_experiments}


@cache
def names_of_tests() -> list[str]:
    """Names of all tests of the kit."""
    files = [path for folder in ("host", "sim_bridge", "hil_tests") for path in (ROOT / folder).rglob("test_*.py")]
    return [name for path in files for name in re.findall(r"^def (test_\w+)", path.read_text("utf-8"), re.MULTILINE)]


def check(command: str) -> None:
    """Refuses a command that names an experiment, robot, arena, brain or test that is not there."""
    words = shlex.split(command)
    if words[0] in all_experiments():
        return
    if words[0] == "pytest":
        assert words[1] == "-k" and len(words) == 3 and any(words[2] in name for name in names_of_tests()), command
        return
    assert words[0] == "boebot"
    for option, value in pairwise(words):
        assert option not in OPTIONS or value in OPTIONS[option](), f"{command}: there is no {value}"
    if words[1] in THINGS:
        names = words[2:] if words[1] == "experiment" and "--on" not in words else words[2:3]
        assert names, command
        missing = [name for name in names if name not in THINGS[words[1]]()]
        assert not missing, f"{command}: there is no {words[1]} {', '.join(missing)}"


def test_each_experiment_has_a_row() -> None:
    named = {word for _, _, shown in ROWS for word in re.findall(r"[\w-]+", shown)}
    assert len(all_experiments()) > 40
    assert not [one.bare_name for one in all_experiments().values() if one.bare_name not in named]


# ---- what differs ----------------------------------------------------------------------------------------------------


def test_every_file_is_there() -> None:
    files = re.findall(r"`((?:host|sim_bridge|protocol)/[\w./]+)`", PAGE)
    assert len(files) > 30
    assert not [file for file in files if not (ROOT / file).is_file()]


def test_nothing_cites_what_a_reader_cannot_open() -> None:
    """Papers of those who made the kit, which are not in it."""
    names = re.compile(r"\b(?:THEORY|ANCHORS|HARDWARE)\b[ ,:.]|of the specification|The specification's")
    sources = [
        path
        for folder in ("firmware", "host", "hil_tests", "protocol", "sim_bridge", "tools", "docs")
        for kind in ("*.py", "*.[chS]", "*.toml", "*.md", "*.def")
        for path in (ROOT / folder).rglob(kind)
    ]
    assert len(sources) > 500
    citing = [path for path in sources if names.search(path.read_text(encoding="utf-8")) and path != Path(__file__)]
    assert not citing, [str(path.relative_to(ROOT)) for path in citing]
