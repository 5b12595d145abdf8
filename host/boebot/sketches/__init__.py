"""Bundled sketches for the Arduino Uno, NAME/NAME.ino. Each says in the comment at its head what it does, with which
robot and in which arena."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).resolve().parent
# In the order in which people learn.
NAMES = ("centring", "dance", "whiskers", "light", "infrared", "distance", "line", "states", "avoider")
_HEAD = re.compile(r"/\* (?P<name>\w+): (?P<title>[^\n]+)\.\n +Robot (?P<robot>[\w-]+), arena (?P<arena>\w+)\.\n")


class Sketch(NamedTuple):
    """What the head of a sketch says."""

    name: str
    title: str
    robot: str
    arena: str
    text: str
    """All of it."""


def sketch(name: str) -> Sketch:
    """The bundled sketch of that name, one of NAMES."""
    text = (FOLDER / name / f"{name}.ino").read_text(encoding="utf-8")
    head = _HEAD.match(text)
    assert head is not None, name
    return Sketch(**head.groupdict(), text=text)
