"""docs/reference/faults.md has every fault that a bundled robot can have, with its value."""

from __future__ import annotations

import re
from pathlib import Path

from boebot.description.robots import load_robot, robot_names
from boebot.running.faults import known

PAGE = (Path(__file__).parents[1] / "reference" / "faults.md").read_text(encoding="utf-8")
ROWS = dict(re.findall(r"^\| `([a-z_]+\.[a-z_]+)` \| (.*?) \|", PAGE, flags=re.MULTILINE))


def test_the_page_has_every_fault_with_its_value() -> None:
    missing = set()
    for robot in map(load_robot, robot_names()):
        for name, (kind, whose) in known(robot).items():
            owner, _, what = name.partition(".")
            if whose != (owner,):  # a group of devices
                continue
            stem = re.sub(r"_(left|right|\d+)$", "", owner)
            value = ROWS.get(f"{stem}.{what}")
            said = kind.words[0] if kind.words else "" if kind.default is None else f"{kind.default:g}"
            if value is None or said not in value.replace("1e-4", "0.0001"):
                missing.add(f"{stem}.{what}: {said}")
    assert not missing
