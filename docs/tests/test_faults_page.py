"""docs/reference/faults.md has every fault that a bundled robot can have, with its value, and the table of who notices
what as `boebot faults --table` makes it."""

from __future__ import annotations

import re
from pathlib import Path

from boebot.cli.faults import HEADINGS, by_verdict, names_of
from boebot.description.robots import load_robot, robot_names
from boebot.running.faults import known
from boebot.running.noticed import noticed

PAGE = (Path(__file__).parents[1] / "reference" / "faults.md").read_text(encoding="utf-8")
DASHES = ["---"] * len(HEADINGS)
ROWS = {
    name: value
    for names, value in re.findall(r"^\| (`[a-z_]+\.[a-z_`., ]+) \| (.*?) \|", PAGE, flags=re.MULTILINE)
    for name in re.findall(r"`([a-z_.]+)`", names)
}


def test_the_page_has_every_fault_with_its_value() -> None:
    missing = set()
    for robot in map(load_robot, robot_names()):
        there = known(robot)
        for name in names_of(there):
            kind = there[name][0]
            said = kind.words[0] if kind.words else "" if kind.default is None else f"{kind.default:g}"
            if name not in ROWS or said not in ROWS[name].replace("1e-4", "0.0001"):
                missing.add(f"{name}: {said}")
    assert not missing


def test_the_table_is_what_the_command_makes() -> None:
    """To write it anew: boebot faults --robot shieldbot-quad --table, rows as here."""
    robot = load_robot("shieldbot-quad")
    found = list(noticed(robot, names_of(known(robot))))
    assert all(one.verdict for one in found), "each is noticed, or has a reason in boebot.running.noticed"
    for verdict, rows in by_verdict(found).items():
        lines = [f"**{verdict.capitalize()}**", "", *(f"| {' | '.join(row)} |" for row in [HEADINGS, DASHES, *rows])]
        assert "\n".join(lines) in PAGE, "expected:\n" + "\n".join(lines)
