"""docs/reference/faults.md has the table of who notices what as `boebot faults --table` makes it, and each fault of the
other bundled robots in its sentences."""

from __future__ import annotations

from pathlib import Path

from boebot.cli.faults import HEADINGS, names_of, row_of
from boebot.description.robots import load_robot, robot_names
from boebot.running.faults import known
from boebot.running.noticed import noticed

PAGE = (Path(__file__).parents[1] / "reference" / "faults.md").read_text(encoding="utf-8")
ALIKE = {"sonar": "ping", "motor": "servos"}  # as the page says


def test_the_page_has_every_fault() -> None:
    robots = [known(load_robot(name)) for name in robot_names()]
    faults = [name.partition(".") for there in robots for name in names_of(there)]
    named = {f"{ALIKE.get(owner, owner)}.{kind}" for owner, _, kind in faults}
    assert [name for name in sorted(named) if name not in PAGE] == []


def test_the_table_is_what_the_command_makes() -> None:
    """To write it anew: boebot faults --robot shieldbot-quad --table, rows as here."""
    robot = load_robot("shieldbot-quad")
    there = known(robot)
    found = list(noticed(robot, names_of(there)))
    assert all(one.verdict for one in found), "each is noticed, or has a reason in boebot.running.noticed"
    rows = [HEADINGS, ["---"] * len(HEADINGS), *(row_of(one, there[one.fault][0]) for one in found)]
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    assert table in PAGE, f"expected:\n{table}"
